"""How the joint's angle and the pressures become readings: coupling, potentiometer, filter, converter, noise."""

import math
from typing import Final

import numpy as np
from numpy.random import Generator

from hil.reference.compiling import Array, compiled
from hil.reference.mckibben.disturbance import ReadingLaw
from hil.reference.noise import coloured, one_pole
from hil.reference.plant import PlantDay

CODE_DEG: Final = 345.0 / 4096
"""WDD35D8 over 345 degrees on a 12-bit converter."""
MONITOR_CODE_MPA: Final = 0.5 / 4096 * 5.0 / 4.0
"""1-5 V for 0-0.5 MPa on a 12-bit converter of 0-5 V."""
ANGLE_NOISE_DEG: Final = 0.05
MONITOR_NOISE_MPA: Final = 0.0006
REFERENCE_DEG: Final = 40.0


@compiled
def coupled(angle_deg: Array, play_deg: float, spread: float, period_s: float) -> Array:
    """A coupling with clearance: the sensor's shaft rests until the tooth touches and is then pulled along within 2 ms.

    The clearance is wider by `spread` at zero, where the teeth are worn.
    """
    out = np.empty_like(angle_deg)
    follower = angle_deg[0]
    pull = 1.0 - math.exp(-period_s / 0.002)
    for k in range(len(angle_deg)):
        half = 0.5 * play_deg * (1.0 + spread * (math.exp(-((angle_deg[k] / 15.0) ** 2)) - 0.5))
        gap = angle_deg[k] - follower
        if gap > half:
            follower += pull * (gap - half)
        elif gap < -half:
            follower += pull * (gap + half)
        out[k] = follower
    return out


@compiled
def dead_spot(angle_deg: Array, low_deg: float, high_deg: float) -> Array:
    """Between `low_deg` and `high_deg` the wiper does not touch: the last reading stands."""
    out = angle_deg.copy()
    for k in range(1, len(out)):
        if low_deg < angle_deg[k] < high_deg:
            out[k] = out[k - 1]
    return out


def bent(angle_deg: Array, law: ReadingLaw, session: PlantDay) -> Array:
    """The static line of the potentiometer: its own curvature, gain error with its bend, eccentric disc."""
    x = angle_deg / REFERENCE_DEG
    reading = angle_deg * (1.0 + session.physics.pot_square * x + session.physics.pot_cube * x * x)
    reading = reading * session.angle_gain * (1.0 + law.gain * (1.0 + law.gain_bend * (x * x - 0.5)))
    if law.bend_deg != 0.0:
        wave = np.sin(2.0 * np.radians(angle_deg) + law.bend_rad) - math.sin(law.bend_rad)
        reading = reading + law.bend_deg * (wave - 2.0 * np.radians(angle_deg) * math.cos(law.bend_rad) * 0.5)
    return np.asarray(reading)


def low_passed(angle_deg: Array, law: ReadingLaw, period_s: float) -> Array:
    """Equal first-order poles in series whose time constants sum to `lag_s`, each exact for a held input."""
    poles = max(1, int(law.lag_poles))
    if law.lag_s <= 0.0:
        return angle_deg
    keep = math.exp(-period_s * poles / law.lag_s)
    for _ in range(poles):
        angle_deg = one_pole(angle_deg * (1.0 - keep), keep, float(angle_deg[0]))
    return angle_deg


def disturbed(angle_deg: Array, law: ReadingLaw, period_s: float, random: Generator) -> Array:
    """Offset, drift, slip, hum and extra noise on top of the reading."""
    n = len(angle_deg)
    t = np.arange(n) * period_s
    reading = angle_deg + law.offset_deg + law.drift_deg * (1.0 - np.exp(-t / law.drift_s))
    reading = reading + law.slip_deg * (t >= law.slip_at * t[-1])
    if law.hum_deg > 0.0:
        phase, swell = random.uniform(0.0, 2.0 * math.pi, 2)
        turn = 2.0 * math.pi * law.hum_hz * (1.0 + 2e-4 * random.standard_normal()) * t + phase
        wave = np.sin(turn) + 0.2 * np.sin(3.0 * turn + 1.0)
        reading = reading + math.sqrt(2.0) * law.hum_deg * wave * (1.0 + 0.2 * np.sin(2.0 * math.pi * 0.11 * t + swell))
    if law.noise_deg > 0.0:
        speed = np.abs(np.gradient(angle_deg, period_s))
        heavy = random.standard_t(4, n) / math.sqrt(2.0)
        reading = reading + law.noise_deg * heavy * (0.7 + 0.6 * speed / (speed + 40.0))
    return np.asarray(reading)


