"""Two records, or two lists of them, beside each other: which goes with which, aligned in time, and how far apart.

Nothing is judged here; `rig.gap` says why a rig differs from its simulator.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rig.channels import FACT, Channels, common
from rig.columns import rms, rows_in_force
from rig.errors import RecordError
from rig.number_text import counted
from rig.own_units import own_plain
from rig.record import MAIN_COLUMNS, MOST_ROWS, Column, Record

Rows = NDArray[np.intp]
COMPARED: Final = tuple(name for name in MAIN_COLUMNS if name != "t_s")
LEAST_OVERLAP: Final = 0.5
"""Share of the shorter record that two records must have in common."""
_SAME_COMMAND: Final = 1e-6
"""Rms of the commands' difference (MPa) below which they need no shift."""
_ON_THE_GRID: Final = 0.2
"""A row that comes this share of a period after its place on the grid is that place's: time stamps jitter and are
rounded. More than half would take the next row."""
_ROUNDING_S: Final = 1e-9
"""By so much may times differ that are the same: what the difference of two clocks is rounded to."""
AS_GOOD: Final = 0.25
ALIKE: Final = 1e-3
"""A periodic command agrees at every period, and never quite the same: another rate, another rounding, another piece of
a period. Shifts are as good when what is left is larger by no more than this share of itself and this share of the
commands' power (3 % of their rms); of these the smallest counts."""


@dataclass(frozen=True)
class Difference:
    """How far one column of B is from that of A, in the column's unit."""

    rms: float
    max: float
    mean: float

    def times(self, factor: float) -> "Difference":
        """The same in another unit."""
        return Difference(factor * self.rms, factor * self.max, factor * self.mean)


@dataclass(frozen=True, eq=False)
class ComparedPair:
    """Two records over the time that they have in common, at the times of A; columns (n,)."""

    name: str
    a: Record
    b: Record
    shift_s: float
    """By how much B lies later than A, by their commands; taken out."""
    differences: dict[str, Difference]
    """Column -> B minus A, for the columns that both have."""

    @property
    def channels(self) -> Channels:
        """What input and output of both are."""
        return self.a.channels

    @property
    def angle(self) -> Difference:
        """The difference of the angles, deg; of a rig with a channel map, of the working values."""
        return self.differences["angle_deg"]

    @property
    def own_differences(self) -> dict[str, Difference]:
        """The same under the rig's own names and in its own units: position_mm."""
        own, found = self.channels, self.differences
        if own.has_valves:
            return found
        input_, output = found["dp_cmd_mpa"], found["angle_deg"]
        return {
            own.input.column: input_.times(own.input_per_mpa),
            own.output.column: output.times(own.output_per_deg),
        }

    def cells(self) -> list[str]:
        """The pair in a table, in its own units: shift, the angle's differences, those of command and pressures."""
        own, found = self.channels, self.differences
        angle, command = self.angle.times(own.output_per_deg), found["dp_cmd_mpa"].times(own.input_per_mpa)
        pressures = ", ".join(f"{found[name].rms:.3g}" for name in ("p1_mpa", "p2_mpa") if name in found)
        numbers = [self.shift_s, angle.rms, angle.max, angle.mean, command.rms]
        return [*(f"{number:.3g}" for number in numbers), *([pressures] if own.has_valves else [])]

    def to_json(self) -> dict[str, Any]:
        """One entry of `records`."""
        others = {name: vars(each) for name, each in self.own_differences.items()}
        plain: dict[str, Any] = {"record": self.name, "a": _place(self.a), "b": _place(self.b), "rows": len(self.a)}
        angle = self.angle
        found = {"shift_s": self.shift_s, "rmse_deg": angle.rms, "max_deg": angle.max, "mean_deg": angle.mean}
        return {**plain, **own_plain(found, self.channels), "columns": others}


