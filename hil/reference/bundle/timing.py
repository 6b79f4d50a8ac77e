"""What becomes of set-points and of readings in time, by this family's laws: a queue that wanders, channels apart, a
clock that miscounts, a radio link that fades."""

from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.arrival import in_force, read_off
from hil.reference.bundle.disturbance import TimingLaw
from hil.reference.compiling import Array
from hil.reference.noise import coloured

SET_POINT_NOISE_MPA: Final = 0.00009
SHARED_NOISE_MPA: Final = 0.00006
"""Noise of each converter, and of the reference that both have in common."""
WANDER_S: Final = 1.6


def arrivals_s(n: int, period_s: float, law: TimingLaw, random: Generator) -> Array:
    """When each of n set-points, sent once a period, takes effect: shape (n,), never falling."""
    sent = np.arange(n) * period_s
    wander = coloured(n, law.delay_wander, WANDER_S, period_s, random)
    return np.maximum.accumulate(sent + law.delay_s * np.exp(wander - 0.5 * law.delay_wander**2))


def set_points(
    p1_mpa: Array, p2_mpa: Array, substeps: int, period_s: float, law: TimingLaw, random: Generator
) -> tuple[Array, Array]:
    """Both set-points on the internal grid: the newest one that has arrived, at first the first, with the noise of the
    converters."""
    n = len(p1_mpa)
    arrival_s = arrivals_s(n, period_s, law, random)
    shared = coloured(n, SHARED_NOISE_MPA, 0.3, period_s, random)
    p1, p2 = (p + shared + SET_POINT_NOISE_MPA * random.standard_normal(n) for p in (p1_mpa, p2_mpa))
    rows_1, rows_2 = (in_force(arrival_s + skew_s, substeps, period_s) for skew_s in (0.0, law.skew_s))
    return np.asarray(p1[rows_1]), np.asarray(p2[rows_2])


def stamped(columns: Array, period_s: float, law: TimingLaw) -> Array:
    """Readings, shape (m, n), by a clock that is fast by `clock_rate` in the mean, a whole tick at a time, resampled
    linearly."""
    if law.clock_rate == 0.0:
        return columns
    t = np.arange(columns.shape[1]) * period_s
    ticks = np.floor(np.abs(law.clock_rate) * t / law.clock_tick_s + 0.5)
    return read_off(columns, period_s, np.asarray(np.sign(law.clock_rate) * law.clock_tick_s * ticks))


def lost(columns: Array, law: TimingLaw, random: Generator) -> Array:
    """Packets (p1, p2, angle), shape (3, n), that repeat the last one that came while the link's strength was below
    what it needs."""
    if law.lost_share <= 0.0:
        return columns
    n: int = columns.shape[1]
    strength = coloured(n, 1.0, law.lost_fade, 1.0, random)
    gone = strength < np.quantile(strength, law.lost_share)
    gone[0] = False
    return np.asarray(columns[:, np.maximum.accumulate(np.where(gone, 0, np.arange(n)))])
