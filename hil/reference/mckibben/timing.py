"""What becomes of set-points and of readings in time: delays, stalls, lost packets, a clock that runs off."""

from typing import Any, Final

import numpy as np
from numpy.random import Generator

from hil.reference.compiling import Array
from hil.reference.mckibben.disturbance import TimingLaw
from hil.reference.mckibben.sensing import coloured

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


def held(set_mpa: Array, arrival_s: Array, substeps: int, period_s: float) -> Array:
    """The set-point in force on the internal grid, shape (n * substeps,): the newest one that has arrived, at first the
    first."""
    grid_s = (np.arange(len(set_mpa) * substeps) + 0.5) * (period_s / substeps)
    newest = np.searchsorted(arrival_s, grid_s, side="right") - 1
    return np.asarray(set_mpa[np.maximum(newest, 0)])


def stamped(columns: Array, period_s: float, law: TimingLaw) -> Array:
    """Readings, shape (m, n), taken by a clock of its own that runs fast by `clock_rate` once it is warm, resampled
    linearly."""
    if law.clock_rate == 0.0:
        return columns
    t = np.arange(columns.shape[1]) * period_s
    ahead = law.clock_rate * (t - 0.3 * CLOCK_WARM_UP_S * (1.0 - np.exp(-t / CLOCK_WARM_UP_S)))
    return np.array([np.interp(t + ahead, t, column) for column in columns])


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
    n, arrival = len(p1_mpa), arrivals_s(len(p1_mpa), period_s, law, random)

    def arrived(p_mpa: Array) -> Array:
        noise = coloured(n, SET_POINT_NOISE_MPA, 0.05, period_s, random)
        return held(p_mpa + noise, arrival, substeps, period_s)

    return arrived(p1_mpa), arrived(p2_mpa)
