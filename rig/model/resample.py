"""Records and the model's clock: is a record on it, put one onto it, and which command was in force at each tick.

Nothing here decides whether a record may be resampled; `rig.identify.records.data` does, and says so.
"""

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from rig.columns import rows_in_force
from rig.conditions import taken_rest
from rig.errors import RecordError
from rig.excite.setpoints import around
from rig.record import MOST_ROWS, Column, Record
from rig.smoothing import thinned

_ROUNDING = 1e-3
"""Share of a period by which the grid's last row may stand behind the record's: what sums of periods are off by."""
_JITTER = 0.2
"""Distances of rows may differ from the sample time by this share and still count as regular."""


def is_regular(record: Record, dt_s: float) -> bool:
    """Every two rows are one sample time apart, none is missing, and the clocks agree over the whole record to one
    sample."""
    steps = np.diff(record.t_s)
    length = record.t_s[-1] - record.t_s[0] - dt_s * (len(record) - 1)
    return bool(np.all(np.abs(steps - dt_s) <= _JITTER * dt_s) and abs(length) <= dt_s)


def on_grid(record: Record, dt_s: float, further: Collection[str] = ()) -> Record:
    """The record on a regular grid from its first row on, as far as it lasts: commands hold their last value, as the
    outputs did; what was measured is interpolated. Of its other columns it keeps those that `further` names, as
    measured.

    On a longer period than its own a command is the mean over the time that it is in force, and what was measured is
    first rid of what is too fast for the grid, without delay (docs/decisions/0110). RecordError when it would have more
    than MOST_ROWS rows.
    """
    rows = math.floor((record.t_s[-1] - record.t_s[0]) / dt_s + _ROUNDING) + 1
    thin = max(1, math.ceil(dt_s / record.period_s - _JITTER)) if record.period_s > 0 else 1
    if rows * thin > MOST_ROWS:
        raise RecordError(
            f"{record.name}: {len(record)} rows over {record.t_s[-1] - record.t_s[0]:.4g} s would become "
            f"{rows * thin:.3g} rows of {dt_s / thin * 1e3:g} ms; allowed: {MOST_ROWS}; is a time stamp wrong, or in "
            "another unit?"
        )
    time = record.t_s[0] + dt_s * np.arange(rows)
    columns: dict[str, Column] = {}
    for name, column in record.columns().items():
        if (name in record.extra and name not in further) or name == "t_s":
            continue
        if "cmd" in name or not np.isfinite(column).any():
            columns[name] = _commanded_at(time, record.t_s, column, dt_s, thin > 1)
        else:
            columns[name] = _measured_at(time, record.t_s, column, dt_s, thin)
    extra = {name: columns.pop(name) for name in record.extra if name in columns}
    return replace(record, t_s=time, extra=extra, **columns)  # type: ignore[arg-type]


def as_commanded(grid: Record, record: Record) -> Record:
    """What `on_grid` made of a record, with its commands as they stood at each of its times: a mean over what follows
    comes half a period before them, and is no clock to lay another run on."""
    columns = {
        name: _commanded_at(grid.t_s, record.t_s, column, grid.period_s, averaged=False)
        for name in ("dp_cmd_mpa", *commanded(record))
        for column in (getattr(record, name),)
    }
    return replace(grid, **columns)  # type: ignore[arg-type]


def _commanded_at(time: Column, own_s: Column, column: Column, dt_s: float, averaged: bool) -> Column:
    """A command that holds between its rows: as it stands at each time, or its mean over the dt_s that follow."""
    if not averaged or not np.isfinite(column).all():
        return column[rows_in_force(own_s, time, 0.5 * _JITTER * dt_s)]
    beyond = max(float(time[-1]) + dt_s, float(own_s[-1])) + dt_s
    until = np.append(own_s, beyond)
    summed = np.concatenate([[0.0], np.cumsum(column * np.diff(until))])
    from_to: Column = np.interp(np.append(time, time[-1] + dt_s), until, summed)
    return np.diff(from_to) / dt_s


def _measured_at(time: Column, own_s: Column, column: Column, dt_s: float, thin: int) -> Column:
    """A measured column (with a value at least) on straight lines between its rows; without what is too fast, from
    `thin` times as many."""
    known = np.isfinite(column)
    fine = time if thin == 1 else time[0] + dt_s / thin * np.arange((len(time) - 1) * thin + 1)
    between: Column = np.interp(fine, own_s[known], column[known])
    return between if thin == 1 else thinned(between, thin)


def on_clock(record: Record, dt_s: float) -> Record:
    """The record as it is where its rows are such a time apart, else on that grid."""
    return record if is_regular(record, dt_s) else on_grid(record, dt_s)


def commanded(record: Record) -> dict[str, Column]:
    """The columns (n,) in MPa that say what was commanded: those of both muscles, or else the difference."""
    if record.p1_cmd_mpa is not None and record.p2_cmd_mpa is not None:
        return {"p1_cmd_mpa": record.p1_cmd_mpa, "p2_cmd_mpa": record.p2_cmd_mpa}
    return {"dp_cmd_mpa": record.dp_cmd_mpa}


def set_points(record: Record, p0_mpa: float) -> tuple[Column, Column]:
    """(n,) set-points (MPa) of both muscles as they were written; without a column for each, the difference is split in
    halves about the record's own P0, and about `p0_mpa` where it has none."""
    first, *second = commanded(record).values()
    return (first, second[0]) if second else around(taken_rest(record, p0_mpa), first)


def held_commands(record: Record, p0_mpa: float) -> tuple[Column, Column]:
    """(n,) set-points (MPa) in force when each row was measured: those written one row before. New arrays.

    A row is measured first and its set-point written after it, so row k answers to the set-points up to row k - 1.
    """
    p1, p2 = set_points(record, p0_mpa)
    return np.concatenate([p1[:1], p1[:-1]]), np.concatenate([p2[:1], p2[:-1]])
