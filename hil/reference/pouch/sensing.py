"""How angle and pressures become readings in the ninth family: a spot of light on a lateral-effect detector, monitors
that count the swings of a resonator.

A mirror on the link throws a spot onto a detector whose two currents share out the light by the spot's place (Wallmark
1957; Woltring 1975): the reading is their difference over their sum, on a converter of 16 bits. Its scale closes up
towards the edges, and is askew where the detector is. A resonant sensor's swings are counted within a period, and what
is left of a swing belongs to the next count.
"""

import math
from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.compiling import Array, compiled
from hil.reference.noise import coloured, one_pole
from hil.reference.plant import PlantDay
from hil.reference.pouch.disturbance import ReadingLaw
from hil.reference.pouch.physics import Physics

SPAN_DEG: Final = 140.0
CODE_DEG: Final = SPAN_DEG / 65_536
REFERENCE_DEG: Final = 40.0
SHOT_DEG: Final = 0.018
SHIMMER_DEG: Final = 0.022
SHIMMER_S: Final = (0.02, 0.08, 0.32, 1.28)
SHIMMER_POWER: Final = 2.0 / 3.0
"""Warm air bends the beam: Kolmogorov's spectrum (power 5/3) by poles, whose share of the power goes with their time by
this power."""
AMPLIFIER_S: Final = 0.0015
"""Of the amplifiers behind the detector."""
TAIL_TIMES: Final = (0.25, 1.0, 4.0)
TAIL_SHARES: Final = (0.5, 0.3, 0.2)
"""Relaxation times of carriers that diffuse, against the middle one, and what comes by each."""
LAMP_DEG: Final = 60.0
"""Distance from the lamp at which it draws the spot as far as is said."""
RANGE_BACK_DEG: Final = 2.0
"""By how much nearer an amplifier goes back to its near range."""
SWINGS_MPA: Final = 1.0 / 4000.0
"""Pressure that is one swing more within a period of 5 ms."""
MONITOR_NOISE_MPA, MONITOR_SLOW_MPA, MONITOR_SLOW_S = 0.0003, 0.0002, 0.6
REST_MPA: Final = 0.2


@compiled
def greased(angle_deg: Array, half_deg: float, drag: float) -> Array:
    """(n,) where a pin is in its clearance: pushed by both flanks, and between them taken along by a share."""
    out = np.empty_like(angle_deg)
    place = before = angle_deg[0]
    for k in range(len(angle_deg)):
        place += drag * (angle_deg[k] - before)
        place = min(max(place, angle_deg[k] - half_deg), angle_deg[k] + half_deg)
        out[k], before = place, angle_deg[k]
    return out


@compiled
def ranged(angle_deg: Array, far_gain: float, at_deg: float) -> Array:
    """(n,) of an amplifier that switches to its far range beyond a place, and back a little nearer."""
    out, far = np.empty_like(angle_deg), False
    for k in range(len(angle_deg)):
        away = abs(angle_deg[k])
        far = away > at_deg or (far and away > at_deg - RANGE_BACK_DEG)
        out[k] = angle_deg[k] * (1.0 + far_gain) if far else angle_deg[k]
    return out


def detector(angle_deg: Array, physics: Physics) -> Array:
    """The healthy detector's line, zero at zero: its edges, and how it stands."""
    place = np.asarray(angle_deg, float) / REFERENCE_DEG
    return np.asarray(angle_deg + physics.bow_deg * (place**3 - place) * 1.5 + physics.tilt_deg * place**2)


def askew(angle_deg: Array, tilt: float) -> Array:
    """Shape of a detector that stands askew (a projection onto it, a rational function), without the slope at zero, 1
    at that end of +-40 degrees where it is more."""

    def off(deg: Array) -> Array:
        across = np.tan(np.radians(np.clip(deg, -75.0, 75.0)))
        return np.asarray(across / (1.0 - tilt * np.clip(across, -2.5, 2.5)) - np.radians(deg))

    return np.asarray(off(np.asarray(angle_deg)) / np.abs(off(np.array([-REFERENCE_DEG, REFERENCE_DEG]))).max())


def diffused(angle_deg: Array, lag_s: float, tail: float, period_s: float) -> Array:
    """(n,) of carriers of which a share diffuses, in the mean late by `lag_s`: the rest by one quick pole."""
    slow = 0.6 + 0.4 * tail
    middle_s = slow * lag_s / (tail * float(np.dot(TAIL_SHARES, TAIL_TIMES)))
    quick_s = (1.0 - slow) * lag_s / (1.0 - tail)
    total = (1.0 - tail) * _pole(angle_deg, quick_s, period_s)
    for time, share in zip(TAIL_TIMES, TAIL_SHARES, strict=True):
        total += tail * share * _pole(angle_deg, time * middle_s, period_s)
    return np.asarray(total)


def _pole(column: Array, time_s: float, period_s: float) -> Array:
    keep = math.exp(-period_s / time_s)
    return np.asarray(one_pole((1.0 - keep) * column, keep, float(column[0])))


def shimmer(n: int, size_deg: float, period_s: float, random: Generator) -> Array:
    """Warm air before the spot, shape (n,)."""
    shares = np.array(SHIMMER_S) ** SHIMMER_POWER
    sizes = size_deg * np.sqrt(shares / shares.sum())
    poles = zip(sizes, SHIMMER_S, strict=True)
    return np.asarray(sum(coloured(n, float(size), time_s, period_s, random) for size, time_s in poles))


