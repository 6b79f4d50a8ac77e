"""Tables as Excel and loggers write them: time stamps in place of seconds, UTF-16, thousands that are parted."""

from pathlib import Path

import numpy as np
import pytest

from rig.app.records.logs import import_content, proposed_mapping
from rig.errors import RecordError
from rig.log.convert import LogContent
from rig.log.foreign.delimited import Style, read_table
from rig.log.foreign.guess import guess
from rig.log.foreign.stamps import stamp

T_MS = 5 * np.arange(400)
SINE = np.sin(2 * np.pi * 0.5 * 1e-3 * T_MS)


def cells(start_ms: int, form: str) -> list[str]:
    """A time stamp every 5 ms, from so long after midnight."""
    out = []
    for now in (start_ms + T_MS) % 86_400_000:
        seconds, ms = divmod(int(now), 1000)
        out.append(form.format(h=seconds // 3600, m=seconds // 60 % 60, s=seconds % 60, ms=ms))
    return out


def table(folder: Path, times: list[str], separator: str = ",", decimal: str = ".", encoding: str = "utf-8") -> Path:
    rows = [
        separator.join([time, f"{0.2 * one:.6f}".replace(".", decimal), f"{20 * one:.6f}".replace(".", decimal)])
        for time, one in zip(times, SINE, strict=True)
    ]
    path = folder / "unknown.csv"
    path.write_bytes("\r\n".join([separator.join(["Uhr", "Soll (MPa)", "Winkel"]), *rows, ""]).encode(encoding))
    return path


def imported(path: Path) -> LogContent:
    """The table by its own proposal."""
    mapping = path.with_name("mapping.yaml")
    mapping.write_text(proposed_mapping(path)[1], encoding="utf-8")
    return import_content(path, mapping)[0]


CLOCK = "{h:02d}:{m:02d}:{s:02d}.{ms:03d}"


@pytest.mark.parametrize(
    ("form", "style"),
    [
        (CLOCK, {}),
        ("{h}:{m:02d}:{s:02d}.{ms:03d}", {}),
        (CLOCK.replace(".", ","), {"separator": ";", "decimal": ","}),
        (CLOCK, {"separator": "\t", "encoding": "utf-16"}),
        ("2026-03-05 " + CLOCK, {}),
        ("2026-03-05T" + CLOCK.replace(".", ","), {"separator": ";", "decimal": ",", "encoding": "utf-16"}),
        ("2026-03-05T" + CLOCK + "000Z", {"separator": ";"}),
        ("2026-03-05 " + CLOCK + "+01:00", {}),
    ],
)
def test_time_stamps_are_the_time_of_a_table(tmp_path: Path, form: str, style: dict[str, str]) -> None:
    """All were refused, or left out as text."""
    start_ms = 50_582_125
    path = table(tmp_path, cells(start_ms, form), **style)
    found = guess(path)
    assert found.mapping["columns"]["t_s"] == {"source": "Uhr", "unit": "s"}
    assert "time: 'Uhr' in s (the file says): 400 rows every 5 ms" in found.meaning
    assert not any("Uhr" in doubt for doubt in found.doubts)
    content = imported(path)
    assert np.diff(content.samples["scheduled_ns"]).tolist() == [5_000_000] * 399
    assert content.samples["angle_deg"] == pytest.approx(20 * SINE, abs=1e-5)
    assert content.run_facts["first_time"] == cells(start_ms, form)[0]
    midnight_ns = 1_772_668_800 * 10**9 - 3600 * 10**9 * ("+01" in form)
    zoned = form.endswith(("Z", "+01:00"))
    assert content.run_facts.get("started_ns") == (midnight_ns + start_ms * 10**6 if zoned else None)


def test_a_time_of_day_goes_on_past_midnight_and_never_back(tmp_path: Path) -> None:
    content = imported(table(tmp_path, cells(86_399_000, CLOCK)))
    assert np.diff(content.samples["scheduled_ns"]).tolist() == [5_000_000] * 399
    back = cells(50_000_000, CLOCK)
    back[200:] = cells(50_000_000 - 3_600_000, CLOCK)[200:]
    with pytest.raises(RecordError, match=r"no column of numbers rises .* nor one of time stamps \(14:03:02.125 or"):
        guess(table(tmp_path, back))


def test_stamps_of_two_kinds_are_refused_with_their_row(tmp_path: Path) -> None:
    times = cells(50_582_125, CLOCK)
    times[7] = "35.2"
    with pytest.raises(RecordError, match=r"row 9: Uhr: '35.2' is not a time stamp like the first$"):
        guess(table(tmp_path, times))


def test_a_stamp_is_no_pressure_and_no_milliseconds(tmp_path: Path) -> None:
    path, mapping = table(tmp_path, cells(50_582_125, CLOCK)), tmp_path / "by_hand.yaml"
    others = "dp_cmd_mpa: {source: Soll (MPa), unit: MPa}, angle_deg: {source: Winkel, unit: deg}"
    mapping.write_text(f"columns: {{t_s: {{source: Uhr}}, {others}}}")
    assert import_content(path, mapping)[0].run_facts["first_time"] == "14:03:02.125"
    for wrong, said in (
        (f"columns: {{t_s: {{source: Uhr, unit: ms}}, {others}}}", "the mapping says 'ms' and the file 's'"),
        ("period_s: 0.005\ncolumns: {dp_cmd_mpa: {source: Uhr}}", "the unit 's' does not fit dp_cmd_mpa"),
    ):
        mapping.write_text(wrong)
        with pytest.raises(RecordError, match=said):
            import_content(path, mapping)


def test_a_second_time_is_named_and_no_command(tmp_path: Path) -> None:
    """A date and time to the second stood in the place of the input, as it comes first and moves."""
    rows = [
        f"2026-03-05 14:00:{now // 1000:02d},{now / 1e3:.3f},{one:.6f},{2 * one:.6f}"
        for now, one in zip(T_MS, SINE, strict=True)
    ]
    path = tmp_path / "unknown.csv"
    path.write_text("when,time,a,b\n" + "\n".join(rows) + "\n")
    found = guess(path)
    assert {name: one["source"] for name, one in found.mapping["columns"].items()} == {
        "t_s": "time", "input": "a", "output": "b"
    }  # fmt: skip
    assert "not imported, as they are further times: 'when'" in found.meaning
    assert len(imported(path).samples) == 400


@pytest.mark.parametrize(
    "cell",
    [
        "",
        "14:03",
        "14:60:00",
        "03/05/2026 14:03:02",
        "5.3.2026 14:03:02",
        "2026-13-01 00:00:00",
        "14:03:02 pm",
        "1:2:3",
    ],
)
def test_what_may_be_read_in_two_ways_is_no_stamp(cell: str) -> None:
    assert stamp(cell) is None


@pytest.mark.parametrize("mark", ["utf-16-le", "utf-16-be"])
def test_utf_16_says_what_it_is(tmp_path: Path, mark: str) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes("\ufeffa,b °\n1,2\n".encode(mark))
    assert list(read_table(path)) == ["a", "b °"]
    path.write_bytes("a,b\n1,2\n".encode(mark))
    with pytest.raises(RecordError, match="neither MCAP, TDMS nor text in UTF-8, UTF-16 or Windows-1252"):
        read_table(path)


@pytest.mark.parametrize(
    ("cell", "style"),
    [
        ('"1,234.5"', Style()),
        ("1 234.5", Style()),
        ("1'234.5", Style()),
        ("1\N{NO-BREAK SPACE}234,5", Style(";", ",")),
        ("1.234.567", Style()),
    ],
)
def test_parted_thousands_are_said_to_be_that(tmp_path: Path, cell: str, style: Style) -> None:
    """The first was said to have a decimal comma, and with one to have a point; of the others nothing was said."""
    path = tmp_path / "table.csv"
    path.write_text(f"a{style.separator}b\n0{style.separator}{cell}\n", encoding="utf-8")
    with pytest.raises(RecordError, match=r"is not a number; take out what parts thousands$"):
        read_table(path, style)


def test_a_column_of_parted_thousands_is_no_text(tmp_path: Path) -> None:
    """It was left out, as one that holds text."""
    angles = [f"{20 * one:.3f}".replace(".", ",") for one in SINE]
    rows = [f"{now};1.{100 + k},5;{angle}" for k, (now, angle) in enumerate(zip(T_MS, angles, strict=True))]
    path = tmp_path / "unknown.csv"
    path.write_text("ms;Soll (mbar);Winkel\n" + "\n".join(rows) + "\n")
    with pytest.raises(RecordError, match=r"row 2: Soll \(mbar\): '1.100,5' is not a number; a point beside decimal"):
        guess(path)
