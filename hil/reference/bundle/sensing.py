"""How angle and pressures become readings in the fifth family: a rotary transformer, a sigma-delta converter behind
three means, monitors that share a reference."""

import math
from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.bundle.disturbance import ReadingLaw
from hil.reference.bundle.physics import Physics
from hil.reference.compiling import Array, compiled
from hil.reference.noise import coloured
from hil.reference.plant import PlantDay
from hil.reference.play import dragged

CODE_DEG: Final = 120.0 / 65_536
ANGLE_NOISE_DEG: Final = 0.04
POPCORN_DEG: Final = 0.018
POPCORN_S: Final = 0.7
"""An amplifier's offset jumps to and fro, and for so long it stays."""
MONITOR_CODE_MPA: Final = 0.5 / 8192 * 5.0 / 4.0
"""1 to 5 V for 0 to 0.5 MPa on a 13-bit converter of 0 to 5 V."""
MONITOR_NOISE_MPA: Final = 0.0004
REFERENCE_NOISE: Final = 0.0012
"""Of the reference that both monitors share, relative to the reading."""
REFERENCE_S: Final = 0.02
MEANS: Final = 3
MEAN_POINTS: Final = 64
REFERENCE_DEG: Final = 40.0
LINEAR_SQUARE: Final = 0.3
"""Square of the angle, in reference angles, by which a transformer's range is half left."""
TEETH: Final = (-1.0, -0.4, 0.4, 1.0)
"""Clearances of a spline's teeth, as offsets from the mean."""
HEATER_SHARE: Final = 0.5
OPEN_KEEPS: Final = 0.4
"""Share of its distance that an open input keeps from sample to sample."""


@compiled
def _tracked(angle_deg: Array, most_deg: float) -> Array:
    """A reading that changes by `most_deg` a sample at most."""
    out = np.empty_like(angle_deg)
    place = angle_deg[0]
    for k in range(len(angle_deg)):
        place += max(-most_deg, min(most_deg, angle_deg[k] - place))
        out[k] = place
    return out


def splined(angle_deg: Array, law: ReadingLaw) -> Array:
    """A worn spline: its teeth touch one after another, each carries its share."""
    halves = [0.5 * law.play_deg * (1.0 + law.play_spread * tooth) for tooth in TEETH]
    return np.asarray(np.mean([dragged(angle_deg, half) for half in halves], axis=0))


def mean_weights(window_s: float, period_s: float) -> Array:
    """Weights of the newest and of older samples in the mean of a window over a polygon of samples; their mean age is
    half of the window."""
    age = (np.arange(MEAN_POINTS) + 0.5) / MEAN_POINTS * window_s / period_s
    whole = np.floor(age).astype(int)
    newer = np.bincount(whole, 1.0 - (age - whole), minlength=int(whole[-1]) + 2)
    return np.asarray((newer + np.bincount(whole + 1, age - whole)) / MEAN_POINTS)


def three_means(angle_deg: Array, window_s: float, period_s: float) -> Array:
    """Three equal means in series, at rest before the record."""
    for _ in range(MEANS):
        weights = mean_weights(window_s, period_s)
        before = np.full(len(weights) - 1, angle_deg[0])
        angle_deg = np.convolve(np.concatenate([before, angle_deg]), weights, mode="valid")
    return np.asarray(angle_deg)


def transformer(angle_deg: Array, physics: Physics) -> Array:
    """The healthy transformer's line: odd about its null, without the slope there."""
    x = angle_deg / REFERENCE_DEG
    return np.asarray(angle_deg + physics.cube_deg * x**3 + physics.fifth_deg * x**5)


def beyond_range(angle_deg: Array, null_deg: float) -> Array:
    """Shape of a range that is left, about its middle: the sensitivity goes over to another one. Zero and level at
    zero, 1 at that end of +-40 degrees where it is more."""

    def line(deg: Array) -> Array:
        x = (deg - null_deg) / REFERENCE_DEG
        return np.asarray(x**3 / (LINEAR_SQUARE + x**2))

    def level(deg: Array) -> Array:
        low, here, high = line(np.array([-0.01, 0.0, 0.01])).tolist()
        return np.asarray(line(deg) - here - (high - low) / 0.02 * deg)

    return np.asarray(level(angle_deg) / np.abs(level(np.array([-REFERENCE_DEG, REFERENCE_DEG]))).max())


