"""Stretches of a record without rows. Their command is taken from the same sweep on another day, else it is a straight
line; what was measured stays missing, and the pressures that drive the joint there are another day's or the set-points.

Where no day knows the command, the rows behind the hole count again only once the command has gone through its range: a
full excursion wipes out what a hysteresis remembers (Mayergoyz 1991, the wiping-out property).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rig.gap.records.alignment import covered
from rig.gap.records.cleaning.dropouts import Rows
from rig.gap.records.settings import LONGEST_BRIDGE_S, LONGEST_GAP_S, SETTLED, WIPED_OUT
from rig.record import Column, Record

COMMANDS = ("dp_cmd_mpa", "p1_cmd_mpa", "p2_cmd_mpa")
"""The commanded columns."""


def holes_of(record: Record, longer_than_s: float = LONGEST_BRIDGE_S) -> list[tuple[float, float]]:
    """(start, end) of every stretch without rows that is longer than so many seconds, by the record's own clock; by
    default of every one that no straight line bridges."""
    steps = np.diff(record.t_s)
    at = np.flatnonzero(steps > max(longer_than_s, 3.0 * record.period_s))
    return [(float(record.t_s[k]), float(record.t_s[k + 1])) for k in at]


def with_rows(record: Record, others: Sequence[Record]) -> Record:
    """The record with rows in its holes, their commands those of the first of `others` (on the same clock) that was
    sampled there; measured columns are missing (NaN) there."""
    holes = holes_of(record)
    if not holes:
        return record
    added = np.concatenate([_between(start, end, record.period_s) for start, end in holes])
    t = np.concatenate([record.t_s, added])
    order = np.argsort(t, kind="stable")
    filled: dict[str, Any] = {
        name: np.concatenate([column, _in_holes(name, record, others, added)])[order]
        for name, column in record.columns().items()
        if name != "t_s"
    }
    extra = {name: filled.pop(name) for name in record.extra}
    return replace(record, t_s=t[order], extra=extra, **filled)


def unsettled(record: Record, others: Sequence[Record], t_s: Column) -> Rows:
    """(n,) True in a hole whose command no other record knows, and behind it until the command has gone through its
    range."""
    rows = np.zeros(len(t_s), dtype=bool)
    for start, end in holes_of(record, LONGEST_GAP_S):
        if any(_knows(other, start, end) for other in others):
            continue
        after = record.t_s >= end
        course, times = record.dp_cmd_mpa[after], record.t_s[after]
        reached = np.maximum.accumulate(course) - np.minimum.accumulate(course)
        through = np.flatnonzero(reached >= WIPED_OUT * np.ptp(record.dp_cmd_mpa))
        until = times[through[0]] + SETTLED if len(through) else np.inf
        rows |= (t_s >= start) & (t_s < until)
    return rows


def bridged(column: Column, hole: Rows, other: Column) -> Column:
    """A column (n,) with the course of another in its holes (n,), moved to meet its own at their edges: what drives the
    joint there is felt long after."""
    if not hole.any() or hole.all():
        return column
    own = np.flatnonzero(~hole)
    apart = np.interp(np.arange(len(column)), own, (column - other)[own])
    return np.where(hole, other + apart, column)


def _between(start: float, end: float, period_s: float) -> Column:
    inside: Column = np.arange(start + period_s, end - 0.5 * period_s, period_s)
    return inside


def _in_holes(name: str, record: Record, others: Sequence[Record], t_s: Column) -> Column:
    column = record.columns()[name]
    if name not in COMMANDS:
        return np.full(len(t_s), np.nan)
    course: Column = np.interp(t_s, record.t_s, column)
    for other in reversed(others):
        theirs = other.columns().get(name)
        if theirs is not None:
            known = covered(other, t_s - other.t_s[0])
            course = np.where(known, np.interp(t_s, other.t_s, theirs), course)
    return course


def _knows(other: Record, start: float, end: float) -> bool:
    t = np.linspace(start, end, 20)
    inside = (other.t_s[0] <= start) and (end <= other.t_s[-1])
    return bool(inside and covered(other, t - other.t_s[0]).all())
