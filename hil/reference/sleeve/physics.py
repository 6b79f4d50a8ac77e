"""Parameters of the sixth family: nominal values, the spread between units, what days bring.

No equations here. Pressures are gauge MPa unless said. Days differ by the hour's temperature and by the barometer; what
is adjusted by hand lies triangularly about where it should be.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.random import Generator

from hil.reference.plant import PlantDay, varied


class Physics(NamedTuple):
    """One healthy rig. +-0.2 MPa around 0.2 MPa turn the joint about +-40 degrees."""

    atmosphere_mpa: float = 0.1013
    main_mpa: float = 0.60
    """Absolute pressure of the main."""
    driver_s: float = 0.004
    """Of the current through a force motor."""
    band_mpa: float = 0.30
    """Error that moves the flapper over the whole of its way."""
    nozzle_s: float = 0.011
    """Of the space between restriction and nozzle."""
    relay: float = 4.0
    """Travel of the spool, over its whole, per back pressure over its supply."""
    spool_s: float = 0.005
    trim_per_s: float = 2.0
    """Integral action of the slow controller that trims the beam."""
    beam_1_mpa: float = 0.0
    beam_2_mpa: float = 0.0
    """By how much a beam is out of balance, before its trim."""
    fill_mpa_s: float = 2.7
    exhaust_mpa_s: float = 2.3
    """Rates of pressure with the spool fully open: from the main, choked; from 0.3 MPa absolute."""
    rate_ratio_2: float = 1.0
    outlet_share: float = 0.3
    """Volume between spool and filter against a muscle's."""
    darcy: float = 0.0030
    forchheimer: float = 0.0010
    """Of the sintered filter before a muscle: difference of the squares of pressure per flow (MPa/s) and its square."""
    walls_s: float = 0.16
    """Within which the air takes the walls' temperature, at 0.3 MPa absolute."""
    dead_share: float = 0.10
    """Of a muscle's volume at angle zero: end fittings."""
    radius_m: float = 0.010
    ring_m: float = 0.030
    """Radius of a flat sleeve, length of its fibres from ring to ring."""
    length_m: float = 0.24
    contraction: float = 0.135
    """Both muscles' contraction at angle zero."""
    apart: float = 0.002
    """By how much muscle 2 hangs more contracted."""
    strength_2: float = 1.0
    rubber_n_m: float = 55.0
    """Modulus of the rubber times its thickness."""
    flow: float = 0.06
    """Rubber that flows, against the elastic rubber."""
    sector_m: float = 0.0148
    spiral_per_rad: float = 0.10
    """Radius of the spiral sectors at angle zero, and by which share it grows per radian towards contraction."""
    flexure_nm_rad: float = 0.3
    buckle_n: float = 1500.0
    """Stiffness of the crossed flexures without load, and the load of the tendons that would take it away."""
    rub_n: float = 2.0
    rub_share: float = 0.035
    """Hysteresis of fibres and rings: force without tension, and per tension."""
    rub_m: float = 0.004
    """Scale of the strokes on which its elements turn over."""
    bearing_nm: float = 0.07
    oil_nm_s: float = 0.07
    inertia_kgm2: float = 0.005
    ellipse_deg: float = 0.0
    ellipse_rad: float = 0.0
    """Error twice per turn of a magnet that is no circle's."""
    knots_deg: float = 0.06
    knots_rad: float = 0.0
    """Residual error of the table between its knots."""


