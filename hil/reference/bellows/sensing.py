"""How angle and pressures become readings in the fourth family: a loaded potentiometer whose wiper bends, a filter,
12-bit converters, noise of several colours."""

import math
from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.bellows.disturbance import ReadingLaw
from hil.reference.bellows.physics import Physics
from hil.reference.compiling import Array, compiled
from hil.reference.noise import one_pole
from hil.reference.plant import PlantDay
from hil.reference.play import dragged

TRACK_DEG: Final = 300.0
CODE_DEG: Final = TRACK_DEG / 4096
ANGLE_NOISE_DEG: Final = 0.045
RUMBLE_DEG: Final = 0.02
RUMBLE_S: Final = 0.5
MONITOR_CODE_MPA: Final = 0.5 / 4096 * 5.0 / 4.0
"""1 to 5 V for 0 to 0.5 MPa on a 12-bit converter of 0 to 5 V."""
MONITOR_NOISE_MPA: Final = 0.0005
MONITOR_FILTER_S: Final = 0.005
COLOUR_S: Final = 0.012
BEND_AT_DEG: Final = 40.0
BENT_LOAD, BENT_TRACK_DEG = 1.5, 220.0
PLAY_STEPS, PLAY_DAMPING, PLAY_DRAG_S = 12, 0.6, 0.012
QUICK, SLOW = 0.4, 1.6
"""Time constants of both paths of a filter, against their mean."""


def coloured(n: int, sigma: float, time_s: float, period_s: float, random: Generator) -> Array:
    """Noise of standard deviation `sigma` and correlation time `time_s`, shape (n,)."""
    keep = math.exp(-period_s / time_s)
    drive = sigma * math.sqrt((1.0 + keep) / (1.0 - keep)) * random.standard_normal(n)
    return np.asarray(one_pole((1.0 - keep) * drive, keep, sigma * float(random.standard_normal())))


def low_passed(column: Array, time_s: float, period_s: float) -> Array:
    """Behind one pole, at rest before the record."""
    keep = math.exp(-period_s / time_s)
    return np.asarray(one_pole((1.0 - keep) * column, keep, float(column[0])))


@compiled
def _coasting(angle_deg: Array, play_deg: float, hz: float, period_s: float) -> Array:
    """A shaft with inertia and some drag within its clearance: spring and damper where it touches, else it coasts."""
    out = np.empty_like(angle_deg)
    h, w, half = period_s / PLAY_STEPS, 2.0 * math.pi * hz, 0.5 * play_deg
    x, v, before = angle_deg[0], 0.0, angle_deg[0]
    for k in range(len(angle_deg)):
        speed = (angle_deg[k] - before) / period_s
        for i in range(PLAY_STEPS):
            gap = before + (i + 1) * h * speed - x
            beyond = gap - max(-half, min(half, gap))
            push = w * w * beyond + 2.0 * PLAY_DAMPING * w * (speed - v)
            if push * beyond > 0.0:
                v += h * push
            v /= 1.0 + h / PLAY_DRAG_S
            x += h * v
        before = angle_deg[k]
        out[k] = x
    return out


def loading(place: Array, load: float) -> Array:
    """What a track that is loaded reads at a place from 0 to 1."""
    return np.asarray(place / (1.0 + load * place * (1.0 - place)))


def loaded_bend(angle_deg: Array, middle: float) -> Array:
    """Shape of a heavily loaded track about `middle`, without its slope there, 1 at 40 degrees."""
    step = 1e-4
    places = middle + np.array([-step, 0.0, step, BEND_AT_DEG / BENT_TRACK_DEG])
    low, here, high, far = loading(places, BENT_LOAD).tolist()
    slope = (high - low) / (2.0 * step)
    line = loading(middle + angle_deg / BENT_TRACK_DEG, BENT_LOAD) - here - slope * angle_deg / BENT_TRACK_DEG
    return np.asarray(line / abs(far - here - slope * BEND_AT_DEG / BENT_TRACK_DEG))


def track(angle_deg: Array, physics: Physics) -> Array:
    """The healthy potentiometer's line: its load, without the slope at zero, and a wavy track."""
    place, load = 0.5 + angle_deg / TRACK_DEG, physics.load
    slope = 1.0 / (1.0 + 0.25 * load)
    straight = TRACK_DEG * (loading(place, load) - 0.5 * slope) / slope
    waves = np.sin(angle_deg / 5.0 + physics.track_1_rad) + 0.6 * np.sin(angle_deg / 1.7 + physics.track_2_rad)
    return np.asarray(straight + physics.track_deg * waves)


def bent(angle_deg: Array, law: ReadingLaw, session: PlantDay) -> Array:
    """The static line: the day's gain, a gain about a pivot, a bend."""
    reading = session.angle_gain * angle_deg
    reading = reading + law.gain * (reading - law.gain_pivot_deg)
    return np.asarray(reading + law.bend_deg * loaded_bend(angle_deg, law.bend_place))


def filtered(angle_deg: Array, law: ReadingLaw, own_s: float, period_s: float) -> Array:
    """The filter's own pole, and a slower filter of two paths side by side."""
    angle = low_passed(angle_deg, own_s, period_s)
    if law.lag_s <= 0.0:
        return angle
    quick, slow = (low_passed(angle, share * law.lag_s, period_s) for share in (QUICK, SLOW))
    return np.asarray(0.5 * (quick + slow))


