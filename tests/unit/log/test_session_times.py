"""When the records of a session began, as far as they say it."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.errors import RecordError
from rig.log.convert import write_record
from rig.log.reader import read
from rig.log.session_times import LONGEST_SESSION_S, are_numbered, begun_s
from rig.record import Record


def record(**facts: object) -> Record:
    t_s = np.arange(0.0, 20.0, 0.5)
    return Record("sine", t_s, np.zeros_like(t_s), facts=facts)


def begun_at(*seconds: float) -> list[Record]:
    return [record(started_ns=round(1e18 + 1e9 * at)) for at in seconds]


def test_they_count_from_the_first_that_began_in_whatever_order_they_are_given() -> None:
    assert begun_s(begun_at(60.0, 0.0, 30.0)).tolist() == pytest.approx([60.0, 0.0, 30.0])


@pytest.mark.parametrize(
    "stamps",
    [("2026-11-28 10:00:00", "2026-11-28 10:00:45.5"), ("2026-11-28T10:00:00Z", "2026-11-28T11:00:45.5+01:00")],
)
def test_time_stamps_of_a_table_are_as_good(stamps: tuple[str, str]) -> None:
    assert begun_s([record(first_time=stamp) for stamp in stamps]).tolist() == pytest.approx([0.0, 45.5])


def test_a_record_with_both_is_told_by_the_clock_that_it_was_recorded_by() -> None:
    at = datetime(2026, 11, 28, 10, tzinfo=UTC).timestamp()
    records = [record(started_ns=round(at * 1e9), first_time="10:00:00"), record(started_ns=round((at + 30) * 1e9))]
    assert begun_s(records).tolist() == pytest.approx([0.0, 30.0])


def of_a_clock_that_was_set(by_s: float, **facts: object) -> list[Record]:
    """Three records of one minute each, the wall clock set before the third."""
    walls = (0.0, 60.0, 120.0 + by_s)
    return [
        record(started_ns=round(1e18 + 1e9 * wall), loop_ns=round(1e9 * (7 + 60.0 * k)), **facts)
        for k, wall in enumerate(walls)
    ]


@pytest.mark.parametrize("by_s", [-3600.0, 3600.0, -90.0, 20 * 365 * 86400.0])
def test_a_wall_clock_that_was_set_between_them_orders_nothing(by_s: float) -> None:
    """The third of a session had begun before the first, or an hour after the second: what warmed through it did so in
    another order."""
    assert begun_s(of_a_clock_that_was_set(by_s, session="aa")).tolist() == pytest.approx([0.0, 60.0, 120.0])


def test_a_clock_that_begins_anew_with_each_record_is_no_loop_s() -> None:
    """As a table's that was made into a log."""
    records = [record(started_ns=round(1e18 + 60e9 * k), loop_ns=10**9, session="aa") for k in range(2)]
    assert begun_s(records).tolist() == pytest.approx([0.0, 60.0])


def test_the_clocks_of_two_loops_are_not_compared() -> None:
    other = record(started_ns=round(1e18 + 200e9), loop_ns=1, session="bb")
    begun = begun_s([*of_a_clock_that_was_set(0.0, session="aa"), other])
    assert begun.tolist() == pytest.approx([0.0, 60.0, 120.0, 200.0])


@pytest.mark.parametrize(
    "records",
    [
        [record(), record()],
        [*begun_at(0.0), record()],
        [record(started_ns=0), record(started_ns=0)],
        [record(first_time="23:59:50"), record(first_time="00:00:30")],
        begun_at(0.0, 10.0),
        begun_at(0.0, LONGEST_SESSION_S),
    ],
    ids=["nobody says", "one does not", "no clock", "over midnight", "at one time", "of two sessions"],
)
def test_what_cannot_be_told_is_not(records: list[Record]) -> None:
    assert begun_s(records).tolist() == [0.0, 0.0]


def test_times_of_day_are_as_good() -> None:
    assert begun_s([record(first_time=at) for at in ("10:00:00", "10:00:30.5")]).tolist() == pytest.approx([0.0, 30.5])


def test_a_time_that_goes_on_from_file_to_file_is_as_good() -> None:
    assert begun_s([record(t0_s=at) for at in (75.0, 50.0, 100.0)]).tolist() == pytest.approx([25.0, 0.0, 50.0])
    assert begun_s([record(t0_s=0.0), record(t0_s=0.005)]).tolist() == [0.0, 0.0], "each file has its own"


def files(*names: str, **facts: object) -> list[Record]:
    return [replace(record(**facts), source=Path("day") / name) for name in names]


def test_numbered_files_follow_one_another_in_the_order_of_their_numbers() -> None:
    named = files("10_chirp.csv", "9_sine_0.5hz.csv", "11-steps.csv.gz", t0_s=0.0)
    assert begun_s(named).tolist() == pytest.approx([19.5, 0.0, 39.0])
    assert are_numbered(named)
    assert not are_numbered(begun_at(0.0, 30.0))
    timed = [replace(one, facts={"t0_s": at}) for one, at in zip(named, (90.0, 50.0, 120.0), strict=True)]
    assert begun_s(timed).tolist() == pytest.approx([40.0, 0.0, 70.0])
    assert not are_numbered(timed)


@pytest.mark.parametrize(
    "names",
    [
        ("1hz.csv", "2hz.csv"),
        ("0.5_sine.csv", "0.8_sine.csv"),
        ("100_kpa.csv", "200_kpa.csv"),
        ("1_a.csv", "1_b.csv"),
        ("1_a.csv", "b.csv"),
        ("1_a.csv",),
    ],
    ids=["frequencies", "decimals", "far apart", "twice", "one has none", "one"],
)
def test_what_is_no_number_of_a_file_is_none(names: tuple[str, ...]) -> None:
    assert begun_s(files(*names)).tolist() == [0.0] * len(names)
    assert not are_numbered(files(*names))


@pytest.mark.parametrize("started", ["1790000000000000000", 1.5, -1])
def test_a_record_is_not_written_with_a_time_that_is_none(tmp_path: Path, started: Any) -> None:
    """Text was written as 0, without a word: no record of the session knew when it began."""
    (tmp_path / "sine.csv").write_text("t_s,dp_cmd_mpa,angle_deg\n0,0,0\n0.005,0.01,1.5\n0.010,0.02,3\n")
    (sine,) = read(tmp_path / "sine.csv")
    with pytest.raises(RecordError, match=r"made.mcap: fact started_ns: .* allowed: a whole number from 0 to"):
        write_record(sine, tmp_path / "made.mcap", {"started_ns": started})
    assert not (tmp_path / "made.mcap").exists()
    write_record(sine, tmp_path / "made.mcap", {"started_ns": 1_790_000_000_000_000_000})
    assert read(tmp_path / "made.mcap")[0].facts["started_ns"] == 1_790_000_000_000_000_000
