"""Parameters of the ninth family: nominal values, the spread between units, what days bring.

No equations here. Pressures are gauge MPa unless said. Days differ by the sun on the film (uniform over how much of the
morning has gone, and on some days there is none), and by the logarithm of how long the creases have aged since they
were last pressed flat; what moves by itself has Gumbel's law, whose one tail is longer than the other.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.random import Generator

from hil.reference.plant import PlantDay, varied

ATMOSPHERE_MPA: Final = 0.1013


class Physics(NamedTuple):
    """One healthy rig. +-0.2 MPa around 0.2 MPa turn the joint about +-36 degrees."""

    main_mpa: float = 0.66
    """Absolute pressure of the main."""
    gain_per_s: float = 19.5
    """Rate of pressure that a program asks for per error."""
    zone_mpa: float = 0.0007
    """Error within which a bank stays shut."""
    open_s: float = 0.0012
    close_s: float = 0.0009
    """Within which valves open and shut."""
    sensor_s: float = 0.003
    zero_1_mpa: float = 0.0
    zero_2_mpa: float = 0.0
    span_1: float = 0.0
    span_2: float = 0.0
    """Errors of the sensors in the loops."""
    feed_mpa_s: float = 3.6
    vent_mpa_s: float = 3.2
    """Rates of pressure with a bank all open: from the main, choked; to the atmosphere from 0.3 MPa absolute."""
    ratio_2: float = 1.0
    known_feed: float = 1.0
    known_vent: float = 1.0
    """What the program takes these rates for, against them."""
    outlet_share: float = 0.13
    """Volume between bank and tube, where sensor and monitor sit, against a muscle's at angle zero."""
    tube_mpa: float = 0.014
    """What the tube takes at a flow of 1 MPa/s."""
    walls_s: float = 0.20
    jet: float = 2.5
    """Within which air at rest takes the film's temperature, and by how much quicker at an inflow of 1 MPa/s."""
    dead_share: float = 0.25
    pouches: float = 14.0
    pouch_m: float = 0.025
    """Length of a pouch's film between two welds."""
    width_m: float = 0.042
    ends: float = 0.45
    """Width of a pouch, and by which share of its height its side seams draw in."""
    short: float = 0.10
    """By which share a row is shorter than its film at angle zero."""
    apart_m: float = 0.0005
    """By how much muscle 2 is longer than 1 at angle zero."""
    film_n_m: float = 210e3
    """Force per width and strain of the film."""
    strength_2: float = 1.0
    delayed: float = 0.10
    delayed_s: float = 4.0
    """Delayed strain of the film against the one at once, and its time."""
    crease_nm: float = 0.007
    crease_nm_mpa: float = 0.040
    """Moment at which the creases of a pouch's side seams begin to give, without pressure and per pressure."""
    crease_rad: float = 0.008
    """Angle at which they begin to."""
    crease_more: float = 0.9
    crease_fades_rad: float = 0.05
    """By how much of that moment they harden, and within which path."""
    arm_m: float = 0.0245
    eyelet_m: float = 0.004
    """How far the eyelets stand off the middle line, and below the middle of a roll."""
    roll_m: float = 0.030
    link_m: float = 0.060
    link_kg: float = 0.28
    inertia_kgm2: float = 0.0036
    """Radius of a roll; place and mass of the link's centre, and what turns about it."""
    cord_n: float = 20.0
    cord_stretch: float = 1.7
    """Modulus times section of a rubber cord, and its stretch at angle zero."""
    bearing_nm: float = 0.045
    drag_nm_s: float = 0.08
    bow_deg: float = 0.0
    tilt_deg: float = 0.0
    """Deviations of the detector at 40 degrees: by its edges, and by how it stands."""


_UNIT_SPREAD: Final = {
    "main_mpa": 0.03, "gain_per_s": 0.05, "zone_mpa": 0.15, "open_s": 0.2, "close_s": 0.2, "sensor_s": 0.2,
    "feed_mpa_s": 0.08, "vent_mpa_s": 0.08, "ratio_2": 0.05, "known_feed": 0.03, "known_vent": 0.03,
    "outlet_share": 0.15, "tube_mpa": 0.2, "walls_s": 0.2, "jet": 0.2, "dead_share": 0.12, "pouch_m": 0.006,
    "width_m": 0.015, "ends": 0.07, "short": 0.02, "apart_m": 0.6, "film_n_m": 0.06, "strength_2": 0.01,
    "delayed": 0.3, "delayed_s": 0.3, "crease_nm": 0.3, "crease_nm_mpa": 0.2, "crease_rad": 0.2, "crease_more": 0.15,
    "crease_fades_rad": 0.2, "arm_m": 0.012, "eyelet_m": 0.15, "roll_m": 0.02, "link_m": 0.1, "link_kg": 0.1,
    "inertia_kgm2": 0.15, "cord_n": 0.08, "cord_stretch": 0.03, "bearing_nm": 0.3, "drag_nm_s": 0.25,
}  # fmt: skip
"""Relative standard deviation between rigs of the same build."""
_BOW_DEG, _TILT_DEG = 0.25, 0.20
_ZERO_MPA, _SPAN = 0.0004, 0.0015

