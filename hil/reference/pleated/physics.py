"""Parameters of the third family: nominal values, the spread between units, what days bring.

No equations here. Pressures are gauge MPa unless said. Days differ by temperature and by humidity, each of which moves
several parameters together; most days are alike and some are odd.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.random import Generator

from hil.reference.plant import PlantDay, varied

ATMOSPHERE_MPA: Final = 0.1013


class Physics(NamedTuple):
    """One healthy rig. +-0.2 MPa around 0.2 MPa turn the joint about +-40 degrees."""

    main_mpa: float = 0.58
    """Absolute pressure of the main."""
    dead_s: float = 0.006
    """Between a set-point and the first motion of the spool."""
    fill_mpa_s: float = 2.8
    exhaust_mpa_s: float = 2.2
    """Rates of pressure fully open: from the main, choked; to the atmosphere from 0.3 MPa absolute."""
    rate_ratio_2: float = 1.0
    gain_per_mpa: float = 9.0
    """Opening per error of pressure."""
    damping_s: float = 0.006
    """Opening taken back per rate of pressure, times the gain."""
    spool_hz: float = 22.0
    spool_damping: float = 0.65
    tube_s: float = 0.008
    """Time constant of the muscle behind its tube at 0.3 MPa absolute; regulator and monitor sit before it."""
    outlet_share: float = 0.25
    """Volume before the tube against the muscle's."""
    heat_s: float = 0.12
    """Within which the air takes the walls' temperature."""
    swell: float = 5.0
    swell_square: float = 9.0
    """Growth of a muscle's volume with its contraction, and where it ends."""
    strength_n_mpa: float = 1320.0
    """Force per pressure at half of the contraction at which it ends."""
    end_contraction: float = 0.42
    strength_2: float = 1.0
    length_m: float = 0.30
    contraction: float = 0.18
    """Both muscles' contraction at angle zero."""
    crank_m: float = 0.022
    base_m: float = 0.12
    """Crank of the joint, and how far from the axis a muscle's other end is."""
    crank_rad: float = 0.08
    """By how much the crank stands off a right angle at zero."""
    passive_nm_rad: float = 0.6
    passive_square_nm: float = 0.15
    """A cable that is stiffer to one side."""
    fold_n: float = 3.0
    fold_n_mpa: float = 30.0
    """Largest friction force of a muscle's folds: without pressure, and per pressure."""
    fold_m: float = 0.0006
    """Stroke within which it turns over."""
    fold_rate: float = 0.05
    """How much stronger it is at ten times the speed, about."""
    creep: float = 0.02
    bearing_nm: float = 0.04
    film_nm_s: float = 0.2
    inertia_kgm2: float = 0.009
    magnet_1_deg: float = 0.0
    magnet_2_deg: float = 0.0
    magnet_1_rad: float = 0.0
    magnet_2_rad: float = 0.0
    """The magnet is off the axis: errors once and twice per turn."""
    latency_s: float = 0.0012
    """Of the encoder's own filter."""
    bow_1: float = 0.0
    bow_2: float = 0.0
    """Curvature of the monitors, relative at 0.4 MPa."""


_UNIT_SPREAD: Final = {
    "main_mpa": 0.04, "dead_s": 0.2, "fill_mpa_s": 0.12, "exhaust_mpa_s": 0.12, "rate_ratio_2": 0.05,
    "gain_per_mpa": 0.15, "damping_s": 0.3, "spool_hz": 0.15, "spool_damping": 0.15, "tube_s": 0.2,
    "outlet_share": 0.15, "heat_s": 0.3, "swell": 0.15, "swell_square": 0.15, "strength_n_mpa": 0.04,
    "end_contraction": 0.01, "strength_2": 0.008, "contraction": 0.02, "crank_m": 0.01, "base_m": 0.05,
    "crank_rad": 0.4, "passive_nm_rad": 0.25, "passive_square_nm": 0.5, "fold_n": 0.3, "fold_n_mpa": 0.2,
    "fold_m": 0.25, "fold_rate": 0.3, "creep": 0.3, "bearing_nm": 0.3, "film_nm_s": 0.25, "inertia_kgm2": 0.15,
    "latency_s": 0.2,
}  # fmt: skip
"""Relative standard deviation between rigs of the same build."""
_MAGNET_DEG: Final = (0.15, 0.08)
_BOW: Final = 0.003

_WARM: Final = {
    "fold_n": -1.5, "fold_n_mpa": -1.0, "film_nm_s": -2.0, "bearing_nm": -1.0, "creep": 1.5, "strength_n_mpa": 0.1,
    "fill_mpa_s": 0.4, "exhaust_mpa_s": 0.4, "spool_damping": -0.6, "passive_nm_rad": -0.5,
}  # fmt: skip
"""By how many drifts a parameter moves on a day that is one drift warmer."""
_HUMID: Final = {
    "strength_n_mpa": -0.15, "contraction": 0.15, "fold_n_mpa": 0.8, "fold_m": 0.8, "fold_rate": 1.0, "creep": 1.0,
}  # fmt: skip
"""The same on a day that is one drift more humid: the membranes take up water."""
_OWN: Final = {
    "contraction": 0.2, "strength_2": 0.05, "gain_per_mpa": 0.5, "dead_s": 0.5, "main_mpa": 1.0, "crank_rad": 0.6,
    "passive_square_nm": 1.0,
}  # fmt: skip
"""By how many drifts it moves by itself."""
ODD_SHARE: Final = 0.15
ODD_TIMES: Final = 2.2
"""Some days are odd: everything moves by so many times as much as on the others."""


def draw_unit(random: Generator) -> Physics:
    """Another rig of the same build."""
    values = varied(Physics()._asdict(), _UNIT_SPREAD, random)
    values |= dict(zip(("magnet_1_deg", "magnet_2_deg"), random.rayleigh(_MAGNET_DEG).tolist(), strict=True))
    values |= dict(zip(("magnet_1_rad", "magnet_2_rad"), random.uniform(0.0, 6.283, 2).tolist(), strict=True))
    values |= dict(zip(("bow_1", "bow_2"), (_BOW * random.standard_normal(2)).tolist(), strict=True))
    return Physics(**values)


def draw_session(physics: Physics, drift: float, random: Generator) -> PlantDay:
    """One day. `drift`: relative standard deviation of what drifts by itself on a day like most, 0.004 to 0.02."""
    odd = ODD_TIMES if random.random() < ODD_SHARE else 0.85
    scale, values = odd * (drift / 0.004) ** 0.5, physics._asdict()
    for weights in (_WARM, _HUMID):
        step = odd * drift * random.standard_normal()
        for name, weight in weights.items():
            values[name] *= float(np.exp(weight * step))
    for name, weight in _OWN.items():
        values[name] *= float(np.exp(odd * weight * drift * random.standard_normal()))
    bias_1, bias_2, gain_1, gain_2, offset = np.clip(random.standard_normal(5), -3.0, 3.0).tolist()
    return PlantDay(
        Physics(**values), 0.0005 * scale * bias_1, 0.0005 * scale * bias_2, 1.0 + 0.001 * scale * gain_1,
        1.0 + 0.001 * scale * gain_2, 0.09 * scale * offset,
        warm=float(random.uniform(0.0, 0.4)), seed=int(random.integers(2**31)),
    )  # fmt: skip
