"""How angle and pressures become readings in the seventh family: a resolver, a converter that tracks it, transmitters
with their own filter.

The tracking converter is a loop of type II: its error is zero at a steady speed and grows with the acceleration
(closed loop (2 z w s + w^2) / (s^2 + 2 z w s + w^2)).
"""

import math
from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.airbeam.disturbance import ReadingLaw
from hil.reference.airbeam.physics import Physics
from hil.reference.compiling import Array, compiled
from hil.reference.noise import coloured, one_pole
from hil.reference.plant import PlantDay

CODE_DEG: Final = 360.0 / 16_384
ANGLE_NOISE_DEG: Final = 0.045
"""Ahead of the tracking."""
FLICKER_DEG, FLICKER_S = 0.02, (0.05, 0.7)
TRACKING_DAMPING: Final = 0.75
RING_DAMPING: Final = 0.35
CABLE_MODES: Final = 6
REFERENCE_DEG: Final = 40.0
MONITOR_CODE_MPA: Final = 1.0 / 16_384
MONITOR_NOISE_MPA: Final = 0.0006
MONITOR_S: Final = 0.005
"""Filter of a transmitter; the reading is the mean of this tick's conversion and of the one before."""
LOOP_HUM_MPA: Final = 0.00012
"""Mains on the transmitters' current loops."""
NOISE_RING, NOISE_KEEP = 0.55, 0.7
"""Turns of the noise's ringing per sample in radians, and what is left of it from sample to sample."""
HUNT_HZ: Final = 0.5
"""By how much the frequency of a generating set hunts."""


@compiled
def tracked(angle_deg: Array, hz: float, damping: float, period_s: float) -> Array:
    """(n,) behind a tracking loop of type II, by the bilinear rule; at rest before."""
    out = np.empty_like(angle_deg)
    k = 1.0 / (math.pi * hz * period_s)
    lead = 2.0 * damping * k
    a0, a1, a2 = k * k + lead + 1.0, 2.0 - 2.0 * k * k, k * k - lead + 1.0
    x1 = x2 = y1 = y2 = angle_deg[0]
    for i in range(len(angle_deg)):
        x = angle_deg[i]
        y = ((lead + 1.0) * x + 2.0 * x1 + (1.0 - lead) * x2 - a1 * y1 - a2 * y2) / a0
        x2, x1, y2, y1 = x1, x, y1, y
        out[i] = y
    return out


@compiled
def rung(drive: Array, turn_rad: float, keep: float) -> Array:
    """(n,) noise that rings at a frequency, of about the drive's size."""
    out = np.empty_like(drive)
    a1, a2 = 2.0 * keep * math.cos(turn_rad), -keep * keep
    scale = math.sqrt((1.0 + a2) * ((1.0 - a2) ** 2 - a1 * a1) / (1.0 - a2))
    y1 = y2 = 0.0
    for i in range(len(drive)):
        y = scale * drive[i] + a1 * y1 + a2 * y2
        y2, y1 = y1, y
        out[i] = y
    return out


@compiled
def shaken(angle_deg: Array, half_deg: float, steps_deg: Array) -> Array:
    """(n,) where a shaft is that is shaken to and fro in its clearance, by the steps, between its flanks."""
    out = np.empty_like(angle_deg)
    follower = angle_deg[0]
    for k in range(len(angle_deg)):
        follower = min(max(follower + steps_deg[k], angle_deg[k] - half_deg), angle_deg[k] + half_deg)
        out[k] = follower
    return out


def by_rod(angle_deg: Array, at_rad: float) -> Array:
    """Shape of a short rod's error: its sine about an angle, without the slope there, 1 at that end of +-40 degrees
    where it is more."""

    def off(deg: Array) -> Array:
        turn = np.radians(deg)
        return np.asarray((np.sin(turn + at_rad) - math.sin(at_rad)) / math.cos(at_rad) - turn)

    return np.asarray(off(angle_deg) / np.abs(off(np.array([-REFERENCE_DEG, REFERENCE_DEG]))).max())