_SUN: Final = {
    "film_n_m": -1.5, "delayed": 1.8, "delayed_s": -1.0, "crease_nm": -1.0, "crease_nm_mpa": -0.6, "cord_n": -0.3,
    "bearing_nm": -0.7, "drag_nm_s": -2.0, "open_s": 0.5, "close_s": 0.5, "tube_mpa": 0.4,
}  # fmt: skip
"""By how many drifts a parameter moves on a day with one drift more of sun."""
_AGED: Final = {
    "crease_nm": 1.8, "crease_nm_mpa": 0.8, "crease_rad": -0.8, "crease_more": 0.6, "short": -0.1, "delayed": -0.8,
}  # fmt: skip
"""The same of creases that have aged by one more (Jules, Lechenault and Adda-Bedia 2020)."""
_BY_ITSELF: Final = {
    "main_mpa": 0.8, "apart_m": 8.0, "short": 0.3, "ends": 2.5, "film_n_m": 0.6, "strength_2": 0.3, "arm_m": 0.2,
    "eyelet_m": 5.0, "cord_n": 0.8, "cord_stretch": 0.2, "crease_nm_mpa": 1.0, "gain_per_s": 0.5, "known_feed": 0.4,
    "known_vent": 0.4,
}  # fmt: skip
"""By how many drifts it moves by itself: how the rows were hung and the cords hooked, the main."""


def draw_unit(random: Generator) -> Physics:
    """Another rig of the same build."""
    values = varied(Physics()._asdict(), _UNIT_SPREAD, random)
    for name, size in (("bow_deg", _BOW_DEG), ("tilt_deg", _TILT_DEG)):
        values[name] = size * float(random.uniform(-1.5, 1.5))
    for valve in (1, 2):
        values[f"zero_{valve}_mpa"] = _ZERO_MPA * float(random.uniform(-1.5, 1.5))
        values[f"span_{valve}"] = _SPAN * float(random.uniform(-1.5, 1.5))
    return Physics(**values)


def draw_session(physics: Physics, drift: float, random: Generator) -> PlantDay:
    """One day. `drift`: relative standard deviation of what drifts by itself, 0.004 to 0.02."""
    scale, values = (drift / 0.004) ** 0.5, physics._asdict()
    clear, risen = float(random.random()) < 0.6, float(random.uniform(0.0, 1.0))
    sun = ((risen if clear else 0.0) - 0.3) / 0.34
    aged = (math.log(float(random.uniform(0.5, 60.0))) - 3.0) / 0.95
    for step, weights in ((sun, _SUN), (aged, _AGED)):
        for name, weight in weights.items():
            values[name] *= math.exp(weight * drift * step)
    for name, weight in _BY_ITSELF.items():
        values[name] *= math.exp(weight * drift * _gumbel(random))
    for valve in (1, 2):
        values[f"zero_{valve}_mpa"] += 0.0002 * scale * (_gumbel(random) + sun)
    zero_1, zero_2, gain_1, gain_2, offset, gain = (_gumbel(random) for _ in range(6))
    return PlantDay(
        Physics(**values), 0.0005 * scale * (zero_1 + 0.4 * sun), 0.0005 * scale * (zero_2 + 0.4 * sun),
        1.0 + 0.0011 * scale * gain_1, 1.0 + 0.0011 * scale * gain_2, 0.09 * scale * offset,
        1.0 + 0.0011 * scale * gain, warm=float(random.uniform(0.0, 0.4)), seed=int(random.integers(2**31)),
    )  # fmt: skip


def _gumbel(random: Generator) -> float:
    """Of mean zero and unit standard deviation, at most 3."""
    return float(np.clip((random.gumbel() - 0.5772) * math.sqrt(6.0) / math.pi, -3.0, 3.0))
