"""How angle and pressures become readings in the sixth family: a Hall element over a magnet, Butterworth's filters,
absolute pressure sensors less the day's barometer."""

import math
from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.compiling import Array, compiled
from hil.reference.noise import coloured, one_pole
from hil.reference.plant import PlantDay
from hil.reference.sleeve.disturbance import ReadingLaw
from hil.reference.sleeve.physics import Physics

FIELD_TURN: Final = 0.75
"""Turn of the magnet per turn of the joint (a small gear keeps it on the steep part of its sine)."""
CODE_DEG: Final = 180.0 / 4096
ANGLE_NOISE_DEG: Final = 0.06
"""Ahead of the filter, which lets about two thirds of it through."""
WANDER_DEG, WANDER_S = 0.02, 1.0
FILTER_HZ: Final = 55.0
KNOT_DEG: Final = 11.25
"""Between two knots of the table that makes the line straight."""
MONITOR_CODE_MPA: Final = 1.0 / 8192
MONITOR_NOISE_MPA: Final = 0.0005
MONITOR_WANDER_MPA, MONITOR_WANDER_S = 0.00012, 2.0
MONITOR_HZ: Final = 40.0
BUTTERWORTH: Final = (math.sqrt(2.0), 1.0)
BESSEL: Final = ((5.79242, 9.14013), (4.20758, 11.48780))
"""Both sections of s^4 + 10 s^3 + 45 s^2 + 105 s + 105, whose delay is one."""
SATURATION_DEG, BEND_AT_DEG = 45.0, 40.0
SHOT_S, SHOTS = 0.008, 0.5
"""Decay of one shot, and how many there are in a sample."""
STRAY_S: Final = 0.01
DRIFT_RECORD_S: Final = 20.0


@compiled
def second_order(column: Array, time_s: float, damping: float, spring: float, period_s: float) -> Array:
    """(n,) behind spring / (s^2 + damping s + spring), s in 1 / `time_s`, by the bilinear rule; at rest before."""
    out = np.empty_like(column)
    k = 2.0 * time_s / period_s
    a0, a1, a2 = k * k + damping * k + spring, 2.0 * (spring - k * k), k * k - damping * k + spring
    x1 = x2 = y1 = y2 = column[0]
    for i in range(len(column)):
        y = (spring * (column[i] + 2.0 * x1 + x2) - a1 * y1 - a2 * y2) / a0
        x2, x1, y2, y1 = x1, column[i], y1, y
        out[i] = y
    return out


def butterworth(column: Array, hz: float, period_s: float) -> Array:
    """Behind Butterworth's filter of second order."""
    return np.asarray(second_order(column, 1.0 / (2.0 * math.pi * hz), *BUTTERWORTH, period_s))


@compiled
def with_jumping_play(angle_deg: Array, half_deg: float, jump: float) -> Array:
    """(n,) where a loose magnet is: at rest until a flank reaches it, then it jumps ahead by a share of the
    clearance."""
    out = np.empty_like(angle_deg)
    place = angle_deg[0]
    for k in range(len(angle_deg)):
        gap = angle_deg[k] - place
        if abs(gap) > half_deg:
            place = angle_deg[k] - math.copysign(half_deg * (1.0 - jump), gap)
        out[k] = place
    return out


def line(angle_deg: Array, physics: Physics) -> Array:
    """The healthy sensor's line: a magnet that is no circle's, and what the table leaves between its knots."""
    twice = np.sin(np.radians(2.0 * FIELD_TURN * angle_deg) + physics.ellipse_rad) - math.sin(physics.ellipse_rad)
    place = angle_deg / KNOT_DEG + physics.knots_rad
    between = place - np.floor(place)
    return np.asarray(angle_deg + physics.ellipse_deg * twice + physics.knots_deg * 4.0 * between * (1.0 - between))


def by_arc_sine(field: Array) -> Array:
    """Angle (deg) that belongs to a field, against its largest."""
    return np.asarray(np.degrees(np.arcsin(np.clip(field, -1.0, 1.0))) / FIELD_TURN)


def field_of(angle_deg: Array) -> Array:
    """Field over the element at an angle, against its largest."""
    return np.asarray(np.sin(np.radians(FIELD_TURN * angle_deg)))


def saturated(angle_deg: Array, bias: float) -> Array:
    """Shape of an element that saturates, without its line at zero, 1 in size at 40 degrees."""
    slope = 1.0 - math.tanh(bias) ** 2

    def bend(turn: Array) -> Array:
        return np.asarray(np.tanh(turn + bias) - math.tanh(bias) - slope * turn)

    return bend(angle_deg / SATURATION_DEG) / abs(float(bend(np.array(BEND_AT_DEG / SATURATION_DEG))))


def bent(angle_deg: Array, law: ReadingLaw, session: PlantDay) -> Array:
    """The static line: the day's gain, the field's, saturation, one knot of the table that is wrong."""
    reading = session.angle_gain * angle_deg
    if law.gain != 0.0:
        reading = by_arc_sine((1.0 + law.gain) * field_of(reading))
    if law.bend_deg != 0.0:
        reading = reading - law.bend_deg * saturated(reading, law.bend_bias)
    if law.knot_deg != 0.0:
        reading = reading + law.knot_deg * np.clip(1.0 - np.abs(reading - law.knot_at_deg) / KNOT_DEG, 0.0, 1.0)
    return np.asarray(reading)


def delayed(angle_deg: Array, lag_s: float, period_s: float) -> Array:
    """Behind Bessel's filter of fourth order."""
    for section in BESSEL:
        angle_deg = np.asarray(second_order(angle_deg, lag_s, *section, period_s))
    return angle_deg


