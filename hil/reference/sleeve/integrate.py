"""This family's equations of motion over a whole record, compiled. Noise-free but for what is on the set-points."""

import math
from typing import Any

import numpy as np

from hil.reference.compiling import Array, State, compiled
from hil.reference.sleeve.disturbance import RigLaw
from hil.reference.sleeve.mechanics import (
    ANGLE,
    CENTRES,
    ELEMENT,
    FARTHEST,
    STATES,
    WIDTHS,
    hung,
    muscle_air,
    place,
    step_joint,
    strain_of,
)
from hil.reference.sleeve.physics import Physics
from hil.reference.sleeve.pneumatics import RECEIVER, filled, step_regulator, step_supply
from hil.reference.sleeve.regulator import AIR, VALVE_STATES


@compiled
def rest(p1_mpa: float, p2_mpa: float, warm: float, physics: Physics, rig: RigLaw, dt_s: float) -> Any:
    """The state after a long time at these gauge pressures, but for friction: the joint at zero, chambers filled."""
    s: Any = np.zeros(STATES)
    filled(p1_mpa, 0, s, physics)
    filled(p2_mpa, 1, s, physics)
    s[RECEIVER] = physics.main_mpa
    hung(warm, s, physics, rig, dt_s)
    return s


@compiled
def step(set_1: float, set_2: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """All of the rig by one internal step."""
    place(s, physics, rig, 2, dt_s)
    demand = 0.0
    for valve in range(2):
        volume, growth = muscle_air(valve, s, physics, rig)
        demand += step_regulator(set_1 if valve == 0 else set_2, volume, growth, valve, s, physics, rig, dt_s)
    step_supply(demand, s, physics, rig, dt_s)
    p1, p2 = s[AIR] - physics.atmosphere_mpa, s[VALVE_STATES + AIR] - physics.atmosphere_mpa
    step_joint(p1, p2, s, physics, rig, dt_s)


@compiled
def settle(set_1: float, set_2: float, steps: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """So many steps at the same set-points; in the middle of them the muscles' hysteresis is shaken out, and what the
    rubber remembers begins at the end."""
    for i in range(steps):
        step(set_1, set_2, s, physics, rig, dt_s)
        if i == steps // 2:
            for k in range(2 * CENTRES * WIDTHS):
                s[ELEMENT + k] = 0.0
    for muscle in range(2):
        s[FARTHEST + muscle] = strain_of(muscle, s, physics, rig)


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
    """Set-points on the internal grid, shape (n * substeps,) gauge MPa -> (3, n): p1, p2 in the muscles (gauge MPa),
    angle (rad).

    A tick is read before its own set-point acts. `settling` internal steps at the first set-points come first; angles
    that leave +-1.4 rad end the record as NaN: there the flexures end.
    """
    n = len(set_1_mpa) // substeps
    out = np.full((3, n), np.nan)
    s: Any = rest(set_1_mpa[0], set_2_mpa[0], warm, physics, rig, dt_s)
    settle(set_1_mpa[0], set_2_mpa[0], settling, s, physics, rig, dt_s)
    for k in range(n):
        if not math.fabs(s[ANGLE]) < 1.4:
            break
        out[0, k] = s[AIR] - physics.atmosphere_mpa
        out[1, k] = s[VALVE_STATES + AIR] - physics.atmosphere_mpa
        out[2, k] = s[ANGLE]
        for i in range(k * substeps, (k + 1) * substeps):
            step(set_1_mpa[i], set_2_mpa[i], s, physics, rig, dt_s)
    return out
