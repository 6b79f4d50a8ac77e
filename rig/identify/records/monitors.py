"""Whether a pressure monitor is heard: one that stands still, or follows nothing, while its set-point moves measures
nothing, and may be a broken wire."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rig.model.resample import set_points
from rig.record import MOST_ROWS, Column, Record

STILL_MPA: Final = 1e-4
"""A pressure that moves by less does not move at all: far below a converter's step."""
LEAST_SET_MPA: Final = 0.005
"""A set-point that moves by less asks nothing of its regulator."""
LONGEST_LAG_S, FOLLOWED_S = 1.0, 0.01
"""Lags at which a column may follow its command, s, and their distance. Longer: a slow sine follows itself mirrored.
Farther apart: the lag at which a fast sine follows lies between two of them, and the one at which it is mirrored on
one; half the distance of 6 Hz is 11 degrees, whose cosine is 0.98."""
FOLLOWS: Final = 0.3
"""A column that follows at all correlates by more than this with what drives it, at some lag up to LONGEST_LAG_S."""
_FEW: Final = 10
"""Of so many lags one is looked at first: a column that follows is seen to do so at one of these nearly always."""
LEAST_ROWS: Final = 50
"""Fewer rows show no response."""
_STILL: Final = 1e-10
"""A stretch whose variance is below this share of the whole column's stands still: what rounding leaves of a sum."""


def dead_monitor(record: Record) -> str | None:
    """The first monitor that is not heard, in words, or that both read one pressure; None when both are heard, or none
    was measured."""
    dead = next(
        (f"the monitor of {name} {why}" for name in ("p1", "p2") if (why := monitor_trouble(record, name))),
        None,
    )
    return dead or ("the monitors of p1 and p2 read the same pressure" if _read_one(record) else None)


def broken_monitor(record: Record) -> str | None:
    """`dead_monitor`, but None where the joint stands as still as the monitors say."""
    dead = dead_monitor(record)
    return None if dead and nothing_answers(record) else dead


def nothing_answers(record: Record) -> bool:
    """Neither both measured pressures nor the angle follow the command: the regulators stand still, and their monitors
    say so rightly."""
    if record.p1_mpa is None or record.p2_mpa is None or record.angle_deg is None:
        return False
    columns = (record.angle_deg, record.p1_mpa, record.p2_mpa, record.dp_mpa)
    return not any(follows(record, column, record.dp_cmd_mpa) for column in columns)


def _read_one(record: Record) -> bool:
    """Their difference moves less than either, and does not follow its command."""
    if record.p1_mpa is None or record.p2_mpa is None or not np.ptp(record.dp_cmd_mpa) >= LEAST_SET_MPA:
        return False
    known = np.isfinite(record.dp_mpa)
    if not known.any() or np.std(record.dp_mpa[known]) >= min(np.std(p[known]) for p in (record.p1_mpa, record.p2_mpa)):
        return False
    return not follows(record, record.dp_mpa, record.dp_cmd_mpa)


def monitor_trouble(record: Record, name: str) -> str | None:
    """What is wrong with the monitor of `name`, p1 or p2, in words; None where nothing is, or where nothing was asked
    of its regulator."""
    column: Column | None = getattr(record, f"{name}_mpa")
    if column is None or not (known := np.isfinite(column)).any():
        return None
    set_point = set_points(record, 0.0)[("p1", "p2").index(name)]
    if not np.isfinite(set_point).any() or not np.nanmax(set_point) - np.nanmin(set_point) >= LEAST_SET_MPA:
        return None
    if np.ptp(column[known]) < STILL_MPA:
        return "does not move"
    if any(follows(record, column, command) for command in (record.dp_cmd_mpa, set_point)):
        return None
    if record.angle_deg is not None and follows(record, record.angle_deg, column):
        return None  # the pressure itself does not: the joint answers to what the monitor reads
    return "does not follow its command"


def follows(record: Record, column: Column, command: Column) -> bool:
    """Whether a column (n,) has anything to do with a command (n,), either way round and with some lag."""
    if min(np.isfinite(column).sum(), np.isfinite(command).sum()) < LEAST_ROWS:
        return True
    if record.t_s[-1] - record.t_s[0] > MOST_ROWS * FOLLOWED_S:
        return True  # a time stamp is wrong, which is told by who puts the record onto a grid
    return any(np.max(np.abs(correlations(record, column, command, every))) > FOLLOWS for every in (_FEW, 1))


def correlations(
    record: Record, column: Column, command: Column, every: int = 1, longest_s: float = LONGEST_LAG_S
) -> Column:
    """(lags,) correlations of a column (n,) with a command (n,), at lags from 0 to `longest_s`, or half of the record,
    FOLLOWED_S apart, or at one of so many of these."""
    t = np.linspace(record.t_s[0], record.t_s[-1], max(int((record.t_s[-1] - record.t_s[0]) / FOLLOWED_S), 2))
    follower, driver = (
        np.interp(t, record.t_s[known], one[known]) for one in (column, command) for known in (np.isfinite(one),)
    )
    return _at_lags(driver, follower, np.arange(0, max(min(int(longest_s / FOLLOWED_S), len(t) // 2), 1), every))


def _at_lags(driver: Column, follower: Column, lags: NDArray[np.int64]) -> Column:
    """(lags,) correlations of `driver` (n,) with the rows of `follower` (n,) that are so many rows later, 0 first.

    Means and squares of all these stretches are differences of one sum each; only the products are formed anew.
    """
    rows = len(driver) - lags
    one, other = driver - driver.mean(), follower - follower.mean()
    ones, squares = np.cumsum(one)[rows - 1], np.cumsum(one**2)[rows - 1]
    others, other_squares = (np.cumsum(column[::-1])[rows - 1] for column in (other, other**2))
    together = np.array([one[:k] @ other[len(other) - k :] for k in rows]) - ones * others / rows
    left, right = squares - ones**2 / rows, other_squares - others**2 / rows
    moves = (left > _STILL * squares[0]) & (right > _STILL * other_squares[0])
    return np.where(moves, together / np.sqrt(np.where(moves, left * right, 1.0)), 0.0)