def bent(angle_deg: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """The line from angle to reading: the transformer's own, the day's gain, a carrier that breathes or beats, a range
    that is left."""
    t, (breath, beat) = np.arange(len(angle_deg)) * period_s, random.uniform(0.0, 2.0 * math.pi, 2)
    reading = session.angle_gain * transformer(angle_deg, session.physics)
    breathing = 1.0 + law.gain_breath * np.sin(2.0 * math.pi * t / law.gain_turn_s + breath)
    beating = law.beat_deg / REFERENCE_DEG * np.sin(2.0 * math.pi * law.beat_hz * t + beat)
    return np.asarray(
        reading * (1.0 + law.gain * breathing + beating) + law.bend_deg * beyond_range(angle_deg, law.bend_null_deg)
    )


def noise_deg(n: int, physics: Physics, period_s: float, random: Generator) -> Array:
    """What the reading of the angle always has: white noise, an offset that jumps, a slow beat, shape (n,)."""
    jumps = np.cumsum(random.random(n) < period_s / POPCORN_S) + random.integers(2)
    beat = np.sin(2.0 * math.pi * physics.ripple_hz * np.arange(n) * period_s + random.uniform(0.0, 6.283))
    return np.asarray(
        ANGLE_NOISE_DEG * random.standard_normal(n) + POPCORN_DEG * (jumps % 2 - 0.5) + physics.ripple_deg * beat
    )


def walked_deg(angle_deg: Array, law: ReadingLaw, period_s: float) -> Array:
    """A shaft that walks in its clamp with every turn to and fro; evenly when nothing moves."""
    turned = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(angle_deg)) + 1e-3)])
    return np.asarray(law.drift_deg_min / 60.0 * len(angle_deg) * period_s * turned / turned[-1])


def heater_hum(n: int, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Hum while a heater is on, for half of the time; its root mean square over all is `hum_deg`."""
    t, turn, begun = np.arange(n) * period_s, *random.uniform(0.0, 1.0, 2)
    on = (t / law.hum_every_s + begun) % 1.0 < HEATER_SHARE
    hz = law.hum_hz * (1.0 + 1e-4 * random.standard_normal())
    return np.asarray(math.sqrt(2.0 / HEATER_SHARE) * law.hum_deg * on * np.sin(2.0 * math.pi * (hz * t + turn)))


def added(angle_deg: Array, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Offset, drift, hum and more noise, shape (n,)."""
    n = len(angle_deg)
    total = law.offset_deg + walked_deg(angle_deg, law, period_s)
    if law.hum_deg > 0.0:
        total = total + heater_hum(n, law, period_s, random)
    if law.noise_deg > 0.0:
        power = angle_deg**2 / max(1.0, float(np.mean(angle_deg**2)))
        total = total + law.noise_deg * np.sqrt(0.3 + 0.7 * power) * random.standard_normal(n)
    return np.asarray(total)


def coded(angle_deg: Array, law: ReadingLaw) -> Array:
    """The converter's codes, or coarser ones that a program has cut off towards zero."""
    fine = np.round(angle_deg / CODE_DEG) * CODE_DEG
    return np.asarray(np.trunc(fine / law.step_deg) * law.step_deg if law.step_deg > CODE_DEG else fine)


def dropped(angle_deg: Array, law: ReadingLaw, random: Generator) -> Array:
    """Samples at which a bent cable breaks contact, more often towards one end; the open input runs away."""
    if law.dropout <= 0.0:
        return angle_deg
    often = np.clip(1.0 + angle_deg / REFERENCE_DEG, 0.1, 1.9)
    chance = law.dropout / law.dropout_run * often / float(np.mean(often))
    starts = np.flatnonzero(random.random(len(angle_deg)) < chance)
    reading = angle_deg.copy()
    for k, length in zip(starts, random.geometric(1.0 / law.dropout_run, len(starts)), strict=True):
        kept = OPEN_KEEPS ** np.arange(1, len(reading[k : k + length]) + 1)
        reading[k : k + length] = law.dropout_deg + kept * (angle_deg[k] - law.dropout_deg)
    return reading


def angle_reading(angle_rad: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """The recorded angle (deg), shape (n,), of the true one (rad)."""
    angle, physics = np.degrees(angle_rad), session.physics
    noise = noise_deg(len(angle), physics, period_s, random)
    if law.play_deg > 0.0:
        angle = splined(angle, law)
    angle = three_means(bent(angle, law, session, period_s, random), physics.converter_s, period_s)
    if law.lag_s > 0.0:
        angle = three_means(angle, 2.0 * law.lag_s / MEANS, period_s)
    if law.slew_deg_s > 0.0:
        angle = _tracked(angle, law.slew_deg_s * period_s)
    angle = angle + session.angle_offset_deg + noise + added(angle, law, period_s, random)
    return dropped(coded(angle, law), law, random)


def monitor_reading(pressure_mpa: Array, bias_mpa: float, gain: float, shared: Array, random: Generator) -> Array:
    """The recorded pressure (gauge MPa): the day's gain and bias, white noise and the reference's, 13 bits."""
    noise = MONITOR_NOISE_MPA * random.standard_normal(len(pressure_mpa))
    reading = gain * pressure_mpa * (1.0 + shared) + bias_mpa + noise
    return np.asarray(np.round(reading / MONITOR_CODE_MPA) * MONITOR_CODE_MPA)


def readings(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """Pressures (MPa) and angle (deg) as recorded, shape (3, n), of the true ones (MPa, rad)."""
    shared = coloured(motion.shape[1], REFERENCE_NOISE, REFERENCE_S, period_s, random)
    return np.array([
        monitor_reading(motion[0], session.monitor_bias_1_mpa, session.monitor_gain_1, shared, random),
        monitor_reading(motion[1], session.monitor_bias_2_mpa, session.monitor_gain_2, shared, random),
        angle_reading(motion[2], law, session, period_s, random),
    ])  # fmt: skip
