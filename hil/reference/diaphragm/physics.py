"""Parameters of the eighth family: nominal values, the spread between units, what days bring.

No equations here. Pressures are gauge MPa unless said. Days differ by the room's warmth, whose warm days are rarer and
further off than its cool ones (a beta law), and by for how long the rig was parked (exponential), in which rubber takes
a set; what moves by itself has Student's law of five degrees of freedom.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.random import Generator

from hil.reference.plant import PlantDay, varied

ATMOSPHERE_MPA: Final = 0.1013


class Physics(NamedTuple):
    """One healthy rig. +-0.2 MPa around 0.2 MPa turn the joint about +-37 degrees."""

    main_mpa: float = 0.65
    """Absolute pressure of the main."""
    duty_per_mpa: float = 10.0
    """Share of a cycle for which a solenoid is asked to be open, per error of pressure."""
    numb_mpa: float = 0.0009
    """Error that the program takes for none: sensitivity, 0.2 % of 0.5 MPa."""
    shortest_s: float = 0.0006
    """Shortest pulse; less is saved up."""
    solenoid_s: float = 0.0014
    pilot_mpa_s: float = 2.1
    vent_mpa_s: float = 1.9
    """Rates of the dome's pressure: from the main, choked; to the atmosphere from 0.3 MPa absolute."""
    sensor_s: float = 0.004
    zero_1_mpa: float = 0.0
    zero_2_mpa: float = 0.0
    span_1: float = 0.0
    span_2: float = 0.0
    """Errors of the sensors in the loops."""
    lift_mpa: float = 0.035
    """Excess of the dome's pressure over the outlet's that lifts a poppet all the way."""
    seat_mpa: float = 0.0004
    ring_mpa: float = 0.0006
    """Excess that neither poppet opens at; half of the play that the stem's O-ring leaves by its friction."""
    feed_mpa_s: float = 3.4
    relief_mpa_s: float = 3.1
    """Rates of pressure with a poppet all open, if its body were none: from the main, choked; from 0.3 MPa absolute."""
    body: float = 1.5
    """Conductance of a body against that of its poppet's curtain."""
    ratio_2: float = 1.0
    outlet_share: float = 0.15
    """Volume between booster and tube, where sensor and monitor sit, against a cylinder's at angle zero."""
    laminar_mpa2_s: float = 0.006
    turbulent_mpa2_s: float = 0.004
    """What the tube takes of the square of pressure (MPa^2) at a flow of 1 MPa/s."""
    walls_s: float = 0.25
    """Within which the air's temperature goes back to the walls'."""
    dead_share: float = 0.15
    diameter_m: float = 0.040
    taper: float = 0.27
    """Effective diameter of a diaphragm in the middle of its stroke, and what it loses per stroke out."""
    middle_m: float = 0.045
    """Length of a cylinder's air in the middle, at that diameter."""
    swell_per_mpa: float = 0.10
    """By which share the convolution widens the effective area per pressure."""
    strength_2: float = 1.0
    arm_m: float = 0.028
    """Distance of the shaft from the yoke's line."""
    cant_rad: float = 0.05
    """Angle of the lever to the line's normal at angle zero."""
    apart_m: float = 0.0004
    """By how much cylinder 2 is further out than 1 at angle zero."""
    spring_nm_rad: float = 5.0
    spring_cube: float = 0.2
    """Stiffness of the torsion spring on the shaft, and by which share it grows at one radian."""
    lobe_n: float = 1.2
    lobe_n_mpa: float = 10.0
    lobe_m: float = 0.0012
    """Level of the force by which a diaphragm resists rolling, without pressure and per pressure; its middle length."""
    rubber: float = 0.05
    rubber_order: float = 0.22
    """What the rubber holds after a second against the rig's stiffness, and the order of its fractional derivative."""
    slot: float = 0.06
    """Coefficient of friction of the pin in its slot."""
    bearing_nm: float = 0.05
    drag_nm_s: float = 0.09
    inertia_kgm2: float = 0.0040
    yoke_kg: float = 0.55
    """What turns, and the yoke with its pistons."""
    track_1_deg: float = 0.0
    track_1_rad: float = 0.0
    track_2_deg: float = 0.0
    track_2_rad: float = 0.0
    track_3_deg: float = 0.0
    track_3_rad: float = 0.0
    """Waves of the track's conformity, the longest first."""
    filter_s: float = 0.002
    """Of the wiper's resistance with the capacitor behind it."""


