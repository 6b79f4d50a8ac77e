"""How angle and pressures become readings in the eighth family: a potentiometer of conductive plastic on a 16-bit
converter that means its samples, monitors of 12 bits one after the other.

Such a track's conformity error waves along it, and its output smoothness (VRCI-P-100A) is a grain that is the same
whenever the wiper comes by.
"""

import math
from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.compiling import Array, compiled
from hil.reference.diaphragm.disturbance import ReadingLaw
from hil.reference.diaphragm.physics import Physics
from hil.reference.noise import coloured, one_pole
from hil.reference.plant import PlantDay

TRACK_DEG: Final = 345.0
CODE_DEG: Final = TRACK_DEG / 65_536
WAVES_DEG: Final = (70.0, 31.0, 13.0)
"""Lengths of the track's waves."""
MEANT: Final = 4
"""Samples that a reading is the mean of, over one half of a period."""
WHITE_DEG, GRAIN_DEG = 0.03, 0.02
GRAIN_PITCH_DEG: Final = 0.25
GRAINS: Final = 1024
SLOW_DEG, SLOW_S = 0.015, 0.4
REFERENCE_DEG: Final = 40.0
KINK_DEG: Final = 2.0
"""Over which a track's joint is rounded."""
MONITOR_CODE_MPA: Final = 0.5 / 4096
MONITOR_S: Final = 0.004
MONITOR_NOISE_MPA, MONITOR_SLOW_MPA, MONITOR_SLOW_S = 0.0005, 0.0002, 0.15
SECOND_LATER_S: Final = 0.0008
"""By how much later the converter comes to monitor 2."""
SECOND_PICKUP: Final = 0.7
"""Of the pick-up, what regulator 2's leads induce."""


@compiled
def leaning(angle_deg: Array, half_deg: float, keep: float) -> Array:
    """(n,) where a follower is between its flanks, whose weak spring leans it on the upper one by what it does not keep
    of the way there."""
    out = np.empty_like(angle_deg)
    place = angle_deg[0]
    for k in range(len(angle_deg)):
        place += (1.0 - keep) * (angle_deg[k] + half_deg - place)
        place = min(max(place, angle_deg[k] - half_deg), angle_deg[k] + half_deg)
        out[k] = place
    return out


@compiled
def followed(angle_deg: Array, up: float, down: float) -> Array:
    """(n,) behind one pole whose pace a sample is another one upwards and downwards."""
    out = np.empty_like(angle_deg)
    place = angle_deg[0]
    for k in range(len(angle_deg)):
        off = angle_deg[k] - place
        place += (up if off > 0.0 else down) * off
        out[k] = place
    return out


def track(angle_deg: Array, physics: Physics) -> Array:
    """The healthy track's line: waves, zero at zero."""
    waves = (
        (physics.track_1_deg, physics.track_1_rad),
        (physics.track_2_deg, physics.track_2_rad),
        (physics.track_3_deg, physics.track_3_rad),
    )
    line = np.array(angle_deg, float)
    for (size, phase), long_deg in zip(waves, WAVES_DEG, strict=True):
        line += size * (np.sin(2.0 * math.pi * angle_deg / long_deg + phase) - math.sin(phase))
    return line


def kinked(angle_deg: Array, at_deg: float) -> Array:
    """Shape of a joint in the track: two straight lines that meet at an angle, without the slope at zero, 1 at that end
    of +-40 degrees where it is more."""

    def off(deg: Array) -> Array:
        slope = -at_deg / math.hypot(at_deg, KINK_DEG)
        return np.asarray(np.hypot(deg - at_deg, KINK_DEG) - math.hypot(at_deg, KINK_DEG) - slope * deg)

    return np.asarray(off(angle_deg) / np.abs(off(np.array([-REFERENCE_DEG, REFERENCE_DEG]))).max())


