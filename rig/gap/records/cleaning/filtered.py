"""A first-order filter between what falls and what is read: an RC before the converter, say.

A sample that falls comes back at once. Behind a filter the rest of the fall dies away by the same share from row to
row, which is the filter's. With the filter undone the falls are what they were (and the noise is larger).
"""

from collections.abc import Sequence

import numpy as np

from rig.gap.records.settings import ABRUPT, FEWEST_ABRUPT, MOST_UNLIKE
from rig.record import Column


def passed_in_a_row(columns: Sequence[Column]) -> float:
    """Share of a step that the filter of these columns (n,) passes from one row to the next; 1 where nothing abrupt
    shows one."""
    shares = np.concatenate([_shares_left(column) for column in columns] or [np.zeros(0)])
    if len(shares) < FEWEST_ABRUPT or np.subtract(*np.quantile(shares, [0.75, 0.25])) > MOST_UNLIKE:
        return 1.0
    return 1.0 - float(np.median(shares))


def abrupt_step(column: Column) -> float:
    """The least step from row to row (n,) that is no motion of the joint's own; infinite where nothing moves."""
    steps = np.abs(np.diff(column[np.isfinite(column)]))
    moving = steps[steps != 0.0]  # on a coarse converter most steps are none, and the others no falls
    return ABRUPT * float(np.median(moving)) if len(moving) else np.inf


def _shares_left(column: Column) -> Column:
    """(k,) of one step in the next, wherever two of the same sign stand out and the second is smaller."""
    steps = np.diff(column[np.isfinite(column)])
    if len(steps) < 2:
        return np.zeros(0)
    abrupt = np.abs(steps) > abrupt_step(column)
    first, second = steps[:-1], steps[1:]
    same_way = np.sign(first) == np.sign(second)
    dying = abrupt[:-1] & abrupt[1:] & same_way & (np.abs(second) < np.abs(first))
    shares: Column = second[dying] / first[dying]
    return shares


def before_filter(column: Column, passed: float) -> Column:
    """(n,) what a filter was given that passes such a share of a step in a row and was at rest before."""
    if passed == 1.0:
        return column
    return np.concatenate([column[:1], column[:-1] + np.diff(column) / passed])


def through_filter(column: Column, passed: float) -> Column:
    """(n,) what that filter makes of a column without missing values."""
    from scipy.signal import lfilter  # a third of a second to import, and only where a filter was found

    out: Column = lfilter([passed], [1.0, passed - 1.0], column, zi=[(1.0 - passed) * column[0]])[0]
    return out