def drawn_by_lamp(angle_deg: Array, t: Array, law: ReadingLaw, random: Generator) -> Array:
    """Hum (n,) of a lamp that draws the spot towards itself, the more the further it is."""
    reach = (law.hum_at_deg - angle_deg) / LAMP_DEG
    turn = 2.0 * math.pi * law.hum_hz * t + random.uniform(0.0, 2.0 * math.pi)
    return np.asarray(math.sqrt(2.0) * law.hum_deg * reach * np.sin(turn))


def slowly(t: Array) -> Array:
    """From 0 to the last time: what begins slowly and ends slowly."""
    share = t / t[-1]
    return np.asarray(t[-1] * share * share * (3.0 - 2.0 * share))


def added(angle_deg: Array, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Offset, drift, hum and more noise, shape (n,)."""
    n = len(angle_deg)
    t = np.arange(n, dtype=float) * period_s
    total = law.offset_deg + law.drift_deg_min / 60.0 * slowly(t)
    if law.hum_deg > 0.0:
        total = total + drawn_by_lamp(angle_deg, t, law, random)
    if law.noise_deg > 0.0:
        total = total + shimmer(n, math.sqrt(law.noise_shimmer) * law.noise_deg, period_s, random)
        total = total + math.sqrt(1.0 - law.noise_shimmer) * law.noise_deg * random.standard_normal(n)
    return np.asarray(total)


def coded(angle_deg: Array, law: ReadingLaw) -> Array:
    """The converter's codes, or coarse ones of both currents, each for itself, whose codes lie apart."""
    if law.step_deg <= CODE_DEG:
        return np.asarray(np.round(angle_deg / CODE_DEG) * CODE_DEG)
    place = 0.5 * angle_deg / law.step_deg
    return np.asarray(law.step_deg * (np.floor(place + 0.5) - np.floor(0.5 + law.step_apart - place)))


def interrupted(angle_deg: Array, law: ReadingLaw, random: Generator) -> Array:
    """Samples at which the beam is interrupted: the quotient of two currents of the dark is anything."""
    if law.dropout <= 0.0:
        return angle_deg
    reading = angle_deg.copy()
    starts = np.flatnonzero(random.random(len(angle_deg)) < law.dropout / law.dropout_run)
    for k, length in zip(starts, random.geometric(1.0 / law.dropout_run, len(starts)), strict=True):
        reading[k : k + length] = random.uniform(-0.5, 0.5, len(reading[k : k + length])) * SPAN_DEG
    return reading


def angle_reading(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """The recorded angle (deg), shape (n,), of the true pressures and angle (MPa, rad), shape (3, n)."""
    n, angle = motion.shape[1], np.degrees(motion[2])
    healthy = SHOT_DEG * random.standard_normal(n) + shimmer(n, SHIMMER_DEG, period_s, random)
    if law.play_deg > 0.0:
        angle = greased(angle, 0.5 * law.play_deg, law.play_drag)
    angle = detector(angle, session.physics)
    if law.bend_deg != 0.0:
        angle = angle + law.bend_deg * askew(angle, law.bend_tilt)
    angle = _pole(angle, AMPLIFIER_S, period_s)
    if law.lag_s > 0.0:
        angle = diffused(angle, law.lag_s, law.lag_tail, period_s)
    daylight = law.gain * (1.0 + law.gain_day * np.linspace(-0.5, 0.5, n))
    angle = session.angle_gain * angle * (1.0 + daylight)
    if law.range_gain != 0.0:
        angle = ranged(angle, law.range_gain, law.range_deg)
    if law.frame_deg_mpa != 0.0:
        angle = angle + law.frame_deg_mpa * (motion[int(law.frame_muscle)] - REST_MPA)
    reading = angle + session.angle_offset_deg + healthy + added(angle, law, period_s, random)
    return interrupted(coded(reading, law), law, random)


def monitor_reading(pressure_mpa: Array, bias_mpa: float, gain: float, period_s: float, random: Generator) -> Array:
    """The recorded pressure (gauge MPa): the mean over the last period, the day's gain and zero, noise of two colours,
    whole swings, of which none is lost from one count to the next."""
    n = len(pressure_mpa)
    shown = gain * 0.5 * (pressure_mpa + np.concatenate([pressure_mpa[:1], pressure_mpa[:-1]])) + bias_mpa
    shown += MONITOR_NOISE_MPA * random.standard_normal(n)
    shown += coloured(n, MONITOR_SLOW_MPA, MONITOR_SLOW_S, period_s, random)
    swing = SWINGS_MPA * 0.005 / period_s
    counted = np.floor(np.cumsum(shown / swing) + random.random())
    return np.asarray(np.diff(counted, prepend=np.round(counted[0] - shown[0] / swing)) * swing)


def readings(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """Pressures (MPa) and angle (deg) as recorded, shape (3, n), of the true ones (MPa, rad)."""
    first = monitor_reading(motion[0], session.monitor_bias_1_mpa, session.monitor_gain_1, period_s, random)
    second = monitor_reading(motion[1], session.monitor_bias_2_mpa, session.monitor_gain_2, period_s, random)
    return np.array([first, second, angle_reading(motion, law, session, period_s, random)])