_UNIT_SPREAD: Final = {
    "main_mpa": 0.03, "duty_per_mpa": 0.10, "numb_mpa": 0.15, "shortest_s": 0.15, "solenoid_s": 0.2,
    "pilot_mpa_s": 0.10, "vent_mpa_s": 0.10, "sensor_s": 0.2, "lift_mpa": 0.15, "seat_mpa": 0.3, "ring_mpa": 0.3,
    "feed_mpa_s": 0.12, "relief_mpa_s": 0.12, "body": 0.15, "ratio_2": 0.06, "outlet_share": 0.2,
    "laminar_mpa2_s": 0.2, "turbulent_mpa2_s": 0.2, "walls_s": 0.2, "dead_share": 0.2, "diameter_m": 0.012,
    "taper": 0.05, "middle_m": 0.02, "swell_per_mpa": 0.25, "strength_2": 0.01, "arm_m": 0.02, "cant_rad": 0.3,
    "apart_m": 0.6, "spring_nm_rad": 0.07, "spring_cube": 0.3, "lobe_n": 0.3, "lobe_n_mpa": 0.2, "lobe_m": 0.2,
    "rubber": 0.3, "rubber_order": 0.1, "slot": 0.3, "bearing_nm": 0.3, "drag_nm_s": 0.25, "inertia_kgm2": 0.15,
    "yoke_kg": 0.1, "filter_s": 0.2,
}  # fmt: skip
"""Relative standard deviation between rigs of the same build."""
_TRACK_DEG: Final = (0.22, 0.10, 0.05)
_ZERO_MPA, _SPAN = 0.0004, 0.0015

_WARM: Final = {
    "rubber": 1.5, "lobe_n": -1.2, "lobe_n_mpa": -0.7, "spring_nm_rad": -0.25, "bearing_nm": -0.8, "drag_nm_s": -2.5,
    "ring_mpa": -1.5, "solenoid_s": 0.8, "pilot_mpa_s": -0.4, "vent_mpa_s": -0.4, "swell_per_mpa": 1.5,
    "laminar_mpa2_s": 0.5, "diameter_m": 0.03,
}  # fmt: skip
"""By how many drifts a parameter moves on a day that is one drift warmer."""
_PARKED: Final = {
    "lobe_n": 2.0, "lobe_n_mpa": 0.6, "lobe_m": 1.0, "rubber": -1.5, "ring_mpa": 2.5, "slot": 1.5, "bearing_nm": 1.5,
}  # fmt: skip
"""The same after a longer rest."""
_BY_ITSELF: Final = {
    "main_mpa": 0.8, "apart_m": 5.0, "diameter_m": 0.05, "taper": 0.3, "strength_2": 0.1, "arm_m": 0.05,
    "cant_rad": 2.0, "lobe_n_mpa": 0.5, "spring_nm_rad": 0.3, "duty_per_mpa": 0.4, "slot": 1.0, "yoke_kg": 0.1,
}  # fmt: skip
"""By how many drifts it moves by itself: how the diaphragms lie, how the housings were bolted on, the main."""


def draw_unit(random: Generator) -> Physics:
    """Another rig of the same build."""
    values = varied(Physics()._asdict(), _UNIT_SPREAD, random)
    for wave, size_deg in enumerate(_TRACK_DEG, 1):
        values[f"track_{wave}_deg"] = size_deg * float(random.rayleigh())
        values[f"track_{wave}_rad"] = float(random.uniform(0.0, 2.0 * math.pi))
    for valve in (1, 2):
        values[f"zero_{valve}_mpa"] = _ZERO_MPA * float(np.clip(random.standard_normal(), -2.0, 2.0))
        values[f"span_{valve}"] = _SPAN * float(np.clip(random.standard_normal(), -2.0, 2.0))
    return Physics(**values)


def draw_session(physics: Physics, drift: float, random: Generator) -> PlantDay:
    """One day. `drift`: relative standard deviation of what drifts by itself, 0.004 to 0.02."""
    scale, values = (drift / 0.004) ** 0.5, physics._asdict()
    warmer = (float(random.beta(2.0, 5.0)) - 2.0 / 7.0) / 0.16
    parked = min(3.0, float(random.exponential())) - 0.95
    for step, weights in ((warmer, _WARM), (parked, _PARKED)):
        for name, weight in weights.items():
            values[name] *= math.exp(weight * drift * step)
    for name, weight in _BY_ITSELF.items():
        values[name] *= math.exp(weight * drift * _student(random))
    for valve in (1, 2):
        values[f"zero_{valve}_mpa"] += 0.0002 * scale * (_student(random) + warmer)
    zero_1, zero_2, gain_1, gain_2, offset, gain = (_student(random) for _ in range(6))
    return PlantDay(
        Physics(**values), 0.0005 * scale * (zero_1 + 0.4 * warmer), 0.0005 * scale * (zero_2 + 0.4 * warmer),
        1.0 + 0.0011 * scale * gain_1, 1.0 + 0.0011 * scale * gain_2, 0.08 * scale * offset,
        1.0 + 0.0011 * scale * gain, warm=float(random.uniform(0.0, 0.4)), seed=int(random.integers(2**31)),
    )  # fmt: skip


def _student(random: Generator) -> float:
    """Of about unit standard deviation, at most 3."""
    return float(np.clip(random.standard_t(5.0) * math.sqrt(3.0 / 5.0), -3.0, 3.0))
