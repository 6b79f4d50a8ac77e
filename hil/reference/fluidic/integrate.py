"""This family's equations of motion over a whole record, compiled. Noise-free but for what is on the set-points."""

import math
from typing import Any

import numpy as np

from hil.reference.compiling import Array, State, compiled
from hil.reference.fluidic.disturbance import RigLaw
from hil.reference.fluidic.mechanics import ANGLE, CREEP, HEAT, MESH, SPEED, STATES, step_joint, stroke
from hil.reference.fluidic.physics import ATMOSPHERE_MPA, Physics
from hil.reference.fluidic.pneumatics import (
    FILTER_1,
    FILTER_2,
    OPENING,
    OUTLET,
    PRESSURE,
    RAMP,
    VALVE_STATES,
    control,
    set_point,
    step_valve,
)

CONTROL_STEPS = 2
"""Internal steps a sample of the regulators' controllers."""


@compiled
def rest(p1_mpa: float, p2_mpa: float, warm: float) -> Array:
    """The state after a long time at these gauge pressures, but for friction: the joint at zero, chambers filled."""
    s = np.zeros(STATES)
    for valve in range(2):
        p, at = (p1_mpa if valve == 0 else p2_mpa), valve * VALVE_STATES
        s[at + PRESSURE] = s[at + OUTLET] = p + ATMOSPHERE_MPA
        s[at + FILTER_1] = s[at + FILTER_2] = s[at + RAMP] = p
    s[HEAT] = 0.3 * warm
    return s


@compiled
def relative_volume(contraction: float, physics: Physics) -> tuple[float, float]:
    """(a muscle's volume against that at angle zero, its slope by contraction)."""
    c0 = physics.contraction
    own = 1.0 + physics.swell * contraction - physics.swell_square * contraction * contraction
    at_zero = 1.0 + physics.swell * c0 - physics.swell_square * c0 * c0
    return own / at_zero, (physics.swell - 2.0 * physics.swell_square * contraction) / at_zero


@compiled
def step(set_1: float, set_2: float, sample: bool, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """All of the rig by one internal step; `sample`: the regulators' controllers look and decide."""
    filling = max(0.0, s[OPENING]) + max(0.0, s[VALVE_STATES + OPENING])
    supply = min(physics.main_mpa, rig.supply_mpa + ATMOSPHERE_MPA) - rig.hose_drop_mpa * 0.25 * filling * filling
    supply = max(0.12, supply)
    for valve in range(2):
        at, side = valve * VALVE_STATES, 1.0 if valve == 0 else -1.0
        target = set_point(set_1 if valve == 0 else set_2, valve, s, at, rig, dt_s)
        if sample:
            control(target, s, at, physics, rig, CONTROL_STEPS * dt_s)
        contraction = physics.contraction + stroke(s[ANGLE], side, physics) / physics.length_m
        volume, slope = relative_volume(contraction, physics)
        arm = side * physics.lever_m * math.cos(s[ANGLE] + side * physics.lever_rad)
        step_valve(volume, slope * arm * s[SPEED] / physics.length_m, valve, supply, s, physics, rig, dt_s)
    p1, p2 = s[PRESSURE] - ATMOSPHERE_MPA, s[VALVE_STATES + PRESSURE] - ATMOSPHERE_MPA
    step_joint(p1, p2, s, physics, rig, dt_s)


@compiled
def settle(set_1: float, set_2: float, steps: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """So many steps at these set-points; on half of the way what is slow is put where it goes."""
    for i in range(steps):
        step(set_1, set_2, i % CONTROL_STEPS == 0, s, physics, rig, dt_s)
        if i == steps // 2:
            share = 0.5 * rig.creep + physics.creep
            for muscle in range(2):
                taken = share * stroke(s[ANGLE], 1.0 if muscle == 0 else -1.0, physics)
                s[CREEP + 2 * muscle] = s[CREEP + 2 * muscle + 1] = taken
            for k in range(4):
                s[MESH + k] = 0.0


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
    """Set-points on the internal grid, shape (n * substeps,) gauge MPa -> (3, n): p1, p2 at the muscles (gauge MPa),
    angle (rad).

    A tick is read before its own set-point acts. `settling` internal steps at the first set-points come first; angles
    that leave +-1.4 rad end the record as NaN: there a lever has no arm.
    """
    n = len(set_1_mpa) // substeps
    out = np.full((3, n), np.nan)
    s: Any = rest(set_1_mpa[0], set_2_mpa[0], warm)
    settle(set_1_mpa[0], set_2_mpa[0], settling, s, physics, rig, dt_s)
    for k in range(n):
        if not math.fabs(s[ANGLE]) < 1.4:
            break
        out[0, k] = s[PRESSURE] - ATMOSPHERE_MPA
        out[1, k] = s[VALVE_STATES + PRESSURE] - ATMOSPHERE_MPA
        out[2, k] = s[ANGLE]
        for i in range(k * substeps, (k + 1) * substeps):
            step(set_1_mpa[i], set_2_mpa[i], i % CONTROL_STEPS == 0, s, physics, rig, dt_s)
    return out
