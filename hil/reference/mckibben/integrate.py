"""The plant's equations of motion over a whole record, compiled. Noise-free but for what is on the set-points."""

import math
from typing import Any

import numpy as np

from hil.reference.compiling import Array, State, compiled
from hil.reference.mckibben.disturbance import RigLaw
from hil.reference.mckibben.mechanics import ANGLE, RELAX, SLIP, SPEED, STATES, step_joint
from hil.reference.mckibben.physics import ATMOSPHERE_MPA, Physics
from hil.reference.mckibben.pneumatics import (
    HOSE,
    HUNT,
    LINE,
    PILOT,
    PRESSURE,
    REFILL_S,
    TANK,
    VALVE_STATES,
    muscle_pressure,
    step_valve,
)


@compiled
def rest(p1_mpa: float, p2_mpa: float, physics: Physics) -> Array:
    """The state after a long time at these gauge pressures, but for friction: the joint at zero, chambers filled."""
    s = np.zeros(STATES)
    for valve in range(2):
        p = p1_mpa if valve == 0 else p2_mpa
        at = valve * VALVE_STATES
        s[at + PRESSURE] = s[at + LINE] = p + ATMOSPHERE_MPA
        s[at + PILOT] = s[at + HOSE] = p
        s[at + HUNT] = 0.5
    s[TANK] = physics.main_mpa
    return s


@compiled
def step(
    set_1: float, set_2: float, time_s: float, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> None:
    """All of the rig by one internal step."""
    s[TANK] = max(0.12, s[TANK] + dt_s / REFILL_S * (physics.main_mpa - s[TANK]))
    slope = physics.volume_slope_per_rad
    step_valve(set_1, 1.0 + slope * s[ANGLE], slope * s[SPEED], 0, s, physics, rig, dt_s)
    step_valve(set_2, 1.0 - slope * s[ANGLE], -slope * s[SPEED], 1, s, physics, rig, dt_s)
    step_joint(muscle_pressure(0, s, rig), muscle_pressure(1, s, rig), time_s, warm, s, physics, rig, dt_s)


@compiled
def integrate(
    set_1_mpa: Array,
    set_2_mpa: Array,
    substeps: int,
    settle: int,
    dt_s: float,
    warm: float,
    physics: Physics,
    rig: RigLaw,
) -> Array:
    """Set-points on the internal grid, shape (n * substeps,) gauge MPa -> (3, n): p1, p2 (gauge MPa), angle (rad) at
    each tick.

    A tick is read before its own set-point acts. `settle` internal steps at the first set-points come first, after
    which the slow springs are at ease; angles that leave +-3 rad end the record as NaN.
    """
    n = len(set_1_mpa) // substeps
    out = np.full((3, n), np.nan)
    s: Any = rest(set_1_mpa[0], set_2_mpa[0], physics)
    for i in range(settle):
        step(set_1_mpa[0], set_2_mpa[0], -1.0, warm, s, physics, rig, dt_s)
        if i == settle // 2:
            s[RELAX : RELAX + 4] = s[ANGLE]
            s[SLIP : SLIP + 4] = s[ANGLE]
    for k in range(n):
        if not math.fabs(s[ANGLE]) < 3.0:
            break
        out[0, k] = s[PRESSURE] - ATMOSPHERE_MPA
        out[1, k] = s[VALVE_STATES + PRESSURE] - ATMOSPHERE_MPA
        out[2, k] = s[ANGLE]
        for i in range(k * substeps, (k + 1) * substeps):
            step(set_1_mpa[i], set_2_mpa[i], i * dt_s, warm, s, physics, rig, dt_s)
    return out
