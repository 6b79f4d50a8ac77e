"""Which days a history is of, and in which order: by the dates in the folders' names, and by the records where these
leave it open. What the diagnoses say is taken out."""

import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from support.records.made_logs import made_content

from rig.app.gap import history
from rig.app.gap.diagnosis_options import DiagnosisOptions, NamedDay, cases_of
from rig.errors import ConfigError
from rig.log.convert import write_content

NOON_NS = 1_773_057_600 * 10**9
"""9 March 2026, 12:00 UTC."""
HOUR_NS = 3600 * 10**9


@pytest.fixture(autouse=True)
def _no_diagnosis(monkeypatch: pytest.MonkeyPatch) -> None:
    def campaign(_: Any, cases: list[NamedDay], *__: Any) -> Any:
        return SimpleNamespace(diagnoses={case.name: None for case in cases})

    monkeypatch.setattr(history, "diagnose_campaign", campaign)
    monkeypatch.setattr(history, "day_of", lambda name, days, _: SimpleNamespace(name=name, days=days))


def day(folder: Path, started_ns: int, seed: int = 1) -> None:
    folder.mkdir(parents=True)
    content = made_content(50, seed)
    content.samples.log_time_ns[:] += started_ns - content.samples.log_time_ns[0]
    write_content(content, folder / "a.mcap")


def order(folder: Path) -> list[tuple[str, float]]:
    days, _ = history.history_days(DiagnosisOptions(Path("simulated"), ()), cases_of((folder,)), 1)
    return [(one.name, round(one.days, 3)) for one in days]


def test_sessions_of_one_date_stand_in_the_order_in_which_they_were_recorded(tmp_path: Path) -> None:
    """By their names the evening would come before the morning, and a change stand at the wrong one."""
    day(tmp_path / "2026-03-09_morning", NOON_NS - 4 * HOUR_NS, 1)
    day(tmp_path / "2026-03-09_evening", NOON_NS + 8 * HOUR_NS, 2)
    day(tmp_path / "2026-03-10", NOON_NS + 24 * HOUR_NS, 3)
    assert [name for name, _ in order(tmp_path)] == ["2026-03-09_morning", "2026-03-09_evening", "2026-03-10"]


def test_records_of_a_clock_that_was_not_set_leave_a_date_as_it_is(tmp_path: Path) -> None:
    day(tmp_path / "2026-03-09_a", NOON_NS)
    day(tmp_path / "2026-03-09_b", 1000, 2)
    assert order(tmp_path) == [("2026-03-09_b", 0.0), ("2026-03-09_a", 0.5)]


@pytest.mark.parametrize("name", ["rig_12345678_2026-03-08", "sn87654321-20260308T235959Z", "10020260308"])
def test_other_numbers_in_a_name_hide_no_date(tmp_path: Path, name: str) -> None:
    """The first eight digits were taken for the only date there may be; then the records' clock counted."""
    day(tmp_path / "2026-03-09", NOON_NS)
    day(tmp_path / name, NOON_NS + 99 * HOUR_NS, 2)
    assert order(tmp_path)[0][0] == name


def test_a_copy_of_a_day_is_no_further_day(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    day(tmp_path / "2026-03-09", NOON_NS)
    day(tmp_path / "2026-03-10", NOON_NS, 2)
    shutil.copytree(tmp_path / "2026-03-09", tmp_path / "2026-03-09 (copy)")
    assert [name for name, _ in order(tmp_path)] == ["2026-03-09", "2026-03-10"]
    (said,) = caplog.messages
    assert (
        said == f"{tmp_path}/2026-03-09 (copy): passed over: the same files as {tmp_path}/2026-03-09, which counts once"
    )
    shutil.rmtree(tmp_path / "2026-03-10")
    with pytest.raises(ConfigError, match="copies of one day"):
        order(tmp_path)


def test_a_day_that_cannot_be_read_does_not_end_the_others(tmp_path: Path) -> None:
    """Its diagnosis will say so, beside what the others say; here the name without a date had its records read."""
    day(tmp_path / "2026-03-09", NOON_NS)
    (tmp_path / "cut").mkdir()
    (tmp_path / "cut" / "a.mcap").write_bytes((tmp_path / "2026-03-09" / "a.mcap").read_bytes()[:-500])
    assert order(tmp_path)[0][0] == "2026-03-09"
