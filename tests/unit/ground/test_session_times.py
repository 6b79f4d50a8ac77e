"""When the records of a session began, as far as they say it."""

from datetime import UTC, datetime

import numpy as np
import pytest

from rig.record import Record
from rig.session_times import LONGEST_SESSION_S, begun_s


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


@pytest.mark.parametrize(
    "records",
    [
        [record(), record()],
        [*begun_at(0.0), record()],
        [record(started_ns=0), record(started_ns=0)],
        [record(first_time="10:00:00"), record(first_time="10:00:30")],
        begun_at(0.0, 10.0),
        begun_at(0.0, LONGEST_SESSION_S),
    ],
    ids=["nobody says", "one does not", "no clock", "a time of no day", "at one time", "of two sessions"],
)
def test_what_cannot_be_told_is_not(records: list[Record]) -> None:
    assert begun_s(records).tolist() == [0.0, 0.0]
