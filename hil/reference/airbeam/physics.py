"""Parameters of the seventh family: nominal values, the spread between units, what days bring.

No equations here. Pressures are gauge MPa unless said. Days differ by the hall's heating, which is on or off, by how
damp the fabric is, and by wear, which has one direction; what is adjusted by hand is logistic about where it should be.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.random import Generator

from hil.reference.plant import PlantDay, varied

ATMOSPHERE_MPA: Final = 0.1013


class Physics(NamedTuple):
    """One healthy rig. +-0.2 MPa around 0.2 MPa turn the joint about +-40 degrees."""

    main_mpa: float = 0.62
    """Absolute pressure of the main."""
    gain_per_s: float = 19.0
    integral_s: float = 0.28
    """Flow (MPa/s) that the outer loop asks for per error of pressure, and its integral time."""
    weight: float = 0.85
    """Share of the set-point that acts on the proportional part."""
    sensor_s: float = 0.006
    """Of the sensor in the loop."""
    coil_s: float = 0.0025
    spool_s: float = 0.0035
    """Of the current in a force motor, and of the spool against its springs."""
    lap: float = 0.05
    lap_known: float = 0.85
    """Overlap of the spool at its null, against its stroke, and the share of it that the program steps over."""
    fill_mpa_s: float = 3.4
    exhaust_mpa_s: float = 2.9
    """Rates of pressure with a port fully open: from the main, choked; to the atmosphere from 0.3 MPa absolute."""
    ratio_2: float = 1.0
    outlet_share: float = 0.12
    """Volume between spool and line, where sensor and monitor sit, against a beam's at angle zero."""
    line_s: float = 0.0038
    """Within which a wave runs through the line: 1.3 m."""
    line_share: float = 0.25
    """Volume of the line."""
    line_drag: float = 0.030
    """Fall of pressure (MPa) at a flow of 1 MPa/s."""
    walls_s: float = 0.12
    """Within which the air takes the fabric's temperature, when they differ by 2 %."""
    dead_share: float = 0.08
    """Of a beam's volume at angle zero: fittings."""
    radius_m: float = 0.018
    pivot_m: float = 0.020
    """Radius of a beam, and how far its axis is from the hinge."""
    length_m: float = 0.24
    fold_rad: float = 1.17
    apart_rad: float = 0.01
    """By how much both beams are folded at angle zero, and how much more beam 2 is."""
    round_rad: float = 0.30
    """Fold up to which a beam bends all along before it kinks."""
    stretch_per_mpa: float = 0.15
    """Strain of the fabric's hoop per pressure."""
    strength_2: float = 1.0
    bush_nm_rad: float = 0.7
    bush_cube: float = 0.25
    """Stiffness of the hinge's rubber bush, and by which share it grows at one radian."""
    crease_nm: float = 0.5
    crease_nm_mpa: float = 6.5
    """Level of a crease's hysterons: without pressure, and per pressure."""
    crease_rad: float = 0.26
    crease_at_rad: float = 0.12
    """Scale of the folds at which they turn over, and how far from angle zero their middle lies."""
    creep: float = 0.05
    """Stiffness of what creeps, against the beams'."""
    bearing_nm: float = 0.07
    drag_nm_s: float = 0.10
    inertia_kgm2: float = 0.0045
    carriage_kgm2: float = 0.0035
    """What turns, and the carriage that a crank moves to and fro, as seen by the joint at angle zero."""
    once_deg: float = 0.0
    once_rad: float = 0.0
    """Error once per turn of a rotor off its centre, and its place."""
    twice_deg: float = 0.0
    twice_rad: float = 0.0
    """Error twice per turn of windings that are not alike."""
    tracking_hz: float = 42.0
    """Natural frequency of the converter's tracking."""


