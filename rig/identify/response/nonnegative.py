"""Linear least squares some of whose coefficients cannot be negative, for a handful of them."""

import numpy as np
from numpy.typing import NDArray

from rig.record import Column

_ROUNDING = 1e-12
"""Share of the largest product by which a slope must fall for a coefficient to leave 0."""


def nonnegative(rows: Column, wanted: Column, free: int) -> Column:
    """The (k,) coefficients, from the `free`-th on at least 0, with which rows (n, k) miss wanted (n,) least; by active
    sets (Lawson and Hanson, Solving Least Squares Problems, 1974, ch. 23). The columns must be independent."""
    bounded = np.arange(rows.shape[1]) >= free
    kept = ~bounded
    x = _solved(rows, wanted, kept)
    least = _ROUNDING * float(np.linalg.norm(rows) * np.linalg.norm(wanted))
    for _ in range(3 * rows.shape[1]):
        slope = np.where(kept, -np.inf, rows.T @ (wanted - rows @ x))
        best = int(np.argmax(slope))
        if slope[best] <= least:
            break
        kept[best] = True
        x = _within(rows, wanted, x, kept, bounded)
    return x


def _within(rows: Column, wanted: Column, x: Column, kept: NDArray[np.bool_], bounded: NDArray[np.bool_]) -> Column:
    """The solution with the `kept` coefficients, from x towards it as far as none falls below 0; those that would are
    kept no longer."""
    while True:
        goal = _solved(rows, wanted, kept)
        low = kept & bounded & (goal <= 0.0)
        if not low.any():
            return goal
        shares = np.where(low, x / np.where(low, x - goal, 1.0), np.inf)
        first = int(np.argmin(shares))
        x = x + shares[first] * (goal - x)
        x[first] = 0.0
        kept &= ~bounded | (x > 0.0)


def _solved(rows: Column, wanted: Column, kept: NDArray[np.bool_]) -> Column:
    x = np.zeros(rows.shape[1])
    x[kept] = np.linalg.lstsq(rows[:, kept], wanted, rcond=None)[0]
    return x
