"""This family's equations of motion over a whole record, compiled. Noise-free but for what is on the set-points."""

import math
from typing import Any

import numpy as np

from hil.reference.compiling import Array, State, compiled
from hil.reference.pleated.disturbance import RigLaw
from hil.reference.pleated.mechanics import (
    AGE,
    ANGLE,
    ARM,
    FOLD,
    HEAT,
    SPEED,
    STATES,
    STRAIN,
    TAKEN,
    crept,
    muscle_force,
    place,
    reach,
    step_joint,
)
from hil.reference.pleated.physics import ATMOSPHERE_MPA, Physics
from hil.reference.pleated.pneumatics import (
    AIR,
    CROSS,
    ENERGY,
    LAG_1,
    OUTLET,
    PLAY,
    RAMP,
    SUPPLY,
    VALVE_STATES,
    acting_pressure,
    cross_talk,
    set_point,
    step_supply,
    step_valve,
)


@compiled
def rest(p1_mpa: float, p2_mpa: float, warm: float, physics: Physics, rig: RigLaw) -> Array:
    """The state after a long time at these gauge pressures, but for friction: the joint at zero, chambers filled."""
    s = np.zeros(STATES)
    for valve in range(2):
        p, at = (p1_mpa if valve == 0 else p2_mpa), valve * VALVE_STATES
        s[at + OUTLET] = s[at + AIR] = s[at + ENERGY] = p + ATMOSPHERE_MPA
        for pole in range(3):
            s[at + LAG_1 + pole] = p
        s[at + RAMP] = s[at + PLAY] = p
        s[STRAIN + valve] = crept(muscle_force(p, physics.contraction, 0.0, physics), physics, rig)
    s[SUPPLY], s[CROSS] = physics.main_mpa, p1_mpa
    s[HEAT], s[AGE] = 0.3 * warm, 1.0
    return s


@compiled
def relative_volume(contraction: float, physics: Physics) -> tuple[float, float]:
    """(a muscle's volume against that at angle zero, its slope by contraction)."""
    c0 = physics.contraction
    at_zero = 1.0 + physics.swell * c0 - physics.swell_square * c0 * c0
    own = 1.0 + physics.swell * contraction - physics.swell_square * contraction * contraction
    return own / at_zero, (physics.swell - 2.0 * physics.swell_square * contraction) / at_zero


@compiled
def step(
    set_1: float, set_2: float, time_s: float, span: float, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> None:
    """All of the rig by one internal step; `span`: distance of a muscle's ends at angle zero (m)."""
    place(span, s, physics)
    demand = worked = p1 = p2 = 0.0
    target_1 = set_point(set_1, 0, time_s, s, rig, dt_s)
    target_2 = set_point(set_2, 1, time_s, s, rig, dt_s) + cross_talk(target_1, s, rig, dt_s)
    for valve in range(2):
        volume, slope = relative_volume(physics.contraction + s[TAKEN + valve] / physics.length_m, physics)
        rate = slope * (1.0 - 2.0 * valve) * s[ARM + valve] * s[SPEED] / physics.length_m
        before = s[valve * VALVE_STATES + AIR]
        demand += step_valve(target_1 if valve == 0 else target_2, volume, rate, valve, s, physics, rig, dt_s)
        worked += abs(s[valve * VALVE_STATES + AIR] - before) / dt_s
        acting = acting_pressure(valve, volume, s, rig)
        if valve == 0:
            p1 = acting
        else:
            p2 = acting
    step_supply(demand, s, physics, rig, dt_s)
    step_joint(p1, p2, worked, s, physics, rig, dt_s)


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

    A tick is read before its own set-point acts, which it does `physics.dead_s` later. `settling` internal steps at the
    first set-points come first; angles that leave +-1.3 rad end the record as NaN: there a crank has no arm.
    """
    n, dead = len(set_1_mpa) // substeps, round(physics.dead_s / dt_s)
    out = np.full((3, n), np.nan)
    s: Any = rest(set_1_mpa[0], set_2_mpa[0], warm, physics, rig)
    span = reach(0.0, 1.0, physics)[0]
    for i in range(settling):
        step(set_1_mpa[0], set_2_mpa[0], -1.0, span, s, physics, rig, dt_s)
        if i == settling // 2:
            for muscle in range(2):
                s[FOLD + muscle] = 0.0
    for k in range(n):
        if not math.fabs(s[ANGLE]) < 1.3:
            break
        out[0, k] = s[OUTLET] - ATMOSPHERE_MPA
        out[1, k] = s[VALVE_STATES + OUTLET] - ATMOSPHERE_MPA
        out[2, k] = s[ANGLE]
        for i in range(k * substeps, (k + 1) * substeps):
            early = max(0, i - dead)
            step(set_1_mpa[early], set_2_mpa[early], i * dt_s, span, s, physics, rig, dt_s)
    return out