def drift_deg(t: Array, law: ReadingLaw, random: Generator) -> Array:
    """A random walk about a straight line."""
    steps = random.standard_normal(len(t)) * math.sqrt((t[1] - t[0]) / DRIFT_RECORD_S)
    return np.asarray(law.drift_deg_min / 60.0 * (t + law.drift_walk * DRIFT_RECORD_S * np.cumsum(steps)))


def hum(t: Array, law: ReadingLaw, random: Generator) -> Array:
    """Mains behind a dimmer that cuts off the beginning of each half wave."""
    turn = law.hum_hz * (1.0 + 1.5e-4 * random.standard_normal()) * t + random.uniform()
    wave = np.sin(2.0 * math.pi * turn) * ((2.0 * turn) % 1.0 >= law.hum_fire)
    left = 0.5 * (1.0 - law.hum_fire) + math.sin(2.0 * math.pi * law.hum_fire) / (4.0 * math.pi)
    return np.asarray(law.hum_deg / math.sqrt(left) * wave)


def shots(n: int, sigma: float, period_s: float, random: Generator) -> Array:
    """Shot noise of standard deviation `sigma`, shape (n,): pulses of any size that decay."""
    keep = math.exp(-period_s / SHOT_S)
    size = sigma * math.sqrt((1.0 - keep * keep) / SHOTS)
    return np.asarray(one_pole(size * random.standard_normal(n) * (random.random(n) < SHOTS), keep, 0.0))


def added(motion: Array, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Offset, drift, hum, more noise and what the coils stray into the element, shape (n,)."""
    n: int = motion.shape[1]
    t = np.arange(n, dtype=float) * period_s
    total = np.full(n, law.offset_deg)
    if law.drift_deg_min != 0.0:
        total = total + drift_deg(t, law, random)
    if law.hum_deg > 0.0:
        total = total + hum(t, law, random)
    if law.noise_deg > 0.0:
        total = total + shots(n, law.noise_deg, period_s, random)
    if law.stray_deg_s != 0.0:
        keep = math.exp(-period_s / STRAY_S)
        rate = np.gradient(motion[0] - motion[1], period_s)
        total = total + law.stray_deg_s * np.asarray(one_pole((1.0 - keep) * rate, keep, 0.0))
    return np.asarray(total)


def zeroed(angle_deg: Array, rate_per_s: float, period_s: float) -> Array:
    """A reading whose zero follows it slowly."""
    keep = math.exp(-period_s * rate_per_s)
    return np.asarray(angle_deg - one_pole((1.0 - keep) * angle_deg, keep, 0.0))


def coded(angle_deg: Array, law: ReadingLaw) -> Array:
    """The converter's codes, or coarse ones of the field, which are wider the further the magnet is turned."""
    if law.step_deg <= CODE_DEG:
        return np.asarray(np.round(angle_deg / CODE_DEG) * CODE_DEG)
    step = math.radians(FIELD_TURN * law.step_deg)
    return by_arc_sine(np.round(field_of(angle_deg) / step) * step)


def dropped(angle_deg: Array, law: ReadingLaw, random: Generator) -> Array:
    """Samples at which the sensor restarts, always for as long."""
    if law.dropout <= 0.0:
        return angle_deg
    run = round(law.dropout_run)
    reading = angle_deg.copy()
    for k in np.flatnonzero(random.random(len(angle_deg)) < law.dropout / run):
        reading[k : k + run] = law.dropout_deg
    return reading


def angle_reading(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """The recorded angle (deg), shape (n,), of the true one (rad); the pressures are there for what strays."""
    n: int = motion.shape[1]
    angle, white = np.degrees(motion[2]), ANGLE_NOISE_DEG * random.standard_normal(n)
    if law.play_deg > 0.0:
        angle = with_jumping_play(angle, 0.5 * law.play_deg, law.play_jump)
    angle = bent(line(angle, session.physics), law, session)
    if law.lag_s > 0.0:
        angle = delayed(angle, law.lag_s, period_s)
    angle = butterworth(angle + white, FILTER_HZ, period_s) + session.angle_offset_deg
    angle = angle + coloured(n, WANDER_DEG, WANDER_S, period_s, random) + added(motion, law, period_s, random)
    if law.tracking_per_s > 0.0:
        angle = zeroed(angle, law.tracking_per_s, period_s)
    return dropped(coded(angle, law), law, random)


def monitor_reading(pressure_mpa: Array, bias_mpa: float, gain: float, period_s: float, random: Generator) -> Array:
    """The recorded pressure (gauge MPa): filter, the day's gain and bias, noise, 13 bits."""
    n = len(pressure_mpa)
    noise = MONITOR_NOISE_MPA * random.standard_normal(n)
    noise = noise + coloured(n, MONITOR_WANDER_MPA, MONITOR_WANDER_S, period_s, random)
    reading = gain * butterworth(pressure_mpa, MONITOR_HZ, period_s) + bias_mpa + noise
    return np.asarray(np.round(reading / MONITOR_CODE_MPA) * MONITOR_CODE_MPA)


def readings(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """Pressures (MPa) and angle (deg) as recorded, shape (3, n), of the true ones (MPa, rad)."""
    return np.array([
        monitor_reading(motion[0], session.monitor_bias_1_mpa, session.monitor_gain_1, period_s, random),
        monitor_reading(motion[1], session.monitor_bias_2_mpa, session.monitor_gain_2, period_s, random),
        angle_reading(motion, law, session, period_s, random),
    ])  # fmt: skip
