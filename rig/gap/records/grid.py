"""A record and its partners on one regular grid, smoothed: aligned in phase, whole periods, at the case's own input."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rig.conditions import taken_rest
from rig.excite.setpoints import around
from rig.gap.records.alignment import on_clock_of
from rig.gap.records.cleaning.dropouts import Dropouts, Rows
from rig.gap.records.holes import bridged, unsettled, with_rows
from rig.gap.records.own_input import at_input, differs
from rig.gap.records.partners import Partner
from rig.gap.records.periods import whole_periods
from rig.gap.records.settings import LEAST_COVERED_SAID, LONGEST_BRIDGE_S
from rig.identify.response.response_fit import GRID_S, SMOOTHING_S
from rig.record import Column, Record
from rig.smoothing import smoothed

_Kind = TypeVar("_Kind", np.float64, np.bool_)


@dataclass(frozen=True)
class RunColumns:
    """One run of one sweep on the grid, smoothed; columns of shape (n,), None where not measured."""

    p1_mpa: Column | None
    p2_mpa: Column | None
    angle_deg: Column


@dataclass(frozen=True)
class Pair:
    """A record of the case, its command, and every earlier day's run of the same sweep."""

    name: str
    dt_s: float
    t_s: Column
    u1_mpa: Column
    u2_mpa: Column
    case: RunColumns
    days: tuple[RunColumns, ...]
    used: Column
    """1 where the case and its earlier days were measured, 0 in holes, where one of them did not run yet, and at the
    smoothing's edges."""
    raw: Record
    """The case as it was read, without fallen samples. Its holes have rows with a command and nothing measured."""
    raw_days: tuple[Record, ...]
    """The same of each earlier day, on the case's clock; in the order of `days`."""
    stamps_s: Column
    """(m,) the time stamps of the case's record as it was read."""
    dropouts: tuple[Dropouts, ...] = ()
    """What fell in the case's record."""
    day_dropouts: tuple[tuple[Dropouts, ...], ...] = ()
    """What fell in each earlier day's."""
    day_numbers: tuple[int, ...] = ()
    """Of the earlier days, counted from 1 as they were given."""
    other_input: bool = False
    """The input of the earlier days is not exactly the case's: `days` are what they would have been at the case's."""
    begun_s: float = 0.0
    """When the record began, after the first of its session; 0 for all where nobody says."""
    counts_from_rest: bool = False
    """Every record begins at zero, though none says what was taken for it (`own_zero.count_from_rest`)."""

    def __len__(self) -> int:
        return len(self.t_s)

    @property
    def zeroed(self) -> bool:
        """The angle at rest was taken for zero at the start of the case's record."""
        return self.raw.zeroed or self.counts_from_rest


@dataclass(frozen=True)
class _Grid:
    """The rows on which a record and its partners are laid; times in s from the record's start."""

    start_s: float
    """Of the record, on its own clock."""
    length_s: float
    """That the record and its partners have in common."""
    fine_s: Column
    """(m,) at the record's own period, on which it is smoothed."""
    fine_dt_s: float
    stride: int
    """Fine rows from one row of the grid to the next."""
    t_s: Column
    """(n,) the grid, whole periods where the command is periodic."""

    @property
    def dt_s(self) -> float:
        """From one row of the grid to the next."""
        return self.fine_dt_s * self.stride

    def rows_of(self, fine: NDArray[_Kind]) -> NDArray[_Kind]:
        """(n,) the grid's rows of a column (m,) over the fine ones."""
        return fine[:: self.stride][: len(self.t_s)]

    def input_of(self, record: Record) -> Column:
        """(n,) the command (MPa) of a record on the grid."""
        course: Column = np.interp(self.t_s, record.t_s - self.start_s, record.dp_cmd_mpa)
        return course


def rows_apart(period_s: float) -> int:
    """Samples of a record of that period from one row of the grid to the next."""
    return max(1, round(GRID_S / period_s))


def pair_on_grid(
    record: Record,
    partners: Sequence[Partner],
    p0_mpa: float,
    pressures: bool,
    fallen: Sequence[tuple[Dropouts, ...]],
) -> tuple[Pair, str]:
    """The record and its partners on one grid, smoothed, cut to whole periods where the command is periodic; and a note
    where the record goes on for much longer than its partners, else nothing.

    `fallen` holds what fell in the record, and then in each partner's.
    """
    read, start_s = record, float(record.t_s[0])
    theirs = [
        replace(partner.record, t_s=on_clock_of(partner.record, partner.alignment) + start_s) for partner in partners
    ]
    record, others = with_rows(read, theirs), tuple(with_rows(other, [read]) for other in theirs)
    grid = _grid_of(record, others)
    u1, u2 = _commands(record, grid.t_s, p0_mpa)
    (case, *days), hole = _runs_of((record, *others), grid, (u1, u2), pressures)
    used = (~(hole | unsettled(read, theirs, grid.t_s + start_s))).astype(float)
    used[-max(1, round(2 * SMOOTHING_S / grid.dt_s)) :] = 0.0
    pair = Pair(
        name=record.name,
        dt_s=grid.dt_s,
        t_s=grid.t_s,
        u1_mpa=u1,
        u2_mpa=u2,
        case=case,
        days=tuple(days),
        used=used,
        raw=record,
        raw_days=others,
        stamps_s=read.t_s,
        dropouts=fallen[0],
        day_dropouts=tuple(fallen[1:]),
        day_numbers=tuple(partner.session for partner in partners),
        other_input=any(differs(grid.input_of(record), grid.input_of(other)) for other in others),
    )
    return pair, _uncovered(record, grid)


