"""The overview of a campaign: what was found on each day, in a sentence and in digits that it is worth."""

from pathlib import Path

from support.records.told_answers import cause, told

from rig.report.campaign_page import write_page


def test_each_day_says_what_was_found(tmp_path: Path) -> None:
    lag = told(cause("valve_lag", tau_s=(0.0102, 0.0097, 0.0107, "s")), reference="sessions", rms_deg=0.75123)
    days = {"monday": told(verdict="none", rms_deg=0.01937), "tuesday": lag}
    write_page(tmp_path / "days.html", days, {name: tmp_path / f"{name}.html" for name in days}, ["healthy/day_1"])
    monday, tuesday = (tmp_path / "days.html").read_text().split("<tr><td>")[1:]
    assert 'href="monday.html"' in monday
    assert ">0.019</td>" in monday
    assert "<small>" not in monday
    assert "valve_lag<br><small>The regulators answer 10 ms later than on the earlier days" in tuesday
    assert ">0.75</td>" in tuesday
    assert "floor" not in monday + tuesday


def test_a_day_whose_name_is_no_utf8_has_its_link(tmp_path: Path) -> None:
    """All days had been diagnosed by then, and the command ended in a traceback."""
    write_page(tmp_path / "days.html", {"d\udcff": told(verdict="none")}, {"d\udcff": tmp_path / "d\udcff.html"}, [])
    assert 'href="d%FF.html"' in (tmp_path / "days.html").read_text()
