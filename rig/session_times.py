"""When the records of a session began, one after the other: by their dates, by a time that runs through all of them, or
by the numbers in their files' names."""

import re
from collections.abc import Callable, Sequence
from datetime import date, datetime, time
from typing import Final

import numpy as np

from rig.record import Column, Record

LONGEST_SESSION_S: Final = 4.0 * 3600.0
"""Records that lie further apart are of no one session: what warms through a session has cooled in a night. More: two
sessions of a day may pass for one."""
FULL_NUMBERS: Final = 2.0
"""Numbers of files go on by so much from one to the next in the mean, at most: some records of a session may be
missing. More: the kilopascals in their names pass for an order."""
_NUMBER: Final = re.compile(r"(\d{1,4})(?=[_\- ]|\.(?!\d)|$)")
"""At the beginning of a name: of `2_sine_0.5hz.csv`, not of `2hz.csv` or `0.5_sine.csv`."""


def begun_s(records: Sequence[Record]) -> Column:
    """(r,) seconds after the first began; all 0 where nobody says, where two of them ran at one time, or where they are
    of no single session. Files that are only numbered began as soon as the one before was over."""
    clocks: tuple[Callable[[Record], float | None], ...] = (_since_an_epoch_s, _by_the_files_own_time_s)
    for clock in clocks:
        if (begun := _one_after_the_other(records, [clock(record) for record in records])) is not None:
            return begun
    numbered = _by_their_numbers_s(records)
    return np.zeros(len(records)) if numbered is None else numbered


def are_numbered(records: Sequence[Record]) -> bool:
    """Whether their order is known by the numbers of their files alone, and no time."""
    told = ([clock(record) for record in records] for clock in (_since_an_epoch_s, _by_the_files_own_time_s))
    timed = any(_one_after_the_other(records, one) is not None for one in told)
    return not timed and _by_their_numbers_s(records) is not None


def _one_after_the_other(records: Sequence[Record], found: Sequence[float | None]) -> Column | None:
    """The times (s) at which records began, from the first on; None where they are not of one session."""
    known = [at for at in found if at is not None]
    if len(known) < len(records):
        return None
    begun = np.array(known) - min(known)
    over = begun + [_lasts_s(record) for record in records]
    order = np.argsort(begun)
    if np.any(begun[order][1:] < over[order][:-1]) or np.max(over) > LONGEST_SESSION_S:
        return None
    return begun


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


def _by_the_files_own_time_s(record: Record) -> float | None:
    """Its first row's t_s, where one clock went on from file to file."""
    first = record.facts.get("t0_s")
    return float(first) if isinstance(first, int | float) else None


def _by_their_numbers_s(records: Sequence[Record]) -> Column | None:
    """Each in its turn, as long as the longest; None where they are not numbered."""
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
