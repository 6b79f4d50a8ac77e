"""Drop-outs: samples that fall to zero or to a rail and come back, singly or in bursts. They are taken out before
anything is computed.

Whether they are an effect, of which size and how surely is decided in `rig.gap.raw_tests.dropouts`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.columns import filled_in, white_noise
from rig.gap.records.cleaning.filtered import before_filter, passed_in_a_row, through_filter
from rig.gap.records.cleaning.open_input import OpenInput, open_input
from rig.gap.records.settings import (
    ABRUPT,
    FEWEST_DROPOUTS,
    FEWEST_ROWS,
    FEWEST_VALUES,
    LONGEST_BURST_S,
    MOST_DIFFERENT,
    MOST_FALLEN,
    MOST_MOVED,
    OWN_STEPS,
    PASSED_TO,
    RAIL_NOISE,
    RAIL_STEPS,
    RECOVERY_ROWS,
    RETURNS,
    SAME_SHARE,
)
from rig.record import MEASURED_COLUMNS, ZERO_FACT, Column, Record

Rows = NDArray[np.bool_]


@dataclass(frozen=True)
class Dropouts:
    """What was taken out of one column of one record."""

    column: str
    rail: float
    """The rail that was looked at, in the column's unit, from the sensor's own zero."""
    level: float
    """What the fallen samples read in the record, in the middle."""
    fallen: Rows
    """(n,) True where a sample fell."""
    at_rail: Rows
    """(n,) True wherever the column reads the rail for a moment, falls included: where samples fall, nobody can tell
    which of the other readings there are true."""
    visible: Rows
    """(n,) True where the column is far enough from the rail for a fall to be told from its own motion."""
    bursts: int
    power: float
    """What they add to the mean square of the column, unit squared."""


def without_dropouts(records: Sequence[Record]) -> tuple[list[Record], list[tuple[Dropouts, ...]]]:
    """The records of one day with fallen samples missing (NaN), and what was taken out of each.

    A rail is one value of the sensor for all records of a day, whatever zero each of them took. Zero and the lowest and
    the highest value of a column are tried as rails; those that the samples cannot tell apart count as one. Falls of
    the angle are found behind a filter as well.
    """
    found = [_in_columns(records, name) for name in MEASURED_COLUMNS]
    kept = [tuple(one for column in found for one in column[k]) for k in range(len(records))]
    return [_taken_out(record, mine) for record, mine in zip(records, kept, strict=True)], kept


def _in_columns(records: Sequence[Record], name: str) -> list[list[Dropouts]]:
    """What fell in one column of each record of a day, where it fell often enough."""
    zeros = [_zero_of(record, name) for record in records]
    columns = [_from_zero(getattr(record, name), zero) for record, zero in zip(records, zeros, strict=True)]
    measured = [column for column in columns if column is not None and np.isfinite(column).any()]
    passed = passed_in_a_row(measured) if name == "angle_deg" else 1.0
    seen = {id(read): _seen(read, passed) for read in measured}
    rails = _rails(list(seen.values()), _nothing_read(records, name))
    found = [
        [
            replace(one, level=one.level - zero)
            for one in _in_column(name, seen[id(read)], _longest_rows(record), rails, passed)
        ]
        if id(read) in seen
        else []
        for record, read, zero in zip(records, columns, zeros, strict=True)
    ]
    clear = _often_enough(found)
    kept = [[one for one in mine if one.rail in clear] for mine in found]
    away = _run_away(records) if name == "angle_deg" else []
    return away if _samples(away) > _samples(kept) else kept


def _zero_of(record: Record, name: str) -> float:
    """What the record's zero of the angle is by the sensor's own, deg."""
    zero = record.facts.get(ZERO_FACT)
    return float(zero) if name == "angle_deg" and isinstance(zero, int | float) else 0.0


def _from_zero(column: Column | None, zero: float) -> Column | None:
    """A column as its sensor gave it."""
    return column if column is None or zero == 0.0 else column + zero


def _samples(found: Sequence[Sequence[Dropouts]]) -> int:
    return sum(int(one.fallen.sum()) for mine in found for one in mine)


def _run_away(records: Sequence[Record]) -> list[list[Dropouts]]:
    """What fell in the angle of each record of a day while its input was open."""
    columns = [record.angle_deg for record in records]
    read = [column for column in columns if column is not None and np.isfinite(column).sum() >= FEWEST_ROWS]
    longest = max(map(_longest_rows, records), default=1)
    source = open_input(read, longest) if read else None
    if source is None:
        return []
    return [
        [] if column is None or len(column) < FEWEST_ROWS else list(_open(column, source, _longest_rows(record)))
        for record, column in zip(records, columns, strict=True)
    ]


def _open(column: Column, source: OpenInput, longest: int) -> Iterator[Dropouts]:
    fallen, bursts = source.fallen(column, longest)
    if bursts and fallen.mean() < MOST_FALLEN:
        course = filled_in(np.where(fallen, np.nan, column))
        visible = np.isfinite(column) & source.visible(course)
        power = float(np.nansum(np.where(fallen, column - course, 0.0) ** 2) / len(column))
        yield Dropouts("angle_deg", source.rail, source.rail, fallen, fallen, visible, bursts, power)


def _longest_rows(record: Record) -> int:
    """Rows that samples may fall for; one in a record that has no period."""
    return max(1, int(LONGEST_BURST_S / record.period_s)) if len(record) > 1 else 1


@dataclass(frozen=True)
class _Seen:
    """One column of one record; (n,) as it is read, and as it was before a filter."""

    read: Column
    before: Column
    near: float
    """How far from a rail a fallen sample may read."""


def _seen(read: Column, passed: float) -> _Seen:
    before = before_filter(read, passed)
    return _Seen(read, before, _tolerance(before))


def _nothing_read(records: Sequence[Record], name: str) -> float:
    """What a column holds where its sensor gives nothing: 0 in the sensor's own unit, which need not be the middle of
    its range."""
    return float(records[0].channels.working_output(0.0)) if records and name == "angle_deg" else 0.0


def _rails(seen: Sequence[_Seen], nothing: float) -> tuple[float, ...]:
    if not seen:
        return ()
    rails, near = [nothing], max(one.near for one in seen)
    for end in (min(np.nanmin(one.before) for one in seen), max(np.nanmax(one.before) for one in seen)):
        if all(abs(end - rail) > near for rail in rails):
            rails.append(float(end))
    return tuple(rails)


def _in_column(name: str, seen: _Seen, longest: int, rails: Sequence[float], passed: float) -> Iterator[Dropouts]:
    """What fell in a column that is read through a filter which passes such a share of a step in a row; `longest`:
    rows of a burst."""
    read, column, near = seen.read, seen.before, seen.near
    if np.isfinite(read).sum() < FEWEST_ROWS or not _jumps(read):
        return
    if passed < 1.0:
        near = max(near, PASSED_TO * float(np.ptp(column[np.isfinite(column)])))
    at = {rail: np.abs(column - rail) <= near for rail in rails}
    # a coarse converter stays within reach of a rail while the joint turns there: that is no fall
    jump = OWN_STEPS * (_largest_own_step(column, np.any(list(at.values()), axis=0)) + near)
    known = column
    for rail, rows in at.items():
        fallen, moments, bursts = _falls(known, rows, jump, longest)
        known = np.where(fallen, np.nan, known)  # nothing falls from where a sample had fallen to
        if bursts and fallen.mean() < MOST_FALLEN:
            course = filled_in(np.where(fallen, np.nan, column))
            visible = np.isfinite(column) & (np.abs(course - rail) > jump)
            level = float(np.median(column[fallen]))
            if passed < 1.0:
                fell = read - through_filter(filled_in(np.where(moments, np.nan, column)), passed)
                moments = np.abs(fell) > _tolerance(read)
            else:
                fell = np.where(fallen, column - course, 0.0)
            power = float(np.nansum(fell**2) / len(column))
            yield Dropouts(name, rail, level, fallen, moments, visible, bursts, power)


def _jumps(column: Column) -> bool:
    """Whether any step stands out at all; most columns are done here."""
    steps = np.abs(np.diff(column[np.isfinite(column)]))
    return bool(steps.max() > OWN_STEPS * np.median(steps))


def _tolerance(column: Column) -> float:
    """How far from a rail a fallen sample may read: some of the smallest usual steps between different values, a
    converter's, or what the column's own noise spreads over."""
    known = column[np.isfinite(column)]
    values = np.unique(known)
    few = FEWEST_VALUES <= len(values) < MOST_DIFFERENT * len(column)
    steps = RAIL_STEPS * float(np.median(np.diff(values))) if few else SAME_SHARE * float(np.ptp(values) or 1.0)
    if len(known) <= FEWEST_ROWS:
        return steps
    # what moves far from row to row looks like noise
    return max(steps, min(RAIL_NOISE * _noise(known), PASSED_TO * float(np.ptp(known))))


def _noise(column: Column) -> float:
    """White noise of a column beside what is abrupt in it: many falls are no noise."""
    steps = np.abs(np.diff(column))
    abrupt = steps > ABRUPT * np.median(steps)
    quiet = column.copy()
    quiet[1:][abrupt] = quiet[:-1][abrupt] = np.nan
    return float(np.nan_to_num(white_noise([quiet])))


def _largest_own_step(column: Column, at_rail: Rows) -> float:
    """The largest step of a column between rows that no rail can have touched."""
    touched = at_rail.copy()
    for row in range(1, RECOVERY_ROWS + 2):
        touched[row:] |= at_rail[:-row]
    steps = np.abs(np.diff(column))
    own = steps[~(touched[1:] | touched[:-1]) & np.isfinite(steps)]
    return float(own.max()) if len(own) else np.inf


def _falls(column: Column, at_rail: Rows, jump: float, longest: int) -> tuple[Rows, Rows, int]:
    """Three things: (n,) True in bursts that begin with a jump of at least `jump` and come back to where they began;
    (n,) True in these, in the rows that a filter takes to come back, and in every other stay at the rail of at most
    `longest` rows; and the number of bursts."""
    fallen, moments, bursts = np.zeros(len(column), dtype=bool), np.zeros(len(column), dtype=bool), 0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], at_rail, [False]]).astype(np.int8)))
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start > longest or (start == 0 and end == len(column)):
            continue
        moments[start:end] = True
        back = _back_at(column, start, end, jump)
        if back is not None:
            fallen[start:end] = True
            moments[start:back] = True
            bursts += 1
    return fallen, moments, bursts


def _back_at(column: Column, start: int, end: int, jump: float) -> int | None:
    """The first row after a stay at the rail (rows `start` to `end`) that reads as before it, at most RECOVERY_ROWS
    later; None when the stay is no fall. At either end of the record only one jump can be seen: there the two rows
    beyond the jump must be alike, else these are what stands out."""
    before = column[start - 1] if start > 0 else column[end]
    depth = abs(before - column[start])
    if not depth > jump:
        return None
    beside = (end, end + 1) if start == 0 else (start - 1, start - 2)
    if (start == 0 or end == len(column)) and min(beside) >= 0 and max(beside) < len(column):
        here, beyond = column[list(beside)]
        if abs(here - beyond) > jump:
            return None
    for row in range(end, min(end + RECOVERY_ROWS + 1, len(column))):
        moved = (row - start + 1) * jump / OWN_STEPS
        if abs(column[row] - before) < min(max(RETURNS * depth, moved), MOST_MOVED * depth):
            return row
    return end if end == len(column) else None


def _often_enough(found: Sequence[Sequence[Dropouts]]) -> set[float]:
    """The rails to which enough samples fell."""
    counts: dict[float, int] = {}
    for one in (one for mine in found for one in mine):
        counts[one.rail] = counts.get(one.rail, 0) + int(one.fallen.sum())
    return {rail for rail, count in counts.items() if count >= FEWEST_DROPOUTS}


def _taken_out(record: Record, dropouts: Sequence[Dropouts]) -> Record:
    columns: dict[str, Any] = {one.column: getattr(record, one.column).copy() for one in dropouts}
    for one in dropouts:
        columns[one.column][one.at_rail] = np.nan
    return replace(record, **columns) if columns else record
