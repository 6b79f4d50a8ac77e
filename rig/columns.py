"""What is asked of columns everywhere: their rms, how alike two are, which command is in force, what stands where
values are missing, where an extremum lies between rows, and the white noise in them."""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from rig.record import Column

THIRD_DIFFERENCE_POWER = 20.0
"""Variance of the third difference of white noise over its own: 1 + 9 + 9 + 1."""
MAD_TO_STD = 1.4826
"""Standard deviation of a normal distribution over the median of its absolute deviations."""
NORMAL_95 = 1.959963984540054
"""Standard deviations by which a 95 % interval of a normal distribution goes either way."""
SAME_SIZE = 1e-9
"""Sizes that differ by less than this share of the largest are equal: what rounding leaves of equal steps."""
NEAR = 0.1
"""How far, in steps, the values of a converter may lie from even steps: its file rounds them, to three decimals say."""
MOST_DISTINCT = 0.5
"""Share of a column's rows with a value of their own from which on it has no steps."""
LEAST_DISTINCT_ROWS = 50
"""Fewer rows than this beside exact repeats say nothing; then all of a column's rows count."""


def rms(column: Column, used: Column | None = None) -> float:
    """Root of the mean square of a column (n,), in its unit; by the rows' weights `used` (n,) where given. NaN without
    rows."""
    if used is None:
        return float(np.sqrt(np.mean(column**2))) if len(column) else math.nan
    weight = float(np.sum(used))
    return float(np.sqrt(np.sum(used * column**2) / weight)) if weight else math.nan


def correlation(one: Column, other: Column) -> float:
    """Between -1 and 1, of the rows that both columns (n,) have; 0 where one of them stands still."""
    both = np.isfinite(one) & np.isfinite(other)
    if both.sum() < 2 or not np.ptp(one[both]) or not np.ptp(other[both]):
        return 0.0
    return float(np.corrcoef(one[both], other[both])[0, 1])


def rows_in_force(written_s: Column, at_s: Column, slack_s: float) -> NDArray[np.intp]:
    """(k,) for each time the row (of n) whose command holds then: the last that was written by it, or comes at most
    `slack_s` later; before the first row the first."""
    return np.maximum(np.searchsorted(written_s, at_s + slack_s, side="right") - 1, 0)


def filled_in(column: Column) -> Column:
    """A new column (n,), missing values on straight lines between their neighbours, at the ends as the nearest; all of
    them missing where none is known."""
    known = np.isfinite(column)
    if known.all() or not known.any():
        return column.copy()
    whole: Column = np.interp(np.arange(len(column)), np.flatnonzero(known), column[known])
    return whole


def vertex_offset(column: Column, row: int) -> float:
    """How far from `row`, at which a column (n,) is largest or smallest, the vertex of the parabola through that value
    and both its neighbours lies, in rows; 0 at an end of the column, and where the three are equal."""
    if not 0 < row < len(column) - 1:
        return 0.0
    before, at, after = column[row - 1 : row + 2]
    bend = before - 2.0 * at + after
    return float(0.5 * (before - after) / bend) if bend else 0.0


def usual_step(column: Column) -> float:
    """The usual step between the different values of a column (n,) without holes: a coarse converter's; 0 where there
    is one value."""
    steps = np.diff(np.unique(column))
    return float(np.median(steps)) if len(steps) else 0.0


def white_noise(columns: Iterable[Column], *, without_repeats: bool = False) -> float:
    """Standard deviation of the white noise in columns (n,), in their unit, from their third differences by medians.

    Third differences take out what moves slowly, medians what jumps. `without_repeats` leaves out the rows beside a
    value that was read twice: repeats are no noise. Missing values (NaN) are left out, and so are the rows beside
    them; NaN where nothing is left.
    """
    parts = [_third_differences(on_even_steps(column), without_repeats) for column in columns]
    together = np.concatenate(parts or [np.zeros(0)])
    if len(together) == 0:
        return math.nan
    return MAD_TO_STD * grouped_median(np.abs(together - np.median(together))) / math.sqrt(THIRD_DIFFERENCE_POWER)


def on_even_steps(column: Column) -> Column:
    """A converter's column (n,) with its values exactly even steps apart, whatever decimals its file kept; any other as
    it is. Values that are rounded twice are many where there is one, and no median tells how they are spread."""
    values = np.unique(column[np.isfinite(column)])
    if not 2 < len(values) < MOST_DISTINCT * len(column):
        return column
    gaps = np.diff(values)
    steps = gaps / float(np.median(gaps))
    codes = np.concatenate([[0.0], np.cumsum(np.round(steps))])
    if np.any(np.abs(steps - np.round(steps)) > NEAR) or np.any(steps < 0.5):
        return column
    even = values[0] + codes * ((values[-1] - values[0]) / codes[-1])
    return np.asarray(np.interp(column, values, even), np.float64)


def grouped_median(sizes: Column) -> float:
    """The median of sizes (n,), none below 0, of which many may be equal: those are taken to lie evenly between their
    neighbours' middles, so that a coarse converter's median does not jump by its step."""
    unit = max(SAME_SIZE * float(np.max(sizes, initial=0.0)), 1e-300)
    values, counts = np.unique(np.round(sizes / unit), return_counts=True)
    below = np.cumsum(counts) - counts
    k = int(np.searchsorted(np.cumsum(counts), 0.5 * len(sizes)))
    edges = np.concatenate([[0.0], 0.5 * (values[:-1] + values[1:]), values[-1:]])
    return float(unit * (edges[k] + (0.5 * len(sizes) - below[k]) / counts[k] * (edges[k + 1] - edges[k])))


def _third_differences(column: Column, without_repeats: bool) -> Column:
    third = np.diff(column, 3)
    known = np.isfinite(third)
    if not without_repeats:
        return third[known]
    still = np.diff(column) == 0
    beside = still[:-2] | still[1:-1] | still[2:] | np.concatenate([[False], still[:-3]])
    left: Column = third[~beside & known]
    return left if len(left) > LEAST_DISTINCT_ROWS else third[known]
