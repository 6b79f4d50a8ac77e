"""`pamrig log check`: a sound log gives no finding, and every kind of fault gives the line that names it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.records.made_logs import made_content, made_log

from rig.log.check import check
from rig.log.convert import LogContent, content_of_record, write_content
from rig.log.exchange import export
from rig.record import Record
from rig.sample import Flag


def findings_of(content: LogContent, tmp_path: Path) -> str:
    path = tmp_path / "run.mcap"
    write_content(content, path)
    return "\n".join(check(path))


def test_a_sound_log_has_no_findings(tmp_path: Path) -> None:
    assert findings_of(made_content(500), tmp_path) == ""


def test_a_csv_that_is_in_order(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("t_s,dp_cmd_mpa,angle_deg\n" + "".join(f"{0.005 * k:.3f},0.1,{k % 7}\n" for k in range(50)))
    assert check(path) == []
    path.write_text("t_s,dp_cmd_mpa,angle_deg\n0,0,1\n0.005,0,\n0.010,0,700\n0.050,0,1\n")
    assert check(path) == [
        "angle_deg is outside -360 .. 360 at 1 row, first 700 at second 0.01",
        "angle_deg is missing in 1 of 4 rows",
        "1 gap in time longer than 1.5 periods, first 0.04 s after 0.01 s",
    ]
    path.write_text("t_s,dp_cmd_mpa\n0,x\n")
    assert check(path) == ["row 2: dp_cmd_mpa: 'x' is not a number"]


@pytest.mark.parametrize("name", ["p1_mpa", "p2_mpa", "angle_deg"])
def test_a_table_with_a_measurement_that_has_no_number_is_not_in_order(tmp_path: Path, name: str) -> None:
    """Such a column is no part of the record, which was in order without it."""
    path = tmp_path / "run.csv"
    path.write_text(f"t_s,dp_cmd_mpa,{name}\n" + "".join(f"{0.005 * k:.3f},0.1,nan\n" for k in range(50)))
    assert check(path) == [f"{name} has a column, and no number in it"]


def test_an_export_of_a_rig_without_monitors_is_in_order(tmp_path: Path) -> None:
    """Each of its rows says that there are none."""
    content = content_of_record(Record("made", np.arange(50) * 0.005, np.zeros(50), np.zeros(50)), {})
    export(content, tmp_path / "run.csv", "csv")
    assert check(tmp_path / "run.csv") == []


def test_a_log_of_another_program_is_asked_for_its_time_as_its_table_is(tmp_path: Path) -> None:
    """It has no period, so that its ticks are the rows: a clock that leapt by years was in order."""
    t_s = np.arange(200) * 0.005 + np.where(np.arange(200) < 100, 0.0, 1e9)
    content = content_of_record(Record("made", t_s, np.zeros(200), np.zeros(200)), {})
    assert findings_of(content, tmp_path) == "1 gap in time longer than 1.5 periods, first 1e+09 s after tick 99"
    falling = content.samples["scheduled_ns"].copy()
    falling[100:] -= 2 * falling[100] - 5_000_000
    content.samples.fields["scheduled_ns"][:] = falling
    (tmp_path / "run.mcap").unlink()
    assert "time does not rise: 1 time, first after tick 99" in findings_of(content, tmp_path)


def spoil(name: str, row: int, value: float) -> Callable[[LogContent], None]:
    def change(content: LogContent) -> None:
        content.samples[name][row] = value

    return change


def lose_rows(content: LogContent) -> None:
    keep = np.ones(len(content.samples), bool)
    keep[200:210] = False
    object.__setattr__(content, "samples", content.samples.rows(keep))


def jump(content: LogContent) -> None:
    content.samples.log_time_ns[300:] += 3_600_000_000_000


def old_clock(content: LogContent) -> None:
    content.samples.log_time_ns[:] -= content.samples.log_time_ns[0]


@pytest.mark.parametrize(
    ("change", "finding"),
    [
        (lose_rows, "10 samples were lost between loop and file, first after tick 199"),
        (lose_rows, "10 ticks are missing without being counted as missed, first after tick 199"),
        (lose_rows, "`ticks` says 500, the file has 490"),
        (lose_rows, "`valid` is true, and should be false"),
        (jump, "the log time jumps against the loop's clock, first at tick 300"),
        (old_clock, "the wall clock was not set"),
        (spoil("tick", 100, 50), "ticks do not rise: 1 time, first after tick 99"),
        (spoil("missed", 100, 3), "3 ticks were missed, first before tick 100"),
        (spoil("missed", 100, 1), "1 tick was missed, first before tick 100"),
        (spoil("missed", 100, 1), "1 tick is missing without being counted"),
        (spoil("woken_ns", 100, 0), "woken_ns lies before scheduled_ns at 1 tick, first at tick 100"),
        (spoil("scheduled_ns", 100, 123_456_789_001), "ticks are not due on the grid of 5000000 ns, first at tick 100"),
        (spoil("p1_age_ns", 100, -5), "p1_age_ns is implausible, -5 at tick 100"),
        (spoil("p1_mpa", 100, 0.9), "p1_mpa is outside -0.03 .. 0.6 at 1 row, first 0.9 at tick 100"),
        (spoil("p2_cmd_mpa", 100, 0.51), "p2_cmd_mpa is outside 0 .. 0.5"),
        (spoil("angle_deg", 100, np.inf), "angle_deg is outside -360 .. 360 at 1 row, first inf at tick 100"),
        (spoil("angle_deg", 100, np.nan), "angle_deg is missing without a flag at 1 tick, first at tick 100"),
        (spoil("dp_cmd_mpa", 100, np.inf), "dp_cmd_mpa is no number at 1 tick, first at tick 100"),
        (spoil("dp_cmd_mpa", 100, np.nan), "dp_cmd_mpa is no number at 1 tick, first at tick 100"),
        (spoil("phase", 100, 99), "the phase is none at 1 tick, first at tick 100"),
        (spoil("fault", 400, 9), "fault STALE_VALUE from tick 400 on"),
    ],
)
def test_each_fault_is_named(tmp_path: Path, change: Callable[[LogContent], None], finding: str) -> None:
    content = made_content(500)
    change(content)
    assert finding in findings_of(content, tmp_path)


def test_flagged_values_are_no_findings(tmp_path: Path) -> None:
    content = made_content(500)
    for row, flag, value in ((10, Flag.ANGLE_ABSENT, np.nan), (11, Flag.SUSPECT, 700.0)):
        content.samples["angle_deg"][row] = value
        content.samples["flags"][row] |= int(flag)
    assert findings_of(content, tmp_path) == ""


def test_the_rigs_own_limits_count(tmp_path: Path) -> None:
    rig = b"limits: {pressure_mpa: [0.15, 0.3]}\n"
    content = replace(made_content(500), attachments={"rig.yaml": rig})
    assert "p1_cmd_mpa is outside 0.15 .. 0.3" in findings_of(content, tmp_path)


@pytest.mark.parametrize(
    ("result", "finding"),
    [
        ({"valid": False}, "`valid` is false, and nothing in the samples says why"),
        ({"valid": True, "dropped": 4}, "4 samples were dropped by the recorder"),
        ({"valid": True, "missed": 7}, "`missed` says 7, the file has 0"),
    ],
)
def test_what_the_file_says_of_itself(tmp_path: Path, result: dict[str, object], finding: str) -> None:
    assert finding in findings_of(replace(made_content(200), result_facts=result), tmp_path)


def test_a_run_that_missed_ticks_and_says_so(tmp_path: Path) -> None:
    assert findings_of(made_content(500, missed_at=250), tmp_path) == "2 ticks were missed, first before tick 252"


def test_every_flipped_byte_is_found(tmp_path: Path) -> None:
    """Data, indexes, facts and summary are all under some CRC."""
    path = tmp_path / "run.mcap"
    made_log(path, 150)
    whole = path.read_bytes()
    for place in range(0, len(whole), 97):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x10]) + whole[place + 1 :])
        assert check(path), f"byte {place} of {len(whole)}"


@pytest.mark.parametrize("share", [0.0, 0.3, 0.8, 0.9999])
def test_a_cut_file_is_found(tmp_path: Path, share: float) -> None:
    path = tmp_path / "run.mcap"
    made_log(path, 500)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    assert check(path)