def windings(angle_deg: Array, gain: float, at_rad: float) -> Array:
    """What a resolver reads whose sine winding gives more: the arc tangent of both, zero at zero."""

    def read(turn: Array) -> Array:
        return np.asarray(np.arctan2((1.0 + gain) * np.sin(turn), np.cos(turn)))

    there = read(np.radians(angle_deg) + at_rad) - read(np.array(at_rad))
    return np.asarray(np.degrees(there))


def line(angle_deg: Array, physics: Physics) -> Array:
    """The healthy resolver's line: an error once and one twice per turn, zero at zero."""
    turn = np.radians(angle_deg)
    once = np.sin(turn + physics.once_rad) - math.sin(physics.once_rad)
    twice = np.sin(2.0 * turn + physics.twice_rad) - math.sin(physics.twice_rad)
    return np.asarray(angle_deg + physics.once_deg * once + physics.twice_deg * twice)


def bent(angle_deg: Array, law: ReadingLaw, session: PlantDay) -> Array:
    """The static line: the day's gain, a short rod, a winding that gives more."""
    reading = session.angle_gain * line(angle_deg, session.physics)
    if law.bend_deg != 0.0:
        reading = reading + law.bend_deg * by_rod(angle_deg, law.bend_rad)
    return windings(reading, law.gain, law.gain_rad) if law.gain != 0.0 else np.asarray(reading)


def through_cable(angle_deg: Array, lag_s: float, period_s: float) -> Array:
    """Behind a long cable with resistance and capacitance all along it (Thomson 1855): its modes, and at once what is
    left of them; late by `lag_s`."""
    total, left = np.zeros(len(angle_deg)), 1.0
    for mode in range(CABLE_MODES):
        odd = 2 * mode + 1
        weight, keep = (
            (-1.0) ** mode * 4.0 / (math.pi * odd),
            math.exp(-period_s * (math.pi * odd) ** 2 / (8.0 * lag_s)),
        )
        total = total + weight * one_pole((1.0 - keep) * angle_deg, keep, float(angle_deg[0]))
        left -= weight
    return np.asarray(total + left * angle_deg)


def slid_deg(t: Array, law: ReadingLaw) -> Array:
    """A clamp that holds at first and then slides evenly; its mean slope over the record is `drift_deg_min`."""
    begun = law.drift_from * t[-1]
    return np.asarray(law.drift_deg_min / 60.0 * np.maximum(0.0, t - begun) / (1.0 - law.drift_from))


def generator_hum(t: Array, law: ReadingLaw, random: Generator) -> Array:
    """Hum of a generating set whose speed hunts."""
    begun, swing = random.uniform(0.0, 2.0 * math.pi, 2)
    slow = 2.0 * math.pi / law.hum_hunt_s
    turn = 2.0 * math.pi * law.hum_hz * t + 2.0 * math.pi * HUNT_HZ / slow * np.sin(slow * t + swing)
    return np.asarray(math.sqrt(2.0) * law.hum_deg * np.sin(turn + begun))