@dataclass(frozen=True)
class Comparison:
    """All pairs, and the records that have no counterpart."""

    pairs: list[ComparedPair]
    only_a: list[str] = field(default_factory=list)
    only_b: list[str] = field(default_factory=list)

    @property
    def channels(self) -> Channels:
        """What input and output of all of them are."""
        return self.pairs[0].channels

    @property
    def max_deg(self) -> float:
        """The largest difference of any angle."""
        return max(pair.angle.max for pair in self.pairs)

    @property
    def rmse_deg(self) -> float:
        """Rms of the angles' difference over all pairs together."""
        rows = np.array([len(pair.a) for pair in self.pairs])
        squares = np.array([pair.angle.rms**2 for pair in self.pairs])
        return float(np.sqrt(np.sum(rows * squares) / np.sum(rows)))

    def departures(self, within: float) -> list[str]:
        """A line for each pair whose angles differ by more than that anywhere (deg, or the unit of the rig's own
        output), and for each record without a counterpart."""
        own = self.channels
        most = [(pair.name, own.output_per_deg * pair.angle.max) for pair in self.pairs]
        far = [
            f"{name}: differs by {off:.4g} {own.output.unit}, allowed {within:g}"
            for name, off in most
            if not off <= within
        ]
        return [*far, *(f"{name}: only in A" for name in self.only_a), *(f"{name}: only in B" for name in self.only_b)]

    def to_json(self) -> dict[str, Any]:
        """The result of the command."""
        plain = own_plain({"rmse_deg": self.rmse_deg, "max_deg": self.max_deg}, self.channels)
        plain |= {"only_a": self.only_a, "only_b": self.only_b}
        maps = {} if self.channels.has_valves else {FACT: self.channels.plain()}
        return {"records": [pair.to_json() for pair in self.pairs], **plain, **maps}


def compare(a: Sequence[Record], b: Sequence[Record]) -> Comparison:
    """Records of A beside those of B by name and repeat; one record beside one, whatever they are called.

    RecordError when nothing goes together, a pair has no angles or no time in common, or they are of different rigs.
    """
    common([(_place(record), record.channels) for record in (*a, *b)])
    if len(a) == len(b) == 1:
        return Comparison([beside(a[0], b[0])])
    ours, theirs = _by_name(a), _by_name(b)
    both = [key for key in ours if key in theirs]
    if not both:
        raise RecordError(
            f"no record of A is called like one of B: {', '.join(sorted(ours)[:6])} and {', '.join(sorted(theirs)[:6])}"
        )
    pairs = [replace(beside(ours[key], theirs[key]), name=key) for key in both]
    return Comparison(pairs, [key for key in ours if key not in theirs], [key for key in theirs if key not in ours])


def beside(a: Record, b: Record) -> ComparedPair:
    """B brought to the times of A by their commands."""
    if a.angle_deg is None or b.angle_deg is None:
        raise RecordError(
            f"{(a if a.angle_deg is None else b).name}: it has no angle; needed: a column angle_deg with numbers"
        )
    short = next((record for record in (a, b) if len(record) < 2), None)
    if short is not None:
        raise RecordError(
            f"{_place(short)}: {short.name} has {counted(len(short), 'row')}; two records are compared from 2 rows on"
        )
    shift_s = _shift(a, b)
    there = b.t_s - b.t_s[0] - shift_s
    here = a.t_s - a.t_s[0]
    rows = np.flatnonzero((here >= there[0] - _ROUNDING_S) & (here <= there[-1] + _ROUNDING_S))
    if len(rows) < LEAST_OVERLAP * min(len(a), len(b)) or len(rows) < 2:
        raise RecordError(f"{a.name}: A and B have only {counted(len(rows), 'row')} of A in common")
    ours = a.rows(rows)
    theirs = _at(b, there, here[rows], ours.t_s)
    return ComparedPair(a.name, ours, theirs, shift_s, _differences(ours, theirs))


def _by_name(records: Sequence[Record]) -> dict[str, Record]:
    """Records by what they are called in every session: the name, and the repeat beyond the first. Where two say the
    same (days beside each other), the later one is the next repeat that is free."""
    found: dict[tuple[str, int], Record] = {}
    for record in records:
        repeat = record.facts.get("repeat")
        first = repeat if isinstance(repeat, int) and repeat > 0 else 1
        number = next(number for number in itertools.count(first) if (record.name, number) not in found)
        found[record.name, number] = record
    return {name if number == 1 else f"{name} repeat {number}": record for (name, number), record in found.items()}


