"""Parameters of the fifth family: nominal values, the spread between units, what days bring.

No equations here. Pressures are gauge MPa unless said. Days differ by the hall's temperature, by for how long the
strands had rested, and by what a technician does in the morning: hang the bundles, tension the belts, set the zero.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.random import Generator

from hil.reference.plant import PlantDay, varied

ATMOSPHERE_MPA: Final = 0.1013


class Physics(NamedTuple):
    """One healthy rig: 40 strands of 2.5 mm x 235 mm in each of two bundles. +-0.2 MPa around 0.2 MPa turn the joint
    about +-40 degrees."""

    main_mpa: float = 0.63
    """Absolute pressure of the main."""
    gain_per_mpa: float = 10.0
    integral_per_s: float = 5.0
    """Drive of a bender per error of pressure, and integral action against the proportional one."""
    bender_s: float = 0.0035
    bender_play: float = 0.014
    """Hysteresis of the piezo ceramic, as a share of the full drive."""
    crack: float = 0.012
    """Drive at which a bender lifts off its seat against 0.3 MPa."""
    fill_mpa_s: float = 3.4
    exhaust_mpa_s: float = 2.9
    """Rates of pressure fully open: from the main, choked; to the atmosphere from 0.3 MPa absolute."""
    ratio_2: float = 1.0
    outlet_share: float = 0.2
    """Volume at the regulator's outlet, where sensor and monitor sit, against the bundle's at angle zero."""
    line_hz: float = 21.0
    """Resonance of the bundle's air on the tube, were the outlet's pressure constant."""
    line_drag_s: float = 60.0
    line_drag_mpa: float = 150.0
    """Laminar drag of tube and strands per flow and second, and turbulent drag per its square (1 / MPa)."""
    heat_s: float = 0.03
    """Within which the air in thin strands takes their temperature."""
    dead_share: float = 0.15
    """Of a bundle's volume at angle zero: manifold and fittings."""
    area_n_mpa: float = 205.0
    """Cross-section of all strands of a bundle before they are inflated, as force per pressure."""
    braid_rad: float = 0.384
    """Angle of the yarns of a strand that is not inflated (22 degrees)."""
    yarn: float = 0.12
    """Thickness of the braid, against the strand's radius."""
    wall: float = 0.41
    """Cross-section of a bladder's wall, against the strand's."""
    rubber_mpa: float = 0.10
    rubber_limit: float = 6.0
    """Gent's modulus and limit of the first invariant."""
    jam_contraction: float = 0.20
    jam_n: float = 20.0
    """The yarns touch each other from a contraction on; push back so much 0.04 beyond it."""
    uneven: float = 0.012
    """By how much, as a strain, the shortest strands of a bundle are shorter than the mean, and the longest longer."""
    strength_2: float = 1.0
    length_m: float = 0.235
    contraction: float = 0.16
    """Both bundles' contraction at angle zero."""
    apart: float = 0.004
    """By how much bundle 2 hangs more contracted."""
    pulley_m: float = 0.0258
    belt_n_m: float = 110_000.0
    belt_s: float = 0.003
    """Stiffness of a belt, and within which it takes its length."""
    cable_nm_rad: float = 0.7
    thread_n: float = 3.0
    thread_n_mpa: float = 30.0
    """Largest friction of a bundle's yarns and strands on each other: without pressure, and per pressure."""
    thread_m: float = 0.0011
    """Stroke at which half of it is reached."""
    creep: float = 0.03
    bearing_nm: float = 0.05
    drag_nm_s: float = 0.08
    inertia_kgm2: float = 0.005
    cube_deg: float = 0.0
    fifth_deg: float = 0.0
    """Deviation of the transformer at 40 degrees."""
    ripple_deg: float = 0.008
    ripple_hz: float = 0.9
    """What the converter's clock leaves of the carrier: a slow beat."""
    converter_s: float = 0.003
    """Window of each of the converter's three means."""


