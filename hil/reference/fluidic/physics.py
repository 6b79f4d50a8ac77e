"""Parameters of the second family: nominal values, the spread between units, what days bring.

No equations here. Pressures are gauge MPa unless said. Days differ by one temperature that moves many parameters
together, by how the muscles were hung, and by their instruments.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.random import Generator

from hil.reference.plant import PlantDay, varied

ATMOSPHERE_MPA: Final = 0.1013


class Physics(NamedTuple):
    """One healthy rig. Orders of magnitude of 20 mm x 400 mm fluidic muscles.

    +-0.2 MPa around 0.2 MPa turn the joint about +-40 degrees.
    """

    main_mpa: float = 0.60
    """Absolute pressure of the main."""
    rate_mpa_s: float = 2.6
    """Rate of pressure of muscle and hose with valve 1 fully open to the main, choked."""
    exhaust_ratio: float = 1.15
    """Of the opening towards the atmosphere against that towards the main."""
    rate_ratio_2: float = 1.0
    gain_per_mpa: float = 11.0
    """Opening per error of pressure."""
    integral_per_s: float = 1.5
    """Integral action against the proportional one."""
    opening_s: float = 0.005
    hose_s: float = 0.008
    """Time constant of the muscle behind its hose; the regulator's own sensor sits before it, the monitor behind it."""
    outlet_share: float = 0.2
    """Volume at the regulator's outlet against the muscle's."""
    swell: float = 3.0
    swell_square: float = 4.5
    """Growth of a muscle's volume with its contraction, and where it ends."""
    area_n_mpa: float = 3600.0
    """Force of a muscle of full length per pressure."""
    end_contraction: float = 0.25
    """Contraction at which the pressure's force is gone."""
    membrane_n: float = 130.0
    membrane_mpa: float = 0.5
    membrane_per: float = 28.0
    """Force of the membrane at full length, its growth per 1 / this pressure, and how fast it falls with
    contraction."""
    strength_2: float = 1.0
    length_m: float = 0.4
    contraction: float = 0.12
    """Both muscles' contraction at angle zero."""
    lever_m: float = 0.030
    lever_rad: float = 0.06
    """Length of the lever's arms and the angle by which they are not in line."""
    passive_nm_rad: float = 1.6
    passive_fifth_nm: float = 4.0
    mesh_n: float = 6.0
    mesh_n_mpa: float = 34.0
    """Largest friction force of a muscle's mesh: without pressure, and per pressure."""
    mesh_rad: float = 0.012
    """Angle within which the inner loop of the mesh gives way; the outer one five times that."""
    creep: float = 0.012
    bearing_nm: float = 0.07
    viscous_nm_s: float = 0.35
    inertia_kgm2: float = 0.018
    disc_deg: float = 0.0
    disc_rad: float = 0.0
    """Eccentricity of the encoder's disc: an error once per turn."""


_UNIT_SPREAD: Final = {
    "main_mpa": 0.03, "rate_mpa_s": 0.12, "exhaust_ratio": 0.08, "rate_ratio_2": 0.06, "gain_per_mpa": 0.12,
    "integral_per_s": 0.3,
    "opening_s": 0.2, "hose_s": 0.2, "outlet_share": 0.15, "swell": 0.15, "swell_square": 0.15, "area_n_mpa": 0.03,
    "end_contraction": 0.02, "membrane_n": 0.2, "membrane_mpa": 0.2, "membrane_per": 0.1, "strength_2": 0.012,
    "contraction": 0.03,
    "lever_m": 0.01, "lever_rad": 0.5, "passive_nm_rad": 0.2, "passive_fifth_nm": 0.3, "mesh_n": 0.25,
    "mesh_n_mpa": 0.25,
    "mesh_rad": 0.2, "creep": 0.3, "bearing_nm": 0.3, "viscous_nm_s": 0.25, "inertia_kgm2": 0.15,
}  # fmt: skip
"""Relative standard deviation between rigs of the same build."""

_DISC_DEG: Final = 0.25

_WARM: Final = {
    "area_n_mpa": 0.15, "membrane_n": -1.5, "mesh_n": -1.5, "mesh_n_mpa": -1.2, "viscous_nm_s": -2.0,
    "bearing_nm": -1.0, "creep": 2.0,
    "rate_mpa_s": 0.3, "opening_s": -0.5, "passive_nm_rad": -0.8, "end_contraction": 0.05,
}  # fmt: skip
"""By how many drifts a parameter moves on a day that is one drift warmer."""
_OWN: Final = {
    "contraction": 0.35, "strength_2": 0.06, "gain_per_mpa": 0.4, "integral_per_s": 0.8, "main_mpa": 1.0,
    "mesh_n_mpa": 0.5,
    "membrane_n": 0.5, "lever_rad": 0.5,
}  # fmt: skip
"""By how many drifts it moves by itself: how the muscles were hung, how the main is used."""


def draw_unit(random: Generator) -> Physics:
    """Another rig of the same build."""
    values = varied(Physics()._asdict(), _UNIT_SPREAD, random)
    return Physics(
        **values | {"disc_deg": _DISC_DEG * float(random.rayleigh()), "disc_rad": float(random.uniform(0.0, 6.283))}
    )


def draw_session(physics: Physics, drift: float, random: Generator) -> PlantDay:
    """One day. `drift`: relative standard deviation of what drifts by itself, 0.004 to 0.02, with heavier tails than a
    normal one's."""
    scale = (drift / 0.004) ** 0.5
    warmer, values = drift * _heavy(random), physics._asdict()
    for name, weight in _WARM.items():
        values[name] *= float(np.exp(weight * warmer))
    for name, weight in _OWN.items():
        values[name] *= float(np.exp(weight * drift * _heavy(random)))
    bias_1, bias_2, gain_1, gain_2, offset = (_heavy(random) for _ in range(5))
    return PlantDay(
        Physics(**values), 0.0006 * scale * bias_1, 0.0006 * scale * bias_2, 1.0 + 0.0015 * scale * gain_1,
        1.0 + 0.0015 * scale * gain_2, 0.10 * scale * offset,
        warm=float(random.uniform(0.0, 0.5)), seed=int(random.integers(2**31)),
    )  # fmt: skip


def _heavy(random: Generator) -> float:
    """Of unit standard deviation, Student's t with 5 degrees of freedom, at most 3."""
    return float(np.clip(random.standard_t(5) / np.sqrt(5.0 / 3.0), -3.0, 3.0))
