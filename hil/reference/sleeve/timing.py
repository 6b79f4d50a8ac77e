"""What becomes of set-points and of readings in time, by this family's laws: telegrams that are sent twice, a slow
task, a crystal's parabola, a busy receiver."""

import math
from typing import Any, Final

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from hil.reference.arrival import in_force, read_off
from hil.reference.compiling import Array
from hil.reference.noise import coloured
from hil.reference.sleeve.disturbance import TimingLaw

SET_POINT_NOISE_MPA: Final = 0.0001
RETRY: Final = 0.5
"""By how much longer a telegram takes that is sent twice, against the mean."""
BUSY_SAMPLES: Final = 40
PARABOLA: Final = 0.75
"""Of the clock's rate, against its mean: how much less it is at the ends of a record than in the middle."""


def arrivals_s(n: int, period_s: float, law: TimingLaw, random: Generator) -> Array:
    """When each of n set-points, sent once a period, takes effect: shape (n,), never falling."""
    twice = random.random(n) < law.delay_retry
    late = law.delay_s * (1.0 + RETRY * (twice - law.delay_retry))
    return np.asarray(np.maximum.accumulate(np.arange(n) * period_s + late))


def passed_on(rows: NDArray[np.intp], step_s: float, law: TimingLaw, random: Generator) -> Any:
    """Which set-point is in force where a slow task passes on the newest, once in its own period."""
    width = round(law.task_s / step_s)
    if width < 1:
        return rows
    place = np.arange(len(rows)) + int(random.integers(width))
    return rows[np.maximum(0, np.arange(len(rows)) - place % width)]


def set_points(
    p1_mpa: Array, p2_mpa: Array, substeps: int, period_s: float, law: TimingLaw, random: Generator
) -> tuple[Array, Array]:
    """Both set-points on the internal grid: the newest one that has arrived, at first the first, with the noise of the
    converters."""
    n = len(p1_mpa)
    rows = in_force(arrivals_s(n, period_s, law, random), substeps, period_s)
    rows = passed_on(rows, period_s / substeps, law, random)
    p1, p2 = (p + coloured(n, SET_POINT_NOISE_MPA, 0.02, period_s, random) for p in (p1_mpa, p2_mpa))
    return np.asarray(p1[rows]), np.asarray(p2[rows])


def stamped(columns: Array, period_s: float, law: TimingLaw) -> Array:
    """Readings, shape (m, n), by a clock that is fast by `clock_rate` in the mean and most so in the middle of the
    record, resampled linearly."""
    if law.clock_rate == 0.0:
        return columns
    t = np.arange(columns.shape[1]) * period_s
    place = t / t[-1]
    run = (1.0 + PARABOLA / 3.0) * place - PARABOLA / 6.0 * ((2.0 * place - 1.0) ** 3 + 1.0)
    return read_off(columns, period_s, law.clock_rate * t[-1] * run)


def lost(columns: Array, law: TimingLaw, random: Generator) -> Array:
    """Readings (p1, p2, angle), shape (3, n), of which only one of several comes through while the receiver is busy;
    the one before stands in place of the others."""
    if law.lost_share <= 0.0:
        return columns
    n: int = columns.shape[1]
    keep = max(law.lost_keep, math.ceil(1.0 / (1.0 - law.lost_share)))
    busy = np.repeat(random.random(-(-n // BUSY_SAMPLES)) < law.lost_share / (1.0 - 1.0 / keep), BUSY_SAMPLES)[:n]
    gone = busy & (np.arange(n) % keep >= 1.0)
    gone[0] = False
    last = np.maximum.accumulate(np.where(gone, 0, np.arange(n)))
    for row in columns if law.lost_all > 0.0 else columns[2:]:
        row[:] = row[last]
    return columns
