"""When the records of a session began, one after the other: by their dates and the clock of their loop, by a time that
runs through all of them, or by the numbers in their files' names."""

import re
from collections.abc import Sequence
from datetime import date, datetime, time
from typing import Final

import numpy as np

from rig.record import Column, Record

LONGEST_SESSION_S: Final = 4.0 * 3600.0
"""Records that lie further apart are of no one session: what warms through a session has cooled in a night. More: two
sessions of a day may pass for one."""
LOOP_NS: Final = "loop_ns"
"""Fact: when a record began by the clock of the loop that made it, which nobody sets."""
_SET_S: Final = 1.0
"""So far apart the two clocks were not set by degrees, as a time server does with one that is nearly right."""
FULL_NUMBERS: Final = 2.0
"""Numbers of files go on by so much from one to the next in the mean, at most: some records of a session may be
missing. More: the kilopascals in their names pass for an order."""
_NUMBER: Final = re.compile(r"(\d{1,4})(?=[_\- ]|\.(?!\d)|$)")
"""At the beginning of a name: of `2_sine_0.5hz.csv`, not of `2hz.csv` or `0.5_sine.csv`."""


def begun_s(records: Sequence[Record]) -> Column:
    """(r,) seconds after the first began; all 0 where nobody says, where two of them ran at one time, or where they are
    of no single session. Files that are only numbered began as soon as the one before was over."""
    begun = _by_their_times(records)
    if begun is None:
        begun = _by_their_numbers(records)
    return np.zeros(len(records)) if begun is None else begun


def are_numbered(records: Sequence[Record]) -> bool:
    """Whether their order is known by the numbers of their files alone, and no time."""
    return _by_their_times(records) is None and _by_their_numbers(records) is not None


def _by_their_times(records: Sequence[Record]) -> Column | None:
    """(r,) seconds by the best of the clocks that tell a session; None where none does."""
    dates = _from_the_first([_since_an_epoch_s(record) for record in records])
    by_loop = _by_one_loop(records)
    somebody_set_it = dates is not None and by_loop is not None and np.max(np.abs(by_loop - dates)) > _SET_S
    files_own = _from_the_first([_first_time_s(record) for record in records])
    clocks = (by_loop if somebody_set_it else None, dates, files_own)
    return next((begun for begun in clocks if begun is not None and _is_a_session(begun, records)), None)


def _from_the_first(times_s: Sequence[float | None]) -> Column | None:
    """(r,) the same from the earliest; None where one is not known."""
    known = [at for at in times_s if at is not None]
    return np.array([at - min(known) for at in known]) if known and len(known) == len(times_s) else None


def _is_a_session(begun: Column, records: Sequence[Record]) -> bool:
    """One after the other, and close enough."""
    over = begun + [_lasts_s(record) for record in records]
    order = np.argsort(begun)
    return bool(np.all(begun[order][1:] >= over[order][:-1]) and np.max(over) <= LONGEST_SESSION_S)


def _by_one_loop(records: Sequence[Record]) -> Column | None:
    """(r,) by the loop's clock; None where it was not the same loop's, or nobody says."""
    found = [record.facts.get(LOOP_NS) for record in records]
    sessions = {str(record.facts.get("session", "")) for record in records}
    if len(sessions) > 1 or "" in sessions:
        return None
    return _from_the_first([1e-9 * at if isinstance(at, int) and at > 0 else None for at in found])


def _since_an_epoch_s(record: Record) -> float | None:
    """By its date; a time stamp without one counts from midnight."""
    started_ns, stamp = record.facts.get("started_ns"), str(record.facts.get("first_time"))
    if isinstance(started_ns, int) and started_ns > 0:
        return started_ns * 1e-9
    try:
        return datetime.fromisoformat(stamp).timestamp()  # without its zone as good: only differences count
    except ValueError:
        pass
    try:
        return datetime.combine(date(2000, 1, 1), time.fromisoformat(stamp)).timestamp()
    except ValueError:
        return None


def _first_time_s(record: Record) -> float | None:
    """The t_s of its first row, where one clock went on from file to file."""
    first = record.facts.get("t0_s")
    return float(first) if isinstance(first, int | float) else None


def _by_their_numbers(records: Sequence[Record]) -> Column | None:
    """(r,) each in its turn, as long as the longest; None where they are not numbered."""
    found = [_NUMBER.match(record.source.name) if record.source is not None else None for record in records]
    numbers = [int(one[1]) for one in found if one is not None]
    span = max(numbers, default=0) - min(numbers, default=0)
    if len(records) < 2 or len(set(numbers)) < len(records) or span > FULL_NUMBERS * (len(records) - 1):
        return None
    turns = np.array(numbers, dtype=float) - min(numbers)
    begun: Column = turns * max(_lasts_s(record) for record in records)
    return begun if np.max(begun) < LONGEST_SESSION_S else None


def _lasts_s(record: Record) -> float:
    return float(record.t_s[-1] - record.t_s[0])
