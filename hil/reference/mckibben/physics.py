"""Parameters of the physics plant: nominal values, the spread between units, the drift between sessions.

No equations here (see integrate). Pressures in the equations are absolute, set-points and monitors are gauge.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.random import Generator

from hil.reference.plant import PlantDay, varied

ATMOSPHERE_MPA: Final = 0.1013


class Physics(NamedTuple):
    """One healthy rig: two regulators, two McKibben muscles on a pulley, a joint. Orders of magnitude from the paper's
    rig (25 mm x 500 mm muscles, SMC ITV regulators), chosen so that +-0.2 MPa around P0 = 0.2 MPa turns the joint about
    +-40 degrees.
    """

    main_mpa: float = 0.62
    """Absolute pressure of the compressed-air main."""
    fill_mpa_s: float = 3.0
    """Rate of pressure when valve 1 is fully open towards the main, choked, joint at zero."""
    exhaust_mpa_s: float = 2.4
    """Rate when fully open to the atmosphere from 0.3 MPa absolute, choked."""
    fill_ratio_2: float = 1.0
    exhaust_ratio_2: float = 1.0
    """Valve 2 against valve 1."""
    full_open_mpa: float = 0.09
    """Pressure error at which the spool is fully open."""
    spool_s: float = 0.007
    line_s: float = 0.004
    """Lag between the regulator's outlet, where the monitor sits, and the muscle."""
    volume_slope_per_rad: float = 0.30
    """Relative growth of a muscle's volume per radian of its contraction."""
    radius_m: float = 0.0125
    length_m: float = 0.5
    contraction: float = 0.15
    """Both muscles' contraction at angle zero."""
    braid_rad: float = 0.436
    """Braid angle at rest (25 degrees); sets the force law's a = 3/tan^2, b = 1/sin^2."""
    strength_2: float = 1.0
    """Force of muscle 2 against muscle 1."""
    pulley_m: float = 0.054
    passive_nm_rad: float = 5.0
    passive_cube_nm_rad3: float = 3.0
    slip_nm: float = 1.2
    """Sum of the Maxwell-slip elements' yield torques at a mean pressure of 0.2 MPa gauge; grows with it."""
    slip_width: float = 1.0
    """Scale of the elements' yield angles."""
    relaxing_nm_rad: float = 1.0
    """Sum of the relaxing springs (viscoelastic bladder), time constants 0.3 to 30 s."""
    bearing_nm: float = 0.06
    viscous_nm_s: float = 0.4
    inertia_kgm2: float = 0.013
    pot_square: float = 0.0
    pot_cube: float = 0.0
    """Curvature of the potentiometer, relative at 40 degrees."""


_UNIT_SPREAD: Final = {
    "main_mpa": 0.03, "fill_mpa_s": 0.15, "exhaust_mpa_s": 0.15, "fill_ratio_2": 0.08, "exhaust_ratio_2": 0.08,
    "full_open_mpa": 0.12,
    "spool_s": 0.2, "line_s": 0.2, "volume_slope_per_rad": 0.2, "radius_m": 0.01, "contraction": 0.04,
    "braid_rad": 0.015,
    "strength_2": 0.01, "pulley_m": 0.01, "passive_nm_rad": 0.15, "passive_cube_nm_rad3": 0.3, "slip_nm": 0.25,
    "slip_width": 0.2,
    "relaxing_nm_rad": 0.3, "bearing_nm": 0.3, "viscous_nm_s": 0.2, "inertia_kgm2": 0.15,
}  # fmt: skip
"""Relative standard deviation between rigs of the same build."""

_POT_SPREAD: Final = 0.004

_DRIFT_WEIGHT: Final = {
    "strength_2": 0.05,
    "contraction": 0.3,
    "braid_rad": 0.1,
    "radius_m": 0.1,
    "length_m": 0.0,
    "pulley_m": 0.0,
}
"""How much of the drift between sessions a parameter takes; 1 where it is not listed. Metal does not drift, rubber
does."""


def draw_unit(random: Generator) -> Physics:
    """Another rig of the same build."""
    nominal = varied(Physics()._asdict(), _UNIT_SPREAD, random)
    nominal["pot_square"], nominal["pot_cube"] = (_POT_SPREAD * random.standard_normal(2)).tolist()
    return Physics(**nominal)


def draw_session(physics: Physics, drift: float, random: Generator) -> PlantDay:
    """One day on the rig. `drift`: relative standard deviation of each parameter, 0.004 to 0.02.

    At 0.004 the instruments move by 0.8 kPa, 0.08 degrees and 0.2 % of angle; they grow with the root of the drift.
    """
    scale = (drift / 0.004) ** 0.5
    values = physics._asdict()
    for name in values:
        values[name] *= float(
            np.exp(drift * _DRIFT_WEIGHT.get(name, 1.0) * np.clip(random.standard_normal(), -2.5, 2.5))
        )
    bias_1, bias_2, offset, gain = np.clip(random.standard_normal(4), -2.5, 2.5).tolist()
    return PlantDay(
        Physics(**values), 0.0008 * scale * bias_1, 0.0008 * scale * bias_2,
        angle_offset_deg=0.08 * scale * offset, angle_gain=1.0 + 0.002 * scale * gain,
        warm=float(random.uniform(0.0, 0.3)), seed=int(random.integers(2**31)),
    )  # fmt: skip
