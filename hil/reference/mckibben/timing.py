"""What becomes of set-points and of readings in time: delays, stalls, lost packets, a clock that runs off."""

from typing import Any, Final

import numpy as np
from numpy.random import Generator

from hil.reference.arrival import in_force, read_off
from hil.reference.compiling import Array
from hil.reference.mckibben.disturbance import TimingLaw
from hil.reference.noise import coloured

CLOCK_WARM_UP_S: Final = 15.0
SET_POINT_NOISE_MPA: Final = 0.00012


def arrivals_s(n: int, period_s: float, law: TimingLaw, random: Generator) -> Array:
    """When each of n set-points, sent once a period, takes effect: shape (n,), never falling."""
    sent = np.arange(n) * period_s
    delay = law.delay_s * np.clip(1.0 + law.delay_spread * random.standard_normal(n), 0.0, 3.0)
    arrival = sent + delay
    if law.stall_s > 0.0:
        first = random.uniform(0.2, 1.0) * law.stall_every_s
        for start in np.arange(first, n * period_s, law.stall_every_s):
            length = law.stall_s * random.uniform(0.7, 1.3)
            held = (arrival >= start) & (arrival < start + length)
            arrival[held] = start + length
    return np.maximum.accumulate(arrival)


def stamped(columns: Array, period_s: float, law: TimingLaw) -> Array:
    """Readings, shape (m, n), taken by a clock of its own that runs fast by `clock_rate` once it is warm, resampled
    linearly."""
    if law.clock_rate == 0.0:
        return columns
    t = np.arange(columns.shape[1]) * period_s
    ahead = law.clock_rate * (t - 0.3 * CLOCK_WARM_UP_S * (1.0 - np.exp(-t / CLOCK_WARM_UP_S)))
    return read_off(columns, period_s, ahead)


def lost(columns: Array, law: TimingLaw, random: Generator) -> Array:
    """Readings (p1, p2, angle), shape (3, n), some of which are the packet before; a two-state chain (Gilbert) makes
    the bursts."""
    if law.repeat <= 0.0:
        return columns
    n: int = columns.shape[1]
    leave = 1.0 / max(law.repeat_run, 1.0)
    enter = leave * law.repeat / (1.0 - law.repeat)
    chance = random.random(n)
    source: Any = np.arange(n)
    lost = False
    for k in range(1, n):
        lost = chance[k] >= leave if lost else chance[k] < enter
        if lost:
            source[k] = source[k - 1]
    rows = slice(0, 3) if law.repeat_all > 0.5 else slice(2, 3)
    columns[rows] = columns[rows][:, np.array(source)]
    return columns


def set_points(
    p1_mpa: Array, p2_mpa: Array, substeps: int, period_s: float, law: TimingLaw, random: Generator
) -> tuple[Array, Array]:
    """Both set-points on the internal grid; the regulators add noise of their own, correlated over 50 ms."""
    n = len(p1_mpa)
    rows = in_force(arrivals_s(n, period_s, law, random), substeps, period_s)

    def arrived(p_mpa: Array) -> Array:
        noise = coloured(n, SET_POINT_NOISE_MPA, 0.05, period_s, random)
        return np.asarray((p_mpa + noise)[rows])

    return arrived(p1_mpa), arrived(p2_mpa)
