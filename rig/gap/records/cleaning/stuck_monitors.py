"""Monitors that show one value for a while although noise usually moves them from row to row: an input that is not read
again, or a converter that hangs. Those rows are taken out before anything is computed, and reported. As pressures they
would look like a leak, or like a regulator that does not move.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.columns import white_noise
from rig.gap.records.cleaning.dropouts import Rows
from rig.gap.records.settings import LEAST_FLICKER_MPA, LEAST_FLICKER_STEPS, STUCK_ROWS, STUCK_S
from rig.identify.records.monitors import LEAST_SET_MPA
from rig.model.resample import set_points
from rig.number_text import counted
from rig.record import Column, Record

MONITORS = ("p1_mpa", "p2_mpa")
"""The columns of measured pressures."""


def without_stuck_monitors(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """The records of a day with what their monitors did not measure missing (NaN), and how much that is of each monitor
    that stood still."""
    cleaned, notes = list(records), []
    for column, name in zip(MONITORS, ("p1", "p2"), strict=True):
        stood_s = []
        for k, record in enumerate(cleaned):
            rows = _stuck(record, column)
            if rows.any():
                stood_s.append(float(rows.sum()) * record.period_s)
                without = np.where(rows, np.nan, getattr(record, column))
                cleaned[k] = replace(record, **{column: without})  # type: ignore[arg-type]
        if stood_s:
            notes.append(
                f"the monitor of {name} stands still while its set-point moves, in {len(stood_s)} of "
                f"{counted(len(records), 'record')}, for {max(stood_s):.2g} s at most: the same value again and again, "
                "where it flickers else (is it read anew each time?); that is left out"
            )
    return cleaned, notes


def _stuck(record: Record, name: str) -> Rows:
    column: Column | None = getattr(record, name)
    if column is None or np.isfinite(column).sum() <= STUCK_ROWS:
        return np.zeros(len(record), dtype=bool)
    return stuck(column, set_points(record, 0.0)[MONITORS.index(name)], record.period_s)


def stuck(column: Column, set_point: Column, period_s: float) -> Rows:
    """(n,) True where a monitor (n,), MPa, stands still longer than its own noise lets it, while its set-point (n,)
    moves; none where it has no noise to tell by. At the end of its range it is clipped, and reads what it can."""
    rows = np.zeros(len(column), dtype=bool)
    standing = np.concatenate([[False], np.diff(column) == 0.0, [False]])
    begins, ends = np.flatnonzero(~standing[:-1] & standing[1:]), np.flatnonzero(standing[:-1] & ~standing[1:])
    long = ends - begins >= max(STUCK_ROWS, STUCK_S / period_s)
    for begin, end in zip(begins[long], ends[long], strict=True):
        asked = np.ptp(set_point[begin : end + 1]) >= LEAST_SET_MPA
        if asked and np.nanmin(column) < column[begin] < np.nanmax(column):
            rows[begin + 1 : end + 1] = True
    return rows if rows.any() and _flickers(column[~rows]) else np.zeros(len(column), dtype=bool)


def _flickers(column: Column) -> bool:
    """Whether noise moves a column (n,), MPa, by so much of its converter's step that it cannot stand still."""
    steps = np.abs(np.diff(column))
    moving = steps[steps > 0.0]
    least = LEAST_FLICKER_STEPS * float(moving.min()) if len(moving) else 0.0
    return white_noise([column]) > max(LEAST_FLICKER_MPA, least)