_UNIT_SPREAD: Final = {
    "main_mpa": 0.03, "gain_per_s": 0.12, "integral_s": 0.15, "weight": 0.05, "sensor_s": 0.2, "coil_s": 0.15,
    "spool_s": 0.15, "lap": 0.25, "lap_known": 0.06, "fill_mpa_s": 0.12, "exhaust_mpa_s": 0.12, "ratio_2": 0.06,
    "outlet_share": 0.2, "line_s": 0.08, "line_share": 0.1, "line_drag": 0.2, "walls_s": 0.2, "dead_share": 0.2,
    "radius_m": 0.012, "pivot_m": 0.015, "length_m": 0.01, "fold_rad": 0.012, "apart_rad": 0.5, "round_rad": 0.15,
    "stretch_per_mpa": 0.2, "strength_2": 0.01, "bush_nm_rad": 0.15, "bush_cube": 0.3, "crease_nm": 0.3,
    "crease_nm_mpa": 0.2, "crease_rad": 0.12, "crease_at_rad": 0.4, "creep": 0.3, "bearing_nm": 0.3, "drag_nm_s": 0.25,
    "inertia_kgm2": 0.15, "carriage_kgm2": 0.15, "tracking_hz": 0.1,
}  # fmt: skip
"""Relative standard deviation between rigs of the same build."""
_ONCE_DEG, _TWICE_DEG = 0.25, 0.08

_WARM: Final = {
    "bush_nm_rad": -0.8, "crease_nm": -1.2, "crease_nm_mpa": -0.8, "creep": 1.5, "bearing_nm": -1.0, "drag_nm_s": -2.5,
    "stretch_per_mpa": 1.2, "line_s": -0.2, "coil_s": -0.4, "spool_s": -0.8, "line_drag": 0.4,
}  # fmt: skip
"""By how many drifts a parameter moves on a day that is one drift warmer."""
_DAMP: Final = {
    "stretch_per_mpa": 1.5, "crease_nm": -1.0, "crease_nm_mpa": -0.6, "crease_rad": 0.4, "creep": 1.5, "radius_m": 0.08,
}  # fmt: skip
"""The same of fabric that has taken up water (polyamide softens)."""
_WORN: Final = {
    "crease_nm": -1.0, "crease_nm_mpa": -0.5, "round_rad": 1.0, "lap": -0.8, "bearing_nm": 0.8, "pivot_m": 0.05,
}  # fmt: skip
"""The same after more wear."""
_BY_HAND: Final = {
    "main_mpa": 0.8, "fold_rad": 0.15, "apart_rad": 5.0, "pivot_m": 0.08, "strength_2": 0.1, "lap_known": 0.4,
    "crease_nm_mpa": 0.4, "crease_at_rad": 2.0, "bush_nm_rad": 0.5,
}  # fmt: skip
"""By how many drifts it moves by itself: how the beams were laced, how the hinge was clamped, the main."""


def draw_unit(random: Generator) -> Physics:
    """Another rig of the same build."""
    values = varied(Physics()._asdict(), _UNIT_SPREAD, random)
    values |= dict(zip(("once_rad", "twice_rad"), random.uniform(0.0, 2.0 * math.pi, 2).tolist(), strict=True))
    values["once_deg"], values["twice_deg"] = (size * float(random.rayleigh()) for size in (_ONCE_DEG, _TWICE_DEG))
    return Physics(**values)


def draw_session(physics: Physics, drift: float, random: Generator) -> PlantDay:
    """One day. `drift`: relative standard deviation of what drifts by itself, 0.004 to 0.02."""
    scale, values = (drift / 0.004) ** 0.5, physics._asdict()
    warmer = 0.9 * float(random.choice((-1.0, 1.0))) + 0.44 * float(random.standard_normal())
    damper = float(np.clip(random.standard_normal(), -2.5, 2.5))
    worn = min(2.5, abs(float(random.standard_normal()))) - 0.8
    for step, weights in ((warmer, _WARM), (damper, _DAMP), (worn, _WORN)):
        for name, weight in weights.items():
            values[name] *= math.exp(weight * drift * step)
    for name, weight in _BY_HAND.items():
        values[name] *= math.exp(weight * drift * _logistic(random))
    zero_1, zero_2, gain_1, gain_2, offset, gain = (_logistic(random) for _ in range(6))
    return PlantDay(
        Physics(**values), 0.0005 * scale * (zero_1 + 0.5 * warmer), 0.0005 * scale * (zero_2 + 0.5 * warmer),
        1.0 + 0.0011 * scale * gain_1, 1.0 + 0.0011 * scale * gain_2, 0.085 * scale * offset,
        1.0 + 0.0011 * scale * gain, warm=float(random.uniform(0.0, 0.4)), seed=int(random.integers(2**31)),
    )  # fmt: skip


def _logistic(random: Generator) -> float:
    """Of unit standard deviation, at most 3."""
    return float(np.clip(random.logistic(0.0, 3.0**0.5 / math.pi), -3.0, 3.0))
