"""What becomes of set-points and of readings in time, by this family's laws: a network's tail, a beat, a clock that is
corrected."""

import math
from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.arrival import in_force, read_off
from hil.reference.compiling import Array
from hil.reference.fluidic.disturbance import TimingLaw
from hil.reference.fluidic.sensing import pink

SET_POINT_NOISE_MPA: Final = 0.0001
CORRECTED_S: Final = 4.0
"""After so long the clock's correction changes over."""


def delayed(set_mpa: Array, substeps: int, period_s: float, law: TimingLaw, random: Generator) -> Array:
    """The set-point in force on the internal grid, shape (n * substeps,): the newest one that has arrived, at first the
    first."""
    n = len(set_mpa)
    sent = np.arange(n) * period_s
    late = law.delay_s * (0.8 + 0.2 * random.exponential(1.0, n))
    if law.beat_s > 0.0:
        late = late + law.beat_s * (1.0 + np.sin(2.0 * math.pi * law.beat_hz * sent + random.uniform(0.0, 6.28)))
    return np.asarray(set_mpa[in_force(np.maximum.accumulate(sent + late), substeps, period_s)])


def stamped(columns: Array, period_s: float, law: TimingLaw) -> Array:
    """Readings, shape (m, n), by a clock that is fast by half and by one and a half of `clock_rate` in turns, resampled
    linearly."""
    if law.clock_rate == 0.0:
        return columns
    t = np.arange(columns.shape[1]) * period_s
    turns = 0.5 * np.abs((t / CORRECTED_S + 1.0) % 2.0 - 1.0) * CORRECTED_S
    ahead = law.clock_rate * (t + turns - 0.25 * CORRECTED_S)
    return read_off(columns, period_s, ahead - ahead[0])


def lost(columns: Array, law: TimingLaw, random: Generator) -> Array:
    """Readings (shape (3, n)) of which runs are the packet before, all channels alike, with the beat of two clocks."""
    if law.lost_share <= 0.0:
        return columns
    n: int = columns.shape[1]
    phase = (np.arange(n) / law.lost_every + 0.15 * np.cumsum(random.standard_normal(n)) / law.lost_every) % 1.0
    gone = phase < law.lost_share
    gone[0] = False
    source = np.maximum.accumulate(np.where(gone, 0, np.arange(n)))
    return np.asarray(columns[:, source])


def set_points(
    p1_mpa: Array, p2_mpa: Array, substeps: int, period_s: float, law: TimingLaw, random: Generator
) -> tuple[Array, Array]:
    """Both set-points on the internal grid, with what the regulators add to them."""

    def arrived(p_mpa: Array) -> Array:
        noise = pink(len(p_mpa), SET_POINT_NOISE_MPA, period_s, random)
        return delayed(p_mpa + noise, substeps, period_s, law, random)

    return arrived(p1_mpa), arrived(p2_mpa)
