"""What becomes of set-points and of readings in time, by this family's laws: a bus on which telegrams collide, an
interpolator, a clock in an oven, outages of any length."""

from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.airbeam.disturbance import TimingLaw
from hil.reference.arrival import in_force, read_off
from hil.reference.compiling import Array
from hil.reference.noise import coloured

SET_POINT_NOISE_MPA: Final = 0.0001
BUS_DELAY_S: Final = 0.002
"""Of a telegram that does not collide, in a healthy rig too."""
BACK_OFF: Final = 0.35
"""Mean wait after collisions against the mean delay, but for those that are overtaken."""
MOST_COLLISIONS: Final = 4
OVEN: Final = 0.6
"""By which share the clock's rate is more and less than its mean as its oven is on and off."""
LONGEST: Final = 80
"""Readings that an outage lasts at most."""


def backed_off(n: int, collide: float, random: Generator) -> Array:
    """Waits of n telegrams after none to MOST_COLLISIONS collisions, shape (n,), of mean 1: anything up to a time that
    doubles each time (Metcalfe and Boggs 1976)."""
    times = np.minimum(random.geometric(1.0 - collide, n) - 1, MOST_COLLISIONS)
    number = np.arange(MOST_COLLISIONS + 1)
    chance = collide**number * (1.0 - collide)
    chance[-1] = collide**MOST_COLLISIONS
    mean = 0.5 * float(np.sum(chance * (2.0**number - 1.0)))
    return np.asarray(random.random(n) * (2.0**times - 1.0) / max(mean, 1e-9))


def arrivals_s(n: int, period_s: float, law: TimingLaw, random: Generator) -> Array:
    """When each of n set-points, sent once a period, takes effect: shape (n,), never falling; one that a newer one has
    overtaken is thrown away."""
    sent = np.arange(n) * period_s
    if law.delay_collide <= 0.0:
        return np.asarray(sent + BUS_DELAY_S + law.delay_s)
    arrival_s = sent + BACK_OFF * law.delay_s * backed_off(n, law.delay_collide, random)
    arrival_s = np.minimum.accumulate(arrival_s[::-1])[::-1]
    return np.asarray(arrival_s + BUS_DELAY_S + law.delay_s - float(np.mean(arrival_s - sent)))


def interpolated(p_mpa: Array, period_s: float, waypoint_s: float) -> Array:
    """Straight lines from waypoint to waypoint: each is known one interval before it is reached."""
    t = np.arange(len(p_mpa)) * period_s
    at = np.arange(0.0, t[-1] + waypoint_s, waypoint_s)
    return np.asarray(np.interp(t - waypoint_s, at, np.interp(at, t, p_mpa)))


def set_points(
    p1_mpa: Array, p2_mpa: Array, substeps: int, period_s: float, law: TimingLaw, random: Generator
) -> tuple[Array, Array]:
    """Both set-points on the internal grid: the newest one that has arrived, at first the first, with the noise of the
    converters."""
    n = len(p1_mpa)
    rows = in_force(arrivals_s(n, period_s, law, random), substeps, period_s)
    noisy = []
    for p in (p1_mpa, p2_mpa):
        asked = interpolated(p, period_s, law.waypoint_s) if law.waypoint_s > 0.0 else p
        noisy.append(asked + coloured(n, SET_POINT_NOISE_MPA, 0.008, period_s, random))
    return np.asarray(noisy[0][rows]), np.asarray(noisy[1][rows])


def stamped(columns: Array, period_s: float, law: TimingLaw) -> Array:
    """Readings, shape (m, n), by a clock that is fast by `clock_rate` in the mean, more so while its oven is on,
    resampled linearly."""
    if law.clock_rate == 0.0:
        return columns
    t = np.arange(columns.shape[1]) * period_s
    turn = t / law.clock_oven_s % 1.0
    ahead = OVEN * law.clock_oven_s * np.minimum(turn, 1.0 - turn)
    return read_off(columns, period_s, law.clock_rate * (t + ahead))


def outages(n: int, share: float, tail: float, random: Generator) -> Array:
    """Which of n readings are lost, shape (n,) of 0 and 1: a share of them, in runs whose lengths follow Pareto's law
    (Leland and others 1994)."""
    gone = np.zeros(n)
    while float(np.mean(gone)) < share:
        begun = int(random.integers(1, n))
        gone[begun : begun + min(LONGEST, int(1.0 + random.pareto(tail)))] = 1.0
    return gone


def lost(columns: Array, law: TimingLaw, random: Generator) -> Array:
    """Readings (p1, p2, angle), shape (3, n), in whose place the last one stands that came through."""
    if law.lost_share <= 0.0:
        return columns
    n: int = columns.shape[1]
    gone = outages(n, law.lost_share, law.lost_tail, random) > 0.5
    last = np.maximum.accumulate(np.where(gone, 0, np.arange(n)))
    for row in columns if law.lost_all > 0.0 else columns[2:]:
        row[:] = row[last]
    return columns