def _grid_of(record: Record, others: Sequence[Record]) -> _Grid:
    """The rows that a record has in common with its partners, which are on its clock."""
    start_s, dt_s = float(record.t_s[0]), max(record.period_s, 1e-4)
    length_s = min(float(each.t_s[-1]) - start_s for each in (record, *others))
    fine_s, stride = np.arange(0.0, length_s + 0.5 * dt_s, dt_s), rows_apart(dt_s)
    every = _Grid(start_s, length_s, fine_s, dt_s, stride, fine_s[::stride])
    return replace(every, t_s=every.t_s[: whole_periods(every.input_of(record))].copy())


def _runs_of(
    records: Sequence[Record], grid: _Grid, set_points: tuple[Column, Column], pressures: bool
) -> tuple[list[RunColumns], Rows]:
    """The records on the grid, at the first one's input and with pressures in their holes; and True in the holes of
    any."""
    found = [_session(record, grid, pressures) for record in records]
    holes, inputs = [hole for _, hole in found], [grid.input_of(record) for record in records]
    runs = [_at_own_input(run, own, inputs[0], grid.dt_s) for (run, _), own in zip(found, inputs, strict=True)]
    return _through_holes(runs, holes, set_points), np.any(holes, axis=0)


def _uncovered(record: Record, grid: _Grid) -> str:
    """A note where a record goes on for much longer than the rows that it has in common with its partners."""
    own_s = float(record.t_s[-1]) - grid.start_s
    if not grid.length_s < LEAST_COVERED_SAID * own_s:
        return ""
    length = f"only {grid.length_s:.3g} of its {own_s:.3g} s have a baseline"
    return f"{record.name}: {length}; what came after is not looked at"


def _at_own_input(session: RunColumns, theirs: Column, mine: Column, dt_s: float) -> RunColumns:
    """The session as it would have been under the case's own input, where that is not the same: a measured one never
    is."""
    if not differs(mine, theirs):
        return session

    def moved(column: Column | None) -> Column | None:
        return None if column is None else at_input(column, theirs, mine, dt_s)

    return RunColumns(moved(session.p1_mpa), moved(session.p2_mpa), at_input(session.angle_deg, theirs, mine, dt_s))


def _through_holes(
    runs: Sequence[RunColumns], holes: Sequence[Rows], set_points: tuple[Column, Column]
) -> list[RunColumns]:
    """The runs with pressures in their holes as well: those of the first other run that was measured there, or the
    set-points."""
    first = _each_through(holes, [run.p1_mpa for run in runs], set_points[0])
    second = _each_through(holes, [run.p2_mpa for run in runs], set_points[1])
    return [RunColumns(p1, p2, run.angle_deg) for p1, p2, run in zip(first, second, runs, strict=True)]


def _each_through(holes: Sequence[Rows], columns: Sequence[Column | None], set_point: Column) -> list[Column | None]:
    """One valve's pressures of all runs, with rows in their holes."""
    out: list[Column | None] = []
    for column, hole in zip(columns, holes, strict=True):
        there = zip(columns, holes, strict=True)
        known = (other for other, theirs in there if other is not None and not (hole & theirs).any())
        out.append(None if column is None else bridged(column, hole, next(known, set_point)))
    return out


def _commands(record: Record, t: Column, p0_mpa: float) -> tuple[Column, Column]:
    own = record.t_s - record.t_s[0]
    if record.p1_cmd_mpa is not None and record.p2_cmd_mpa is not None:
        return np.interp(t, own, record.p1_cmd_mpa), np.interp(t, own, record.p2_cmd_mpa)
    return around(taken_rest(record, p0_mpa), np.interp(t, own, record.dp_cmd_mpa).astype(float))


def _session(record: Record, grid: _Grid, pressures: bool) -> tuple[RunColumns, Rows]:
    """A record on the grid, and True in its holes; before its start and after its end is a hole as well."""
    columns: list[Column | None] = []
    t, dt = grid.fine_s, grid.fine_dt_s
    holes, last = np.zeros(len(t), dtype=bool), np.zeros(0, dtype=bool)
    for column in (record.p1_mpa, record.p2_mpa, record.angle_deg):
        if column is None or (not pressures and column is not record.angle_deg):
            columns.append(None)
            continue
        known = np.isfinite(column)
        times = record.t_s[known] - grid.start_s
        columns.append(grid.rows_of(_resampled(times, column[known], t, dt)).copy())
        if not np.array_equal(known, last):  # mostly all three are known at the same times
            holes |= _holes(times, t, dt)
        last = known
    assert columns[2] is not None
    return RunColumns(columns[0], columns[1], columns[2]), grid.rows_of(holes)


def _holes(times: Column, t: Column, dt: float) -> Rows:
    """True where no row is near enough to read a column at t between them."""
    after = np.clip(np.searchsorted(times, t), 1, len(times) - 1)
    wide = times[after] - times[after - 1] > max(LONGEST_BRIDGE_S, 3 * dt)
    holes: Rows = wide | (t < times[0] - dt) | (t > times[-1] + dt)
    return holes


def _resampled(times: Column, column: Column, t: Column, dt: float) -> Column:
    """The column at t, smoothed; one that is sampled too coarsely to be smoothed runs through its rows by Akima's
    cubics, because straight lines would flatten its fast parts."""
    if dt >= SMOOTHING_S:
        from scipy.interpolate import Akima1DInterpolator  # a third of a second to import, and seldom used

        course: Column = Akima1DInterpolator(times, column)(np.clip(t, times[0], times[-1]))
        return course
    return smoothed(np.interp(t, times, column), SMOOTHING_S / dt)
