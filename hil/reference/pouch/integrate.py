"""This family's equations of motion over a whole record, compiled. Noise-free but for what is on the set-points."""

import math
from typing import Any

import numpy as np

from hil.reference.compiling import Array, State, compiled
from hil.reference.pouch.bank import AIR, OPENING, OUTLET, VALVE_STATES
from hil.reference.pouch.disturbance import RigLaw
from hil.reference.pouch.mechanics import (
    ANGLE,
    STATES,
    muscle_air,
    open_pouches,
    rested,
    step_film,
    step_joint,
)
from hil.reference.pouch.physics import ATMOSPHERE_MPA, Physics
from hil.reference.pouch.pneumatics import RECEIVER, SUPPLY, filled, slit_flow, step_regulator, step_supply

MOST_RAD = 1.05
"""Beyond, a row has no length left to give."""
BEGUN_RAD = 0.8
"""Half angle from which a pouch's is first sought."""


@compiled
def rest(p1_mpa: float, p2_mpa: float, physics: Physics, rig: RigLaw) -> Any:
    """The state after a long time at these gauge pressures, but for friction: the joint at zero, muscles filled."""
    s: Any = np.zeros(STATES)
    s[SUPPLY] = s[RECEIVER] = physics.main_mpa
    for valve in range(2):
        s[valve * VALVE_STATES + AIR] = (p1_mpa if valve == 0 else p2_mpa) + ATMOSPHERE_MPA
        s[valve * VALVE_STATES + OPENING] = BEGUN_RAD
    rested(-1.0, 0.0, s, physics, rig)
    for valve in range(2):
        filled(p1_mpa if valve == 0 else p2_mpa, muscle_air(valve, s, physics, rig), valve, s, physics, rig)
    return s


@compiled
def step(
    set_1: float, set_2: float, time_s: float, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> None:
    """All of the rig by one internal step."""
    demand = 0.0
    for valve in range(2):
        tension = open_pouches(time_s, warm, valve, 1, s, physics, rig)
        leak = rig.leak_1 if valve == 0 else rig.leak_2
        lost = slit_flow(leak, tension, s[valve * VALVE_STATES + AIR]) if leak > 0.0 else 0.0
        room, set_mpa = muscle_air(valve, s, physics, rig), set_1 if valve == 0 else set_2
        demand += step_regulator(set_mpa, time_s, room, lost, valve, s, physics, rig, dt_s)
        step_film(valve, tension, s, physics, rig, dt_s)
    step_supply(demand, s, physics, rig, dt_s)
    step_joint(time_s, warm, s, physics, rig, dt_s)


@compiled
def settle(
    set_1: float, set_2: float, steps: int, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> None:
    """So many steps at the same set-points; in the middle of them film and creases are as after a long rest."""
    for i in range(steps):
        step(set_1, set_2, -1.0, warm, s, physics, rig, dt_s)
        if i == steps // 2:
            rested(-1.0, warm, s, physics, rig)


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
    that leave +-1.05 rad end the record as NaN.
    """
    n = len(set_1_mpa) // substeps
    record = np.full((3, n), np.nan)
    s: Any = rest(set_1_mpa[0], set_2_mpa[0], physics, rig)
    settle(set_1_mpa[0], set_2_mpa[0], settling, warm, s, physics, rig, dt_s)
    for k in range(n):
        if not math.fabs(s[ANGLE]) < MOST_RAD:
            break
        record[0, k] = s[OUTLET] - ATMOSPHERE_MPA
        record[1, k] = s[VALVE_STATES + OUTLET] - ATMOSPHERE_MPA
        record[2, k] = s[ANGLE]
        for i in range(k * substeps, (k + 1) * substeps):
            step(set_1_mpa[i], set_2_mpa[i], i * dt_s, warm, s, physics, rig, dt_s)
    return record