def converted(angle_deg: Array, law: ReadingLaw) -> Array:
    """Codes of an uneven converter: equal values a code apart, thresholds off by `step_uneven` of a code."""
    code = law.step_deg if law.step_deg > CODE_DEG else CODE_DEG
    position = angle_deg / code
    if law.step_deg > CODE_DEG:
        position = position + law.step_uneven * np.sin(2.4 * np.floor(position) + 0.4)
    return np.asarray(np.round(position) * code)


@compiled
def _fallen(chance: Array, enter: float, leave: float) -> Array:
    """How far the reading has fallen, 0 to 1: a two-state chain (Gilbert), and half of the way back with each sample
    after it."""
    out = np.zeros_like(chance)
    lifted = False
    for k in range(1, len(chance)):
        lifted = chance[k] >= leave if lifted else chance[k] < enter
        left = 0.5 * out[k - 1]
        out[k] = 1.0 if lifted else left if left > 0.2 else 0.0
    return out


def dropped(angle_deg: Array, law: ReadingLaw, random: Generator) -> Array:
    """Samples at which the wiper lifts and the filter behind it recovers."""
    if law.dropout <= 0.0:
        return angle_deg
    leave = 1.0 / law.dropout_run
    fallen = _fallen(random.random(len(angle_deg)), leave * law.dropout / (1.0 - law.dropout), leave)
    return np.asarray(angle_deg + fallen * (law.dropout_deg - angle_deg))


def noise_deg(n: int, period_s: float, random: Generator) -> Array:
    """What the reading of the angle always has: white and slower noise, shape (n,)."""
    return random.standard_normal(n) * ANGLE_NOISE_DEG + coloured(n, 0.4 * ANGLE_NOISE_DEG, 0.08, period_s, random)


def angle_reading(angle_rad: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """The recorded angle (deg), shape (n,), of the true one (rad)."""
    angle = np.degrees(angle_rad)
    noise = noise_deg(len(angle), period_s, random)
    if law.play_deg > 0.0:
        angle = coupled(angle, law.play_deg, law.play_spread, period_s)
    angle = bent(angle, law, session) + session.angle_offset_deg
    if law.dead_high_deg > law.dead_low_deg:
        angle = dead_spot(angle, law.dead_low_deg, law.dead_high_deg)
    angle = disturbed(low_passed(angle, law, period_s), law, period_s, random)
    return converted(dropped(angle + noise, law, random), law)


def monitor_reading(pressure_mpa: Array, bias_mpa: float, period_s: float, random: Generator) -> Array:
    """The recorded pressure (gauge MPa): bias of the day, coloured and white noise, 12 bits."""
    n = len(pressure_mpa)
    noise = coloured(n, 0.5 * MONITOR_NOISE_MPA, 0.03, period_s, random) + random.standard_normal(n) * MONITOR_NOISE_MPA
    return np.asarray(np.round((pressure_mpa + bias_mpa + noise) / MONITOR_CODE_MPA) * MONITOR_CODE_MPA)


def readings(motion: Array, law: ReadingLaw, session: PlantDay, period_s: float, random: Generator) -> Array:
    """Pressures (MPa) and angle (deg) as recorded, shape (3, n), of the true ones (MPa, rad)."""
    return np.array([
        monitor_reading(motion[0], session.monitor_bias_1_mpa, period_s, random),
        monitor_reading(motion[1], session.monitor_bias_2_mpa, period_s, random),
        angle_reading(motion[2], law, session, period_s, random),
    ])  # fmt: skip