_UNIT_SPREAD: Final = {
    "main_mpa": 0.03, "gain_per_mpa": 0.12, "integral_per_s": 0.2, "bender_s": 0.2, "bender_play": 0.3, "crack": 0.3,
    "fill_mpa_s": 0.12, "exhaust_mpa_s": 0.12, "ratio_2": 0.06, "outlet_share": 0.2, "line_hz": 0.1,
    "line_drag_s": 0.2, "line_drag_mpa": 0.2, "heat_s": 0.3, "dead_share": 0.2, "area_n_mpa": 0.03, "braid_rad": 0.012,
    "yarn": 0.1, "wall": 0.06, "rubber_mpa": 0.1, "rubber_limit": 0.06, "jam_contraction": 0.03, "jam_n": 0.3,
    "uneven": 0.3, "strength_2": 0.01, "contraction": 0.02, "apart": 0.3, "pulley_m": 0.01, "belt_n_m": 0.15,
    "belt_s": 0.3, "cable_nm_rad": 0.25, "thread_n": 0.3, "thread_n_mpa": 0.2, "thread_m": 0.25, "creep": 0.3,
    "bearing_nm": 0.3, "drag_nm_s": 0.25, "inertia_kgm2": 0.15, "ripple_deg": 0.3, "ripple_hz": 0.3,
    "converter_s": 0.03,
}  # fmt: skip
"""Relative standard deviation between rigs of the same build."""
_BEND_DEG: Final = (0.15, 0.08)

_WARM: Final = {
    "rubber_mpa": -0.6, "thread_n": -2.0, "thread_n_mpa": -1.2, "creep": 2.0, "bearing_nm": -1.5, "drag_nm_s": -2.5,
    "cable_nm_rad": -1.5, "bender_play": 0.8, "gain_per_mpa": -0.2, "fill_mpa_s": 0.15, "exhaust_mpa_s": 0.15,
    "line_drag_s": 0.5, "belt_n_m": -0.5,
}  # fmt: skip
"""By how many drifts a parameter moves on a day that is one drift warmer: at 0.004 about one kelvin."""
_RESTED: Final = {
    "thread_n": 1.0, "thread_n_mpa": 1.0, "thread_m": -0.8, "rubber_mpa": 0.5, "contraction": -0.25, "creep": 1.5,
    "bearing_nm": 1.0, "drag_nm_s": 0.8, "uneven": -0.5,
}  # fmt: skip
"""The same when the strands had rested for longer: rubber and grease have set, yarns have to be run in again."""
_OWN: Final = {
    "contraction": 0.25, "apart": 5.0, "belt_n_m": 1.5, "main_mpa": 0.8, "bender_play": 1.0, "crack": 1.0,
    "cable_nm_rad": 1.5, "thread_n_mpa": 0.4, "strength_2": 0.08,
}  # fmt: skip
"""By how many drifts it moves by itself: how it was hung and tensioned, how the cables lie, the main, the ceramic."""


def draw_unit(random: Generator) -> Physics:
    """Another rig of the same build."""
    values = varied(Physics()._asdict(), _UNIT_SPREAD, random)
    bends = (np.array(_BEND_DEG) * random.standard_normal(2)).tolist()
    return Physics(**values | dict(zip(("cube_deg", "fifth_deg"), bends, strict=True)))


def draw_session(physics: Physics, drift: float, random: Generator) -> PlantDay:
    """One day. `drift`: relative standard deviation of what drifts by itself, 0.004 to 0.02.

    Temperatures are normal, rests exponential (most are a night, some a holiday), hand work is uniform.
    """
    scale, values = (drift / 0.004) ** 0.5, physics._asdict()
    warmer = float(np.clip(random.standard_normal(), -2.5, 2.5))
    rested = min(3.0, float(random.exponential())) - 0.95
    for step, weights in ((warmer, _WARM), (rested, _RESTED)):
        for name, weight in weights.items():
            values[name] *= float(np.exp(weight * drift * step))
    for name, weight in _OWN.items():
        values[name] *= float(np.exp(weight * drift * _by_hand(random)))
    bias_1, bias_2, gain_1, gain_2, zero, gain = (_by_hand(random) for _ in range(6))
    return PlantDay(
        Physics(**values), 0.0004 * scale * (bias_1 + 0.7 * warmer), 0.0004 * scale * (bias_2 + 0.7 * warmer),
        1.0 + 0.001 * scale * gain_1, 1.0 + 0.001 * scale * gain_2, scale * (0.08 * zero + 0.03 * warmer),
        1.0 + 0.001 * scale * (gain + 0.6 * warmer),
        warm=float(random.uniform(0.0, 0.4)), seed=int(random.integers(2**31)),
    )  # fmt: skip


def _by_hand(random: Generator) -> float:
    """Of unit standard deviation, uniform."""
    return float(random.uniform(-(3.0**0.5), 3.0**0.5))