def stairs_deg(t: Array, law: ReadingLaw) -> Array:
    """A drift that rests for four fifths of each stair."""
    place = t / law.drift_stair_s
    whole = np.floor(place)
    stairs = whole + np.clip(5.0 * (place - whole - 0.8), 0.0, 1.0)
    return np.asarray(law.drift_deg_min / 60.0 * law.drift_stair_s * stairs)


def hum(t: Array, angle_deg: Array, law: ReadingLaw, random: Generator) -> Array:
    """Mains with its second harmonic, picked up the more the further the wiper is from the grounded end."""
    turn = 2.0 * math.pi * law.hum_hz * (1.0 + 1.5e-4 * random.standard_normal()) * t + random.uniform(0.0, 6.283)
    wave = np.sin(turn) + 0.25 * np.sin(2.0 * turn + 1.2)
    return np.asarray(math.sqrt(2.0 / 1.0625) * law.hum_deg * wave * (1.0 + angle_deg / TRACK_DEG))


def added(angle_deg: Array, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Offset, drift, hum and more noise, shape (n,)."""
    n = len(angle_deg)
    t = np.arange(n, dtype=float) * period_s
    total = law.offset_deg + stairs_deg(t, law)
    if law.hum_deg > 0.0:
        total = total + hum(t, angle_deg, law, random)
    if law.noise_deg > 0.0:
        total = total + law.noise_deg * 0.8 * random.standard_normal(n)
        total = total + coloured(n, 0.6 * law.noise_deg, COLOUR_S, period_s, random)
    return np.asarray(total)


def in_blocks(angle_deg: Array, block_s: float, period_s: float) -> Array:
    """Means of one block each, shown during the next; the last whole readings of a block that is not over count too."""
    width = round(block_s / period_s)
    if width < 1:
        return angle_deg
    starts = np.arange(0, len(angle_deg), width)
    means = np.add.reduceat(angle_deg, starts) / np.diff(np.append(starts, len(angle_deg)))
    shown = np.append(angle_deg[0], means[:-1])
    return np.asarray(np.repeat(shown, width)[: len(angle_deg)])


def coded(angle_deg: Array, law: ReadingLaw) -> Array:
    """The converter's codes, or coarser ones some of which are missing."""
    if law.step_deg <= CODE_DEG:
        return np.asarray(np.round(angle_deg / CODE_DEG) * CODE_DEG)
    code = np.round(angle_deg / law.step_deg)
    missing = code % max(2, int(law.step_missing)) == 1
    return np.asarray((code - missing) * law.step_deg)


def dropped(angle_deg: Array, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Samples at which the wiper is off the track and its input floats away; it jumps off more often at speed."""
    if law.dropout <= 0.0:
        return angle_deg
    n, speed = len(angle_deg), np.abs(np.gradient(low_passed(angle_deg, 0.05, period_s), period_s))
    often = 0.4 + 0.6 * speed / max(1.0, float(np.mean(speed)))
    starts = np.flatnonzero(random.random(n) < law.dropout / law.dropout_run * often)
    reading = angle_deg.copy()
    for k, length in zip(starts, random.geometric(1.0 / law.dropout_run, len(starts)), strict=True):
        reading[k : k + length] = law.dropout_deg
    return reading


def angle_reading(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """The recorded angle (deg), shape (n,), of the true one (rad); the pressures are there for what bleeds over."""
    n, physics, angle = motion.shape[1], session.physics, np.degrees(motion[2])
    noise = ANGLE_NOISE_DEG * random.standard_normal(n) + coloured(n, RUMBLE_DEG, RUMBLE_S, period_s, random)
    if law.play_deg > 0.0:
        angle = _coasting(angle, law.play_deg, law.play_hz, period_s)
    angle = bent(track(dragged(angle, 0.5 * physics.wiper_deg), physics), law, session)
    angle = filtered(angle, law, physics.filter_s, period_s) + session.angle_offset_deg + noise
    angle = angle + added(angle, law, period_s, random) + law.bleed_deg * (motion[1] - 0.2) / 0.1
    if law.block_s > 0.0:
        angle = in_blocks(angle, law.block_s, period_s)
    return dropped(coded(angle, law), law, period_s, random)


def monitor_reading(pressure_mpa: Array, bias_mpa: float, gain: float, period_s: float, random: Generator) -> Array:
    """The recorded pressure (gauge MPa): filter, the day's gain and bias, noise of two colours, 12 bits."""
    n = len(pressure_mpa)
    noise = 0.8 * MONITOR_NOISE_MPA * random.standard_normal(n)
    noise = noise + coloured(n, 0.6 * MONITOR_NOISE_MPA, COLOUR_S, period_s, random)
    reading = gain * low_passed(pressure_mpa, MONITOR_FILTER_S, period_s) + bias_mpa + noise
    return np.asarray(np.round(reading / MONITOR_CODE_MPA) * MONITOR_CODE_MPA)


def readings(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """Pressures (MPa) and angle (deg) as recorded, shape (3, n), of the true ones (MPa, rad)."""
    return np.array([
        monitor_reading(motion[0], session.monitor_bias_1_mpa, session.monitor_gain_1, period_s, random),
        monitor_reading(motion[1], session.monitor_bias_2_mpa, session.monitor_gain_2, period_s, random),
        angle_reading(motion, law, session, period_s, random),
    ])  # fmt: skip
