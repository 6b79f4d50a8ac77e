"""How angle and pressures become readings in the third family: a magnetic encoder, digital monitors that sample when
they like."""

import math
from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.compiling import Array, compiled
from hil.reference.noise import coloured
from hil.reference.plant import PlantDay
from hil.reference.pleated.disturbance import ReadingLaw

COUNT_DEG: Final = 360.0 / 16_384
ANGLE_NOISE_DEG: Final = 0.035
WANDER_DEG: Final = 0.015
WANDER_S: Final = 1.5
MONITOR_CODE_MPA: Final = 1.0 / 13_107
"""14 bits, of which 10 to 90 % are 0 to 1 MPa."""
MONITOR_NOISE_MPA: Final = 0.0004
MONITOR_PERIOD_S: Final = 0.0039
"""The monitors' own period: a reading is up to so old."""
BOW_MPA: Final = 0.4
LOUD, QUIET = 1.37, 0.36
EPISODE_S: Final = 0.8
LAG_DAMPING: Final = 0.9


@compiled
def _loose(angle_deg: Array, play_deg: float, keep: float) -> Array:
    """A shaft with clearance that creeps back to the middle of it while nothing touches."""
    out = np.empty_like(angle_deg)
    off, half = 0.0, 0.5 * play_deg
    before = angle_deg[0]
    for k in range(len(angle_deg)):
        off = min(max(keep * off - (angle_deg[k] - before), -half), half)
        before = angle_deg[k]
        out[k] = angle_deg[k] + off
    return out


@compiled
def _second_order(angle_deg: Array, w: float, period_s: float) -> Array:
    """A filter of second order, by ten steps a period."""
    out = np.empty_like(angle_deg)
    x, v, h = angle_deg[0], 0.0, 0.1 * period_s
    for k in range(len(angle_deg)):
        before = angle_deg[max(0, k - 1)]
        for i in range(10):
            goal = before + 0.1 * (i + 1) * (angle_deg[k] - before)
            v = (v + h * w * w * (goal - x)) / (1.0 + h * (2.0 * LAG_DAMPING * w + h * w * w))
            x += h * v
        out[k] = x
    return out


def late(columns: Array, age_s: Array, period_s: float) -> Array:
    """A column as it was `age_s` ago, sample by sample."""
    t = np.arange(len(columns)) * period_s
    return np.asarray(np.interp(t - age_s, t, columns))


def bent(angle_deg: Array, law: ReadingLaw, session: PlantDay) -> Array:
    """The static line: the magnet off its axis, a gain that swings, an error three times per turn."""
    physics, turn = session.physics, np.radians(angle_deg)
    reading = angle_deg * (1.0 + law.gain * (1.0 + law.gain_wave * np.cos(3.0 * turn)))
    for times, size, phase in (
        (1.0, physics.magnet_1_deg, physics.magnet_1_rad),
        (2.0, physics.magnet_2_deg, physics.magnet_2_rad),
        (3.0, law.bend_deg, law.bend_rad),
    ):
        reading = reading + size * (np.sin(times * turn + phase) - math.sin(phase))
    return np.asarray(reading - 1.5 * law.bend_deg * math.cos(law.bend_rad) * turn)


def filtered(angle_deg: Array, law: ReadingLaw, latency_s: float, period_s: float) -> Array:
    """The encoder's own latency, and a slower filter."""
    angle = late(angle_deg, np.full(len(angle_deg), latency_s), period_s)
    return _second_order(angle, 2.0 * LAG_DAMPING / law.lag_s, period_s) if law.lag_s > 0.0 else angle


def added(angle_deg: Array, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Offset, drift, hum, tilt and more noise, shape (n,)."""
    n = len(angle_deg)
    t = np.arange(n) * period_s
    total = law.offset_deg + law.drift_deg_min / 60.0 * (t + 1.5 * np.sin(2.0 * math.pi * t / 7.0))
    if law.tilt_deg_s > 0.0:
        total = total + law.tilt_deg_s * np.abs(np.gradient(np.radians(angle_deg), period_s))
    if law.hum_deg > 0.0:
        wave = np.tanh(1.6 * np.sin(2.0 * math.pi * law.hum_hz * 1.0003 * t + random.uniform(0.0, 6.28)))
        total = total + law.hum_deg * wave / math.sqrt(float(np.mean(wave**2)))
    if law.noise_deg > 0.0:
        changes = np.cumsum(random.random(n) < period_s / EPISODE_S) + random.integers(2)
        total = total + law.noise_deg * np.where(changes % 2, LOUD, QUIET) * random.standard_normal(n)
    return np.asarray(total)


def coded(angle_deg: Array, law: ReadingLaw, random: Generator) -> Array:
    """The encoder's counts, or coarser ones with noise ahead of them."""
    if law.step_deg > COUNT_DEG:
        position = angle_deg / law.step_deg + law.step_dither * random.standard_normal(len(angle_deg))
        return np.asarray(np.floor(position + 0.5) * law.step_deg)
    return np.asarray(np.round(angle_deg / COUNT_DEG) * COUNT_DEG)


def dropped(angle_deg: Array, law: ReadingLaw, random: Generator) -> Array:
    """Samples whose parity is wrong, with one value in their place."""
    if law.dropout <= 0.0:
        return angle_deg
    longest = max(1, int(law.dropout_run))
    reading = angle_deg.copy()
    for k in np.flatnonzero(random.random(len(angle_deg)) < law.dropout / (0.5 * (1 + longest))):
        reading[k : k + int(random.integers(1, longest + 1))] = law.dropout_deg
    return reading


def angle_reading(angle_rad: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """The recorded angle (deg), shape (n,), of the true one (rad)."""
    n, angle = len(angle_rad), np.degrees(angle_rad)
    noise = ANGLE_NOISE_DEG * random.standard_normal(n) + coloured(n, WANDER_DEG, WANDER_S, period_s, random)
    if law.play_deg > 0.0:
        angle = _loose(angle, law.play_deg, math.exp(-period_s / law.play_back_s))
    angle = filtered(bent(angle, law, session), law, session.physics.latency_s, period_s)
    angle = angle + session.angle_offset_deg + noise + added(angle, law, period_s, random)
    return dropped(coded(angle, law, random), law, random)


def monitor_reading(
    pressure_mpa: Array, bias_mpa: float, gain: float, bow: float, period_s: float, random: Generator
) -> Array:
    """The recorded pressure (gauge MPa): as it was when the monitor last sampled, bent, biased, noisy, 14 bits."""
    n = len(pressure_mpa)
    age_s = (random.uniform(0.0, 1.0) + np.arange(n) * period_s / MONITOR_PERIOD_S) % 1.0 * MONITOR_PERIOD_S
    old = late(pressure_mpa, np.asarray(age_s, float), period_s)
    reading = gain * old * (1.0 + bow * old / BOW_MPA) + bias_mpa + MONITOR_NOISE_MPA * random.standard_normal(n)
    return np.asarray(np.round(reading / MONITOR_CODE_MPA) * MONITOR_CODE_MPA)


def readings(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """Pressures (MPa) and angle (deg) as recorded, shape (3, n), of the true ones (MPa, rad)."""
    bows = session.physics.bow_1, session.physics.bow_2
    errors = (session.monitor_bias_1_mpa, session.monitor_gain_1), (session.monitor_bias_2_mpa, session.monitor_gain_2)
    pressures = [
        monitor_reading(pressure, *error, bow, period_s, random)
        for pressure, error, bow in zip(motion[:2], errors, bows, strict=True)
    ]
    return np.array([*pressures, angle_reading(motion[2], law, session, period_s, random)])
