"""What becomes of set-points and of readings in time, by this family's laws: a gateway's queue, a gateway that goes on
by itself, a crystal that ages, losses that cluster."""

import math
from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.arrival import in_force, read_off
from hil.reference.compiling import Array
from hil.reference.diaphragm.disturbance import TimingLaw
from hil.reference.noise import coloured

SET_POINT_NOISE_MPA: Final = 0.00012
CONVERTER_MPA: Final = 0.5 / 4096
"""Code of the converter that drives a regulator's input."""
WRITE_S: Final = 0.0015
"""Until a set-point is at the regulator's input, in a healthy rig too."""
QUEUED: Final = 0.3
"""Share of the mean delay that is waited for in a queue, more and less."""
LEAST_MPA, MOST_MPA = 0.0, 0.55
"""Between which a gateway's set-points stay."""


def arrivals_s(n: int, period_s: float, law: TimingLaw, random: Generator) -> Array:
    """When each of n set-points, sent once a period, takes effect: shape (n,), never falling: a queue keeps their
    order. Waits follow the gamma law, as measured on networks (Bovy and others 2002)."""
    sent = np.arange(n) * period_s
    if law.delay_s <= 0.0 or law.delay_shape <= 0.0:
        return np.asarray(sent + WRITE_S + law.delay_s)
    waits = random.gamma(law.delay_shape, QUEUED * law.delay_s / law.delay_shape, n)
    arrival_s = np.maximum.accumulate(sent + waits)
    return np.asarray(arrival_s + WRITE_S + law.delay_s - float(np.mean(arrival_s - sent)))


def extrapolated(p_mpa: Array, period_s: float, gateway_s: float) -> Array:
    """What a gateway sends on that hears a set-point now and then and goes on as the last two went (dead reckoning,
    IEEE 1278)."""
    t = np.arange(len(p_mpa)) * period_s
    heard_s = np.floor(t / gateway_s) * gateway_s
    last, before = np.interp(heard_s, t, p_mpa), np.interp(heard_s - gateway_s, t, p_mpa)
    return np.asarray(np.clip(last + (last - before) * (t - heard_s) / gateway_s, LEAST_MPA, MOST_MPA))


def set_points(
    p1_mpa: Array, p2_mpa: Array, substeps: int, period_s: float, law: TimingLaw, random: Generator
) -> tuple[Array, Array]:
    """Both set-points on the internal grid: the newest one that has arrived, at first the first, in the converter's
    codes, with its noise."""
    n = len(p1_mpa)
    rows = in_force(arrivals_s(n, period_s, law, random), substeps, period_s)
    noisy = []
    for p in (p1_mpa, p2_mpa):
        asked = extrapolated(p, period_s, law.gateway_s) if law.gateway_s > 0.0 else p
        codes = np.round(asked / CONVERTER_MPA) * CONVERTER_MPA
        noisy.append(codes + coloured(n, SET_POINT_NOISE_MPA, 0.012, period_s, random))
    return np.asarray(noisy[0][rows]), np.asarray(noisy[1][rows])


def aged_s(t: Array, ages_s: float) -> Array:
    """By how many seconds a clock of mean rate 1 is ahead whose rate grows as the logarithm of its age (MIL-PRF-55310):
    at the end by the whole time."""

    def ahead(at: Array) -> Array:
        age = 1.0 + at / ages_s
        return np.asarray(ages_s * (age * np.log(age) - age + 1.0))

    return np.asarray(t[-1] * ahead(t) / float(ahead(t[-1:])[0]))


def stamped(columns: Array, period_s: float, law: TimingLaw) -> Array:
    """Readings, shape (m, n), by a clock that is fast by `clock_rate` in the mean, resampled linearly."""
    if law.clock_rate == 0.0:
        return columns
    t = np.arange(columns.shape[1], dtype=np.float64) * period_s
    return read_off(columns, period_s, law.clock_rate * aged_s(t, law.clock_ages_s))


def losses(n: int, share: float, shape: float, random: Generator) -> Array:
    """Which of n readings are lost, shape (n,) of 0 and 1: gaps between them follow Weibull's law; below a shape of 1
    they come in clusters."""
    gone, scale = np.zeros(n), 1.0 / math.gamma(1.0 + 1.0 / shape)
    mean = max(1e-3, 1.0 / share - 1.0)
    at = mean * scale * float(random.weibull(shape))
    while at < n - 1:
        gone[1 + int(at)] = 1.0
        at += 1.0 + mean * scale * float(random.weibull(shape))
    return gone


def lost(columns: Array, law: TimingLaw, random: Generator) -> Array:
    """Readings (p1, p2, angle), shape (3, n), in whose place the last one stands that came through."""
    if law.lost_share <= 0.0:
        return columns
    n: int = columns.shape[1]
    gone = losses(n, law.lost_share, law.lost_shape, random) > 0.5
    last = np.maximum.accumulate(np.where(gone, 0, np.arange(n)))
    for row in columns if law.lost_all > 0.0 else columns[2:]:
        row[:] = row[last]
    return columns
