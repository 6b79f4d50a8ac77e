"""This family's equations of motion over a whole record, compiled. Noise-free but for what is on the set-points."""

import math
from typing import Any

import numpy as np

from hil.reference.bellows.disturbance import RigLaw
from hil.reference.bellows.mechanics import (
    ANGLE,
    ARM,
    BULGE_AT_ZERO,
    CREEP_SHARE,
    CREEPS,
    CREPT,
    HEAT,
    OPEN,
    SPEED,
    STATES,
    STOP,
    STOPS,
    bulge,
    crept,
    half_angle,
    place,
    pouch_volume,
    step_joint,
)
from hil.reference.bellows.physics import ATMOSPHERE_MPA, Physics
from hil.reference.bellows.pneumatics import (
    INFLOW,
    LADDER,
    MUSCLE,
    OUTLET,
    PHASE,
    PILOT,
    TANK,
    VALVE_STATES,
    set_point,
    step_manifold,
    step_regulator,
    step_tank,
)
from hil.reference.compiling import Array, State, compiled


@compiled
def rest(p1_mpa: float, p2_mpa: float, warm: float, physics: Physics, rig: RigLaw) -> Array:
    """The state after a long time at these gauge pressures, but for friction: the joint at zero, chambers filled."""
    s = np.zeros(STATES)
    for valve in range(2):
        p, at = (p1_mpa if valve == 0 else p2_mpa), valve * VALVE_STATES
        s[at + PILOT] = s[at + OUTLET] = s[at + MUSCLE] = p + ATMOSPHERE_MPA
        s[at + PHASE] = 0.5 * valve * physics.sample_s
        for rung in range(3):
            s[at + LADDER + rung] = p
        for k in range(CREEPS):
            s[CREPT + CREEPS * valve + k] = CREEP_SHARE[k] * crept(p / half_angle(physics.contraction), physics, rig)
        s[HEAT + valve] = 0.3 * warm
    s[TANK], s[BULGE_AT_ZERO] = physics.main_mpa, bulge(half_angle(physics.contraction))
    return s


@compiled
def muscle_air(muscle: int, s: State, physics: Physics, rig: RigLaw) -> tuple[float, float]:
    """(a muscle's volume against one of the build at angle zero, its rate per second)."""
    volume, slope = pouch_volume(s[OPEN + muscle], s[BULGE_AT_ZERO], physics)
    wide = 1.0 + (rig.wide_1 if muscle == 0 else rig.wide_2)
    return wide * volume, wide * slope * (1.0 - 2.0 * muscle) * s[ARM + muscle] * s[SPEED] / physics.length_m


@compiled
def step(set_1: float, set_2: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """All of the rig by one internal step."""
    place(s, physics)
    demand = let_out = 0.0
    for valve in range(2):
        target = set_point(set_1 if valve == 0 else set_2, valve, s, rig, dt_s)
        volume, rate = muscle_air(valve, s, physics, rig)
        taken, given = step_regulator(target, volume, rate, valve, s, physics, rig, dt_s)
        demand, let_out = demand + taken, let_out + given
    step_tank(demand, s, physics, rig, dt_s)
    step_manifold(let_out, s, rig, dt_s)
    p1, p2 = s[MUSCLE] - ATMOSPHERE_MPA, s[VALVE_STATES + MUSCLE] - ATMOSPHERE_MPA
    step_joint(p1, p2, s[INFLOW], s[INFLOW + 1], s, physics, rig, dt_s)


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
    that leave +-1.4 rad end the record as NaN: there a cam has no more tendon.
    """
    n = len(set_1_mpa) // substeps
    out = np.full((3, n), np.nan)
    s: Any = rest(set_1_mpa[0], set_2_mpa[0], warm, physics, rig)
    for i in range(settling):
        step(set_1_mpa[0], set_2_mpa[0], s, physics, rig, dt_s)
        if i == settling // 2:
            for k in range(2 * STOPS):
                s[STOP + k] = 0.0
    for k in range(n):
        if not math.fabs(s[ANGLE]) < 1.4:
            break
        out[0, k] = s[OUTLET] - ATMOSPHERE_MPA
        out[1, k] = s[VALVE_STATES + OUTLET] - ATMOSPHERE_MPA
        out[2, k] = s[ANGLE]
        for i in range(k * substeps, (k + 1) * substeps):
            step(set_1_mpa[i], set_2_mpa[i], s, physics, rig, dt_s)
    return out
