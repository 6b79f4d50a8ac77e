"""How angle and pressures become readings in the second family: an incremental encoder, 16-bit monitors behind a
filter, pink noise."""

import math
from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.compiling import Array, compiled
from hil.reference.fluidic.disturbance import ReadingLaw
from hil.reference.noise import one_pole
from hil.reference.plant import PlantDay

COUNT_DEG: Final = 360.0 / 10_000
MONITOR_CODE_MPA: Final = 1.0 / 65_536
MONITOR_NOISE_MPA: Final = 0.0005
MONITOR_FILTER_S: Final = 0.004
SHAKE_DEG: Final = 0.03
SHAKE_HZ: Final = 11.0
"""The frame shakes: its resonance, in the angle."""
ANGLE_NOISE_DEG: Final = 0.01
OCTAVES_S: Final = (0.004, 0.03, 0.2, 1.5)
"""Correlation times whose sum is nearly 1/f."""
FULL_DEG: Final = 40.0


@compiled
def _shaken(drive: Array, hz: float, damping: float, period_s: float) -> Array:
    """Noise through a resonance."""
    out = np.empty_like(drive)
    radius = math.exp(-2.0 * math.pi * hz * damping * period_s)
    turn = 2.0 * radius * math.cos(2.0 * math.pi * hz * math.sqrt(1.0 - damping * damping) * period_s)
    before, last = 0.0, 0.0
    for k in range(len(drive)):
        before, last = last, turn * last - radius * radius * before + drive[k]
        out[k] = last
    return out


@compiled
def _geared(angle_deg: Array, play_deg: float, wave_deg: float) -> Array:
    """A gear with clearance, a quarter wider and narrower around the wheel."""
    out = np.empty_like(angle_deg)
    follower = angle_deg[0]
    for k in range(len(angle_deg)):
        half = 0.5 * play_deg * (1.0 + 0.25 * math.sin(2.0 * math.pi * angle_deg[k] / wave_deg))
        follower = min(max(follower, angle_deg[k] - half), angle_deg[k] + half)
        out[k] = follower
    return out


@compiled
def _counted(angle_deg: Array, step_deg: float, hold: float) -> Array:
    """Codes of one width, left only when the angle is beyond their edge by `hold` of a width."""
    out = np.empty_like(angle_deg)
    code = math.floor(angle_deg[0] / step_deg + 0.5)
    for k in range(len(angle_deg)):
        place = angle_deg[k] / step_deg
        if abs(place - code) > 0.5 + hold:
            code = math.floor(place + 0.5)
        out[k] = code * step_deg
    return out


def pink(n: int, sigma: float, period_s: float, random: Generator) -> Array:
    """Noise of standard deviation `sigma` whose power falls with frequency, shape (n,)."""
    total = np.zeros(n)
    for time_s in OCTAVES_S:
        keep = math.exp(-period_s / time_s)
        drive = random.standard_normal(n) * math.sqrt((1.0 + keep) / (1.0 - keep))
        total += one_pole((1.0 - keep) * drive, keep, float(random.standard_normal()))
    return sigma * total / math.sqrt(len(OCTAVES_S))


def bent(angle_deg: Array, law: ReadingLaw, session: PlantDay) -> Array:
    """The static line: the eccentric disc, a gain that is uneven, a bend."""
    physics = session.physics
    turn = np.radians(angle_deg) + physics.disc_rad
    reading = angle_deg + physics.disc_deg * (np.sin(turn) - math.sin(physics.disc_rad))
    reading = reading * (1.0 + law.gain * (1.0 + law.gain_uneven * np.tanh(angle_deg / 5.0)))
    x = angle_deg / FULL_DEG
    bend = (1.0 - law.bend_even) * (x * np.abs(x) - 0.8 * x) + law.bend_even * x * x
    wave = law.ripple_deg * np.sin(2.0 * math.pi * law.ripple_per_deg * angle_deg)
    return np.asarray(reading + law.bend_deg * bend + wave)