_UNIT_SPREAD: Final = {
    "main_mpa": 0.03, "driver_s": 0.2, "band_mpa": 0.1, "nozzle_s": 0.15, "relay": 0.1, "spool_s": 0.2,
    "trim_per_s": 0.2, "fill_mpa_s": 0.12, "exhaust_mpa_s": 0.12, "rate_ratio_2": 0.06, "outlet_share": 0.15,
    "darcy": 0.15, "forchheimer": 0.2, "walls_s": 0.2, "dead_share": 0.2, "radius_m": 0.015, "ring_m": 0.01,
    "contraction": 0.025, "apart": 0.5, "strength_2": 0.01, "rubber_n_m": 0.15, "flow": 0.3, "sector_m": 0.01,
    "spiral_per_rad": 0.3, "flexure_nm_rad": 0.15, "buckle_n": 0.15, "rub_n": 0.3, "rub_share": 0.2, "rub_m": 0.2,
    "bearing_nm": 0.3, "oil_nm_s": 0.25, "inertia_kgm2": 0.15, "knots_deg": 0.3,
}  # fmt: skip
"""Relative standard deviation between rigs of the same build."""
_BEAM_MPA: Final = 0.002
_ELLIPSE_DEG: Final = 0.12

_WARM: Final = {
    "rubber_n_m": 0.5, "flow": 2.0, "rub_n": -1.2, "rub_share": -0.9, "oil_nm_s": -2.5, "bearing_nm": -0.8,
    "nozzle_s": -0.4, "driver_s": -0.4, "darcy": 0.8, "flexure_nm_rad": -0.1, "contraction": 0.1,
}  # fmt: skip
"""By how many drifts a parameter moves on a day that is one drift warmer: rubber stiffens (entropy), oil thins, coils
and air resist more."""
_BY_HAND: Final = {
    "main_mpa": 0.8, "contraction": 0.3, "apart": 6.0, "strength_2": 0.1, "band_mpa": 0.4, "relay": 0.4,
    "rub_share": 0.6, "rub_m": 0.5, "flexure_nm_rad": 0.3,
}  # fmt: skip
"""By how many drifts it moves by itself: how the muscles were hung, what was set."""
_BAROMETER: Final = 0.8
"""By how many drifts the atmosphere's pressure moves: at a drift of 0.01 by 0.8 kPa."""
_BEAM_DAY_MPA: Final = 0.0008


def draw_unit(random: Generator) -> Physics:
    """Another rig of the same build."""
    values = varied(Physics()._asdict(), _UNIT_SPREAD, random)
    values |= dict(zip(("ellipse_rad", "knots_rad"), random.uniform(0.0, 2.0 * math.pi, 2).tolist(), strict=True))
    values["ellipse_deg"] = _ELLIPSE_DEG * float(random.rayleigh())
    values |= dict(zip(("beam_1_mpa", "beam_2_mpa"), (_BEAM_MPA * random.standard_normal(2)).tolist(), strict=True))
    return Physics(**values)


def draw_session(physics: Physics, drift: float, random: Generator) -> PlantDay:
    """One day. `drift`: relative standard deviation of what drifts by itself, 0.004 to 0.02."""
    scale, values = (drift / 0.004) ** 0.5, physics._asdict()
    warmer = drift * math.sqrt(2.0) * math.sin(random.uniform(0.0, 2.0 * math.pi))
    barometer = drift * float(np.clip(random.standard_normal(), -2.0, 2.0))
    for name, weight in _WARM.items():
        values[name] *= math.exp(weight * warmer)
    for name, weight in _BY_HAND.items():
        values[name] *= math.exp(weight * drift * _triangular(random))
    values["atmosphere_mpa"] *= math.exp(_BAROMETER * barometer)
    for name in ("beam_1_mpa", "beam_2_mpa"):
        values[name] += _BEAM_DAY_MPA * scale * _triangular(random)
    both, bias_1, bias_2, gain_1, gain_2, offset = (_triangular(random) for _ in range(6))
    return PlantDay(
        Physics(**values), 0.0004 * scale * (both + bias_1), 0.0004 * scale * (both + bias_2),
        1.0 + 0.0012 * scale * gain_1, 1.0 + 0.0012 * scale * gain_2, 0.08 * scale * offset,
        1.0 - 0.25 * warmer, warm=float(random.uniform(0.0, 0.4)), seed=int(random.integers(2**31)),
    )  # fmt: skip


def _triangular(random: Generator) -> float:
    """Of unit standard deviation, at most 2.45."""
    return float(random.triangular(-1.0, 0.0, 1.0)) * math.sqrt(6.0)
