"""What becomes of set-points and of readings in time, by this family's laws: a bus with frames, stale frames, an ageing
clock, channels that are lost one by one."""

import math
from typing import Any, Final

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from hil.reference.arrival import in_force, read_off
from hil.reference.bellows.disturbance import TimingLaw
from hil.reference.bellows.sensing import coloured
from hil.reference.compiling import Array

SET_POINT_NOISE_MPA: Final = 0.0001
LONGEST_FRAME_S: Final = 0.02
AGEING: Final = 0.25
"""By how much, relative to its mean, the clock's rate is off at the ends of a record."""
FADING: Final = 0.5


def arrivals_s(n: int, period_s: float, law: TimingLaw, random: Generator) -> Array:
    """When each of n set-points, sent once a period, takes effect: at the next frame of the bus; shape (n,), never
    falling."""
    sent = np.arange(n) * period_s
    frame_s = min(LONGEST_FRAME_S, 2.0 * law.delay_frame * law.delay_s)
    if frame_s <= 0.0:
        return np.asarray(sent + law.delay_s)
    first = frame_s * random.random()
    waiting = np.ceil((sent - first) / frame_s) * frame_s + first - sent
    return np.maximum.accumulate(sent + law.delay_s - 0.5 * frame_s + waiting)


def stale(rows: NDArray[np.intp], period_s: float, substeps: int, law: TimingLaw, random: Generator) -> Any:
    """Which set-point is in force where now and then an old frame is carried out once more, for one period."""
    if law.stale_s <= 0.0:
        return rows
    again = np.repeat(random.random(len(rows) // substeps) < law.stale_share, substeps)
    old = np.maximum(0, np.arange(len(rows)) - round(law.stale_s / period_s * substeps))
    return np.where(again, rows[old], rows)


def set_points(
    p1_mpa: Array, p2_mpa: Array, substeps: int, period_s: float, law: TimingLaw, random: Generator
) -> tuple[Array, Array]:
    """Both set-points on the internal grid: the newest one that has arrived, at first the first, with the noise of the
    converters."""
    n = len(p1_mpa)
    rows = stale(in_force(arrivals_s(n, period_s, law, random), substeps, period_s), period_s, substeps, law, random)
    p1, p2 = (p + coloured(n, SET_POINT_NOISE_MPA, 0.02, period_s, random) for p in (p1_mpa, p2_mpa))
    return np.asarray(p1[rows]), np.asarray(p2[rows])


def stamped(columns: Array, period_s: float, law: TimingLaw) -> Array:
    """Readings, shape (m, n), by a clock that is fast by `clock_rate` in the mean and ages, resampled linearly."""
    if law.clock_rate == 0.0:
        return columns
    t = np.arange(columns.shape[1]) * period_s
    return read_off(columns, period_s, law.clock_rate * t * (1.0 + AGEING * (t / t[-1] - 1.0)))


def lost(columns: Array, law: TimingLaw, random: Generator) -> Array:
    """Readings (p1, p2, angle), shape (3, n), of which each channel for itself repeats the last one that came."""
    if law.lost_share <= 0.0:
        return columns
    n: int = columns.shape[1]
    fade = 1.0 + FADING * np.sin(2.0 * math.pi * np.arange(n) / law.lost_fade + random.uniform(0.0, 6.283))
    share = np.minimum(0.97, law.lost_share * fade)
    for row in columns:
        gone = random.random(n) < share
        gone[0] = False
        row[:] = row[np.maximum.accumulate(np.where(gone, 0, np.arange(n)))]
    return columns