def added(n: int, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Offset, drift, hum and more noise, shape (n,)."""
    t = np.arange(n, dtype=float) * period_s
    total = law.offset_deg + slid_deg(t, law)
    if law.hum_deg > 0.0:
        total = total + generator_hum(t, law, random)
    if law.noise_deg > 0.0:
        total = total + rung(law.noise_deg * random.standard_normal(n), NOISE_RING, NOISE_KEEP)
    return np.asarray(total)


def echoed(angle_deg: Array, share: float, late_s: float, period_s: float) -> Array:
    """A reading in which a share of an old one is left."""
    before = max(1, round(late_s / period_s))
    old = np.concatenate([np.full(before, angle_deg[0]), angle_deg[:-before]])
    return np.asarray((1.0 - share) * angle_deg + share * old)


def coded(angle_deg: Array, law: ReadingLaw) -> Array:
    """The converter's codes, or coarse ones of two converters that take turns and do not agree."""
    if law.step_deg <= CODE_DEG:
        return np.asarray(np.round(angle_deg / CODE_DEG) * CODE_DEG)
    off = law.step_apart * (np.arange(len(angle_deg)) % 2 - 0.5)
    return np.asarray((np.round(angle_deg / law.step_deg - off)) * law.step_deg)


def dropped(angle_deg: Array, law: ReadingLaw, random: Generator) -> Array:
    """Samples at which the tracking has fallen into a false null, so far from the true one."""
    if law.dropout <= 0.0:
        return angle_deg
    reading = angle_deg.copy()
    starts = np.flatnonzero(random.random(len(angle_deg)) < law.dropout / law.dropout_run)
    for k, length in zip(starts, random.geometric(1.0 / law.dropout_run, len(starts)), strict=True):
        reading[k : k + length] = angle_deg[k : k + length] + law.dropout_deg
    return reading


def flicker(n: int, period_s: float, random: Generator) -> Array:
    """Noise of several octaves that is always there, shape (n,)."""
    size = FLICKER_DEG / math.sqrt(len(FLICKER_S))
    return np.asarray(sum(coloured(n, size, time_s, period_s, random) for time_s in FLICKER_S))


def angle_reading(angle_rad: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """The recorded angle (deg), shape (n,), of the true one (rad)."""
    n, angle = len(angle_rad), np.degrees(angle_rad)
    white, slow = ANGLE_NOISE_DEG * random.standard_normal(n), flicker(n, period_s, random)
    if law.play_deg > 0.0:
        half = 0.5 * law.play_deg
        steps = half * law.play_shake * math.sqrt(period_s) * random.standard_normal(n)
        angle = shaken(angle, half, steps)
    angle = bent(angle, law, session)
    if law.lag_s > 0.0:
        angle = through_cable(angle, law.lag_s, period_s)
    angle = tracked(angle + white, session.physics.tracking_hz, TRACKING_DAMPING, period_s)
    if law.ring_hz > 0.0:
        angle = tracked(angle, law.ring_hz, RING_DAMPING, period_s)
    angle = angle + session.angle_offset_deg + slow + added(n, law, period_s, random)
    if law.echo > 0.0:
        angle = echoed(angle, law.echo, law.echo_s, period_s)
    return dropped(coded(angle, law), law, random)


def monitor_reading(pressure_mpa: Array, bias_mpa: float, gain: float, period_s: float, random: Generator) -> Array:
    """The recorded pressure (gauge MPa): the transmitter's filter, the mean of two conversions, the day's gain and
    zero, noise, mains, 14 bits."""
    n, keep = len(pressure_mpa), math.exp(-period_s / MONITOR_S)
    slow = one_pole((1.0 - keep) * pressure_mpa, keep, float(pressure_mpa[0]))
    shown = slow + MONITOR_NOISE_MPA * random.standard_normal(n)
    shown = 0.5 * (shown + np.concatenate([shown[:1], shown[:-1]]))
    turn = 2.0 * math.pi * (50.0 + 0.02 * random.standard_normal()) * np.arange(n) * period_s
    hum = LOOP_HUM_MPA * np.sin(turn + random.uniform(0.0, 2.0 * math.pi))
    return np.asarray(np.round((gain * shown + bias_mpa + hum) / MONITOR_CODE_MPA) * MONITOR_CODE_MPA)


def readings(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """Pressures (MPa) and angle (deg) as recorded, shape (3, n), of the true ones (MPa, rad)."""
    return np.array([
        monitor_reading(motion[0], session.monitor_bias_1_mpa, session.monitor_gain_1, period_s, random),
        monitor_reading(motion[1], session.monitor_bias_2_mpa, session.monitor_gain_2, period_s, random),
        angle_reading(motion[2], law, session, period_s, random),
    ])  # fmt: skip
