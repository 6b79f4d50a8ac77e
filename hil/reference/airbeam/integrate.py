"""This family's equations of motion over a whole record, compiled. Noise-free but for what is on the set-points."""

import math
from typing import Any

import numpy as np

from hil.reference.airbeam.disturbance import RigLaw
from hil.reference.airbeam.mechanics import ANGLE, STATES, beam_air, fold_of, hung, step_joint
from hil.reference.airbeam.physics import ATMOSPHERE_MPA, Physics
from hil.reference.airbeam.pneumatics import BOTTLE, bridged, filled, pores, step_bottle, step_regulator
from hil.reference.airbeam.regulator import AIR, OUTLET, VALVE_STATES
from hil.reference.compiling import Array, State, compiled

MOST_RAD = 1.3
"""Beyond, a folded beam lies flat on itself."""


@compiled
def rest(p1_mpa: float, p2_mpa: float, physics: Physics, rig: RigLaw) -> Any:
    """The state after a long time at these gauge pressures, but for friction: the joint at zero, beams filled."""
    s: Any = np.zeros(STATES)
    s[BOTTLE] = physics.main_mpa
    for beam in range(2):
        p = p1_mpa if beam == 0 else p2_mpa
        s[beam * VALVE_STATES + AIR] = p + ATMOSPHERE_MPA
        filled(p, beam_air(beam, s, physics, rig)[0], beam, s, physics)
    hung(s, physics)
    return s


@compiled
def step(
    set_1: float, set_2: float, time_s: float, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> None:
    """All of the rig by one internal step."""
    demand, across = 0.0, bridged(s, rig) if rig.bridge > 0.0 else 0.0
    for beam in range(2):
        volume, growth = beam_air(beam, s, physics, rig)
        lost = pores(fold_of(beam, s[ANGLE], physics), beam, s, physics, rig) + (1.0 - 2.0 * beam) * across
        demand += step_regulator(
            set_1 if beam == 0 else set_2, volume, growth, lost, beam, s, physics, rig, dt_s
        )  # fmt: skip
    step_bottle(demand, s, physics, rig, dt_s)
    step_joint(time_s, warm, s, physics, rig, dt_s)


@compiled
def settle(
    set_1: float, set_2: float, steps: int, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> None:
    """So many steps at the same set-points; in the middle of them the creases are shaken out."""
    for i in range(steps):
        step(set_1, set_2, -1.0, warm, s, physics, rig, dt_s)
        if i == steps // 2:
            hung(s, physics)


@compiled
def integrate(
    set_1_mpa: Array,
    set_2_mpa: Array,
    substeps: int,
    settling: int,
    dt_s: float,
    warm: float,
    physics: Physics,
    rig: RigLaw,
) -> Array:
    """Set-points on the internal grid, shape (n * substeps,) gauge MPa -> (3, n): p1, p2 at the outlets (gauge MPa),
    angle (rad).

    A tick is read before its own set-point acts. `settling` internal steps at the first set-points come first; angles
    that leave +-1.3 rad end the record as NaN.
    """
    n = len(set_1_mpa) // substeps
    out = np.full((3, n), np.nan)
    s: Any = rest(set_1_mpa[0], set_2_mpa[0], physics, rig)
    settle(set_1_mpa[0], set_2_mpa[0], settling, warm, s, physics, rig, dt_s)
    for k in range(n):
        if not math.fabs(s[ANGLE]) < MOST_RAD:
            break
        out[0, k] = s[OUTLET] - ATMOSPHERE_MPA
        out[1, k] = s[VALVE_STATES + OUTLET] - ATMOSPHERE_MPA
        out[2, k] = s[ANGLE]
        for i in range(k * substeps, (k + 1) * substeps):
            step(set_1_mpa[i], set_2_mpa[i], i * dt_s, warm, s, physics, rig, dt_s)
    return out
