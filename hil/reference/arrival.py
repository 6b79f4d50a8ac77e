"""Set-points and readings in time, as every family has them: the newest set-point that has arrived is in force, and
readings of another clock are read off between theirs. When they arrive and how the clock runs, each family says.
"""

import numpy as np
from numpy.typing import NDArray

from hil.reference.compiling import Array


def in_force(arrival_s: Array, substeps: int, period_s: float) -> NDArray[np.intp]:
    """Which of n set-points (arrival times (n,), never falling) is in force on the internal grid, shape
    (n * substeps,): the newest one that has arrived, at first the first."""
    grid_s = (np.arange(len(arrival_s) * substeps) + 0.5) * (period_s / substeps)
    return np.maximum(np.searchsorted(arrival_s, grid_s, side="right") - 1, 0)


def read_off(columns: Array, period_s: float, ahead_s: Array) -> Array:
    """Readings (m, n), taken once a period, by a clock that is `ahead_s` (n,) ahead, resampled linearly."""
    t = np.arange(columns.shape[1]) * period_s
    return np.array([np.interp(t + ahead_s, t, column) for column in columns])