def excited(t: Array, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Excitation against the right one, shape (n,): an error that its reference warms up to, and one that wanders."""
    excitation = np.ones(len(t))
    if law.gain != 0.0:
        excitation += law.gain * (1.0 - 0.2 * np.exp(-t / law.gain_warms_s))
    if law.wander > 0.0:
        excitation += coloured(len(t), law.wander, law.wander_s, period_s, random)
    return excitation


def grain(angle_deg: Array, size_deg: float, random: Generator) -> Array:
    """A track's grain where the wiper is, shape (n,)."""
    grains = size_deg * random.standard_normal(GRAINS)
    place = np.asarray(angle_deg) / GRAIN_PITCH_DEG
    whole, part = np.floor(place).astype(int), place - np.floor(place)
    mixed = (1.0 - part) * grains[whole % GRAINS] + part * grains[(whole + 1) % GRAINS]
    return np.asarray(mixed / np.sqrt((1.0 - part) ** 2 + part**2))


def motor_hum(t: Array, law: ReadingLaw, random: Generator) -> Array:
    """Hum of an induction motor, which swells with its slip."""
    begun, swing = random.uniform(0.0, 2.0 * math.pi, 2)
    swell = 1.0 + 0.5 * np.cos(2.0 * math.pi * law.hum_slip_hz * t + swing)
    return np.asarray(math.sqrt(2.0 / 1.125) * law.hum_deg * swell * np.sin(2.0 * math.pi * law.hum_hz * t + begun))


def added(angle_deg: Array, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Offset, drift, hum and more noise, shape (n,)."""
    n = len(angle_deg)
    t = np.arange(n, dtype=float) * period_s
    total = law.offset_deg + law.drift_deg_min / 60.0 * t[-1] * np.sqrt(t / t[-1])
    if law.hum_deg > 0.0:
        total = total + motor_hum(t, law, random)
    if law.noise_deg > 0.0:
        total = total + grain(angle_deg, math.sqrt(law.noise_grain) * law.noise_deg, random)
        total = total + math.sqrt(1.0 - law.noise_grain) * law.noise_deg * random.standard_normal(n)
    return np.asarray(total)


def picked_up(pressures_mpa: Array, pickup_deg: float, period_s: float) -> Array:
    """What the solenoids induce as they move both pressures, shape (2, n): in proportion to the rates."""
    rates = np.gradient(pressures_mpa, period_s, axis=1)
    return np.asarray(pickup_deg * (rates[0] - SECOND_PICKUP * rates[1]))


def coded(angle_deg: Array, law: ReadingLaw) -> Array:
    """The converter's codes, or a wound track's: from turn to turn, and half-way while the wiper bridges two."""
    if law.step_deg <= CODE_DEG:
        return np.asarray(np.round(angle_deg / CODE_DEG) * CODE_DEG)
    place = angle_deg / law.step_deg + 0.5
    bridged = place - np.floor(place) > 1.0 - law.step_bridge
    return np.asarray(law.step_deg * (np.floor(place) + 0.5 * bridged))


def lifted_off(angle_deg: Array, law: ReadingLaw, random: Generator) -> Array:
    """Samples at which the wiper is off its track, and the input at one end of its range or at the other."""
    if law.dropout <= 0.0:
        return angle_deg
    reading = angle_deg.copy()
    longest = int(law.dropout_longest)
    starts = np.flatnonzero(random.random(len(angle_deg)) < law.dropout * 2.0 / (1.0 + longest))
    for k in starts:
        end = float(random.choice((-0.5, 0.5))) * TRACK_DEG
        reading[k : k + int(random.integers(1, longest + 1))] = end
    return reading


def angle_reading(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """The recorded angle (deg), shape (n,), of the true pressures and angle (MPa, rad), shape (3, n)."""
    n, angle, physics = motion.shape[1], np.degrees(motion[2]), session.physics
    t = np.arange(n, dtype=float) * period_s
    healthy = WHITE_DEG / math.sqrt(MEANT) * random.standard_normal(n) + coloured(n, SLOW_DEG, SLOW_S, period_s, random)
    healthy += grain(angle, GRAIN_DEG, random)
    if law.play_deg > 0.0:
        angle = leaning(angle, 0.5 * law.play_deg, math.exp(-period_s / law.play_lean_s))
    keep = math.exp(-period_s / physics.filter_s)
    angle = one_pole((1.0 - keep) * track(angle, physics), keep, float(track(angle[:1], physics)[0]))
    if law.bend_deg != 0.0:
        angle = angle + law.bend_deg * kinked(angle, law.bend_at_deg)
    angle = session.angle_gain * angle * excited(t, law, period_s, random)
    if law.lag_s > 0.0:
        up, down = (1.0 - math.exp(-period_s / (law.lag_s * (1.0 + way * law.lag_uneven))) for way in (1.0, -1.0))
        angle = followed(angle, up, down)
    if law.pickup_deg != 0.0:
        angle = angle + picked_up(motion[:2], law.pickup_deg, period_s)
    reading = angle + session.angle_offset_deg + healthy + added(angle, law, period_s, random)
    return lifted_off(coded(reading, law), law, random)


def monitor_reading(
    pressure_mpa: Array, bias_mpa: float, gain: float, later_s: float, period_s: float, random: Generator
) -> Array:
    """The recorded pressure (gauge MPa): the sensor's filter, a converter that comes to it so much later, the day's
    gain and zero, noise of two colours, 12 bits."""
    n, keep = len(pressure_mpa), math.exp(-period_s / MONITOR_S)
    slow = one_pole((1.0 - keep) * pressure_mpa, keep, float(pressure_mpa[0]))
    t = np.arange(n, dtype=float) * period_s
    shown = gain * np.interp(t + later_s, t, slow) + bias_mpa
    shown += MONITOR_NOISE_MPA * random.standard_normal(n)
    shown += coloured(n, MONITOR_SLOW_MPA, MONITOR_SLOW_S, period_s, random)
    return np.asarray(np.round(shown / MONITOR_CODE_MPA) * MONITOR_CODE_MPA)


def readings(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """Pressures (MPa) and angle (deg) as recorded, shape (3, n), of the true ones (MPa, rad)."""
    bias_1, bias_2 = session.monitor_bias_1_mpa, session.monitor_bias_2_mpa
    first = monitor_reading(motion[0], bias_1, session.monitor_gain_1, 0.0, period_s, random)
    second = monitor_reading(motion[1], bias_2, session.monitor_gain_2, SECOND_LATER_S, period_s, random)
    return np.array([first, second, angle_reading(motion, law, session, period_s, random)])