def moving_mean(angle_deg: Array, window_s: float, period_s: float) -> Array:
    """Mean of the last `window_s`, with a share of the oldest sample; before the record the angle was at rest."""
    if window_s <= 0.0:
        return angle_deg
    width = 1.0 + window_s / period_s
    whole = math.floor(width)
    weights = np.append(np.ones(whole), width - whole) / width
    before = np.full(len(weights) - 1, angle_deg[0])
    return np.asarray(np.convolve(np.concatenate([before, angle_deg]), weights, mode="valid"))


def added(n: int, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Offset, drift, hum and more noise, shape (n,)."""
    t = np.arange(n) * period_s
    total = law.offset_deg + law.drift_deg_min * t / 60.0 * (0.6 + 0.4 * t / 20.0)
    if law.hum_deg > 0.0:
        turn = (
            2.0 * math.pi * law.hum_hz * t
            + random.uniform(0.0, 6.28)
            + 0.05 * np.cumsum(random.standard_normal(n)) * 0.1
        )
        wave = np.sin(turn) + 0.3 * np.sin(2.0 * turn + 0.6)
        total = total + math.sqrt(2.0 / 1.09) * law.hum_deg * wave
    if law.noise_deg > 0.0:
        white = random.uniform(-1.0, 1.0, n + 1)
        total = total + law.noise_deg * math.sqrt(3.0 / 1.25) * (white[1:] - 0.5 * white[:-1])
    return np.asarray(total)


def dropped(angle_deg: Array, law: ReadingLaw, random: Generator) -> Array:
    """Samples at which the contact was open: each run begins at a random one and falls to one value."""
    if law.dropout <= 0.0:
        return angle_deg
    starts = random.random(len(angle_deg)) < law.dropout / law.dropout_run
    lengths = random.geometric(1.0 / law.dropout_run, len(angle_deg))
    reading = angle_deg.copy()
    for k in np.flatnonzero(starts):
        reading[k : k + lengths[k]] = law.dropout_deg
    return reading


def noise_deg(n: int, period_s: float, random: Generator) -> Array:
    """What the reading of the angle always has: the frame's shaking and a little more, shape (n,)."""
    shake = _shaken(random.standard_normal(n), SHAKE_HZ, 0.06, period_s)
    return SHAKE_DEG * shake / max(float(np.std(shake)), 1e-9) + random.uniform(-1.0, 1.0, n) * ANGLE_NOISE_DEG * 1.7


def angle_reading(angle_rad: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """The recorded angle (deg), shape (n,), of the true one (rad)."""
    n = len(angle_rad)
    noise = noise_deg(n, period_s, random)
    angle = np.degrees(angle_rad)
    if law.play_deg > 0.0:
        angle = _geared(angle, law.play_deg, law.play_wave_deg)
    angle = moving_mean(bent(angle, law, session), law.window_s, period_s)
    angle = angle + session.angle_offset_deg + noise + added(n, law, period_s, random)
    if law.step_deg > COUNT_DEG:
        angle = _counted(angle, law.step_deg, law.step_hold)
    return dropped(np.asarray(np.floor(angle / COUNT_DEG + 0.5) * COUNT_DEG), law, random)


def monitor_reading(pressure_mpa: Array, bias_mpa: float, gain: float, period_s: float, random: Generator) -> Array:
    """The recorded pressure (gauge MPa): filter, the day's gain and bias, pink noise, 16 bits."""
    keep = math.exp(-period_s / MONITOR_FILTER_S)
    slow = one_pole((1.0 - keep) * pressure_mpa, keep, float(pressure_mpa[0]))
    noisy = gain * slow + bias_mpa + pink(len(slow), MONITOR_NOISE_MPA, period_s, random)
    return np.asarray(np.round(noisy / MONITOR_CODE_MPA) * MONITOR_CODE_MPA)


def readings(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """Pressures (MPa) and angle (deg) as recorded, shape (3, n), of the true ones (MPa, rad)."""
    return np.array([
        monitor_reading(motion[0], session.monitor_bias_1_mpa, session.monitor_gain_1, period_s, random),
        monitor_reading(motion[1], session.monitor_bias_2_mpa, session.monitor_gain_2, period_s, random),
        angle_reading(motion[2], law, session, period_s, random),
    ])  # fmt: skip
