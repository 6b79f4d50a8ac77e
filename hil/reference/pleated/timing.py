"""What becomes of set-points and of readings in time, by this family's laws: two routes, backlog, swinging clock."""

import math
from typing import Any, Final

import numpy as np
from numpy.random import Generator

from hil.reference.arrival import in_force, read_off
from hil.reference.compiling import Array
from hil.reference.noise import coloured
from hil.reference.pleated.disturbance import TimingLaw

SET_POINT_NOISE_MPA: Final = 0.00008
ROUTE_S: Final = 0.7
"""Mean time for which a route is kept."""
SWING_S: Final = 13.0
SWING_SHARE: Final = 1.0 / 3.0


def arrivals_s(n: int, period_s: float, law: TimingLaw, random: Generator) -> Array:
    """When each of n set-points, sent once a period, takes effect: shape (n,), never falling."""
    sent = np.arange(n) * period_s
    changes = np.cumsum(random.random(n) < period_s / ROUTE_S) + random.integers(2)
    late = law.delay_s * (1.0 + law.delay_apart * np.where(changes % 2, 1.0, -1.0))
    if law.backlog_s > 0.0:
        begun = random.uniform(0.0, law.backlog_every_s)
        late = late + 2.0 * law.backlog_s * ((sent + begun) / law.backlog_every_s % 1.0)
    return np.asarray(np.maximum.accumulate(sent + late))


def set_points(
    p1_mpa: Array, p2_mpa: Array, substeps: int, period_s: float, law: TimingLaw, random: Generator
) -> tuple[Array, Array]:
    """Both set-points on the internal grid: the newest one that has arrived, at first the first, with the noise of the
    converters."""
    n = len(p1_mpa)
    rows = in_force(arrivals_s(n, period_s, law, random), substeps, period_s)
    p1, p2 = (p + SET_POINT_NOISE_MPA * random.standard_normal(n) for p in (p1_mpa, p2_mpa))
    slow_1, slow_2 = (coloured(n, SET_POINT_NOISE_MPA, 2.0, period_s, random) for _ in range(2))
    return np.asarray((p1 + slow_1)[rows]), np.asarray((p2 + slow_2)[rows])


def stamped(columns: Array, period_s: float, law: TimingLaw) -> Array:
    """Readings, shape (m, n), by a clock that is fast by `clock_rate` in the mean, resampled linearly."""
    if law.clock_rate == 0.0:
        return columns
    t = np.arange(columns.shape[1]) * period_s
    turn = 2.0 * math.pi / SWING_S
    ahead = law.clock_rate * (t + SWING_SHARE / turn * np.sin(turn * t))
    return read_off(columns, period_s, ahead)


def lost(columns: Array, law: TimingLaw, random: Generator) -> Array:
    """Readings (p1, p2, angle), shape (3, n), of which runs of one to `lost_run` repeat the last valid one."""
    if law.lost_share <= 0.0:
        return columns
    n: int = columns.shape[1]
    longest = max(1, int(law.lost_run))
    mean_run = 0.5 * (1 + longest)
    begins = random.random(n) < law.lost_share / (mean_run * (1.0 - law.lost_share) + law.lost_share)
    gone = np.zeros(n, dtype=bool)
    for k in np.flatnonzero(begins):
        gone[k : k + int(random.integers(1, longest + 1))] = True
    gone[0] = False
    source: Any = np.maximum.accumulate(np.where(gone, 0, np.arange(n)))
    rows = slice(0, 3) if law.lost_all > 0.5 else slice(2, 3)
    columns[rows] = columns[rows][:, source]
    return columns