def _at(record: Record, there_s: Column, here_s: Column, t_s: Column) -> Record:
    """The record's columns at other times: commands held, what was measured interpolated."""
    held = rows_in_force(there_s, here_s, _ROUNDING_S)
    columns: dict[str, Any] = {}
    for name in COMPARED:
        if (column := getattr(record, name)) is not None:
            columns[name] = column[held] if "cmd" in name else _interpolated(here_s, there_s, column)
    return replace(record, t_s=t_s, extra={}, **columns)


def _interpolated(here_s: Column, there_s: Column, column: Column) -> Column:
    """Between the rows around; NaN beside a missing value."""
    return np.interp(here_s, there_s, column)


def _differences(a: Record, b: Record) -> dict[str, Difference]:
    found = {}
    for name in COMPARED:
        ours, theirs = getattr(a, name), getattr(b, name)
        if ours is None or theirs is None:
            continue
        left = theirs - ours
        left = left[np.isfinite(left)]
        if len(left):
            found[name] = Difference(rms(left), float(np.abs(left).max()), float(left.mean()))
    if "angle_deg" not in found:
        raise RecordError(f"{a.name}: A and B have no row in common where both angles were measured")
    return found


def _shift(a: Record, b: Record) -> float:
    """By how many seconds B's command comes later than A's: 0 where they agree as they stand, else where they agree
    best."""
    dt_s = a.period_s
    ours, theirs = (_on_rows(record, dt_s) for record in (a, b))
    count = min(len(ours), len(theirs))
    if rms(ours[:count] - theirs[:count]) <= _SAME_COMMAND:
        return 0.0
    size = 1 << (len(ours) + len(theirs) - 1).bit_length()
    lags = np.arange(-(len(ours) - 1), len(theirs))
    agreement = np.fft.irfft(np.fft.rfft(theirs, size) * np.conj(np.fft.rfft(ours, size)), size)[lags]
    squares = [
        _sums(column**2, lags, len(ours), len(theirs), first) for column, first in ((ours, True), (theirs, False))
    ]
    overlap = np.minimum(len(ours), len(theirs) - lags) - np.maximum(0, -lags)
    enough = overlap >= LEAST_OVERLAP * count
    missed = np.where(enough, (squares[0] + squares[1] - 2 * agreement) / np.maximum(overlap, 1), np.inf)
    power = float(np.mean(ours**2) + np.mean(theirs**2))
    nearest = _valleys(missed) & (missed <= (1.0 + AS_GOOD) * max(missed.min(), 0.0) + ALIKE * power)
    return float(lags[nearest][np.argmin(np.abs(lags[nearest]))] * dt_s)


def _valleys(values: Column) -> NDArray[np.bool_]:
    """Where neither neighbour is smaller."""
    walled = np.concatenate([[np.inf], values, [np.inf]])
    return np.asarray((values <= walled[:-2]) & (values <= walled[2:]) & np.isfinite(values))


def _sums(squares: Column, lags: Rows, ours: int, theirs: int, first: bool) -> Column:
    """For each lag, the sum of one side's squares over the rows that overlap."""
    total = np.concatenate([[0.0], np.cumsum(squares)])
    begin = np.maximum(0, -lags)
    end = np.maximum(np.minimum(ours, theirs - lags), begin)
    moved = 0 if first else lags
    return np.asarray(total[end + moved] - total[begin + moved])


def _on_rows(record: Record, dt_s: float) -> Column:
    """The command at a regular distance, held between rows; RecordError when that would be more than MOST_ROWS."""
    time = record.t_s - record.t_s[0]
    if time[-1] / dt_s > MOST_ROWS:
        raise RecordError(
            f"{_place(record)}: {len(record)} rows over {time[-1]:.4g} s are {time[-1] / dt_s:.3g} rows of "
            f"{1e3 * dt_s:g} ms; allowed: {MOST_ROWS}; is a time stamp wrong, or in another unit?"
        )
    grid = np.arange(round(time[-1] / dt_s) + 1) * dt_s
    return np.asarray(record.dp_cmd_mpa[rows_in_force(time, grid, _ON_THE_GRID * dt_s)])


def _place(record: Record) -> str:
    return str(record.source or record.name)
