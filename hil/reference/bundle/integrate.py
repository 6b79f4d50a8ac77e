"""This family's equations of motion over a whole record, compiled. Noise-free but for what is on the set-points."""

import math
from typing import Any

import numpy as np

from hil.reference.bundle.disturbance import RigLaw
from hil.reference.bundle.mechanics import (
    ANGLE,
    ARM,
    BELT,
    BOB,
    CREPT,
    GEL,
    HEAT,
    PRESSURE,
    SPEED,
    STATES,
    TENSION,
    VOLUME_AT_ZERO,
    contraction_of,
    crept_goal,
    place,
    set_out,
    step_joint,
    torn_share,
)
from hil.reference.bundle.physics import ATMOSPHERE_MPA, Physics
from hil.reference.bundle.pneumatics import (
    AIR,
    OUTLET,
    PROFILE,
    SIGNAL,
    SLOW,
    SUPPLY,
    VALVE_STATES,
    gauge_mpa,
    set_point,
    step_regulator,
    step_supply,
)
from hil.reference.bundle.strands import bundle_air, bundle_force, cavity, slit_opening
from hil.reference.compiling import Array, State, compiled

MOST_RAD = 1.2
"""Beyond, a bundle has no more belt to take up."""


@compiled
def bundle_volume(bundle: int, time_s: float, s: State, physics: Physics, rig: RigLaw) -> tuple[float, float]:
    """(a bundle's volume against one of the build at angle zero, its rate per second)."""
    volume, slope = bundle_air(contraction_of(bundle, s, physics), s[VOLUME_AT_ZERO], physics)
    strands = (1.0 - torn_share(bundle, time_s, rig)) * (1.0 + rig.stiff)
    shortening_s = (1.0 - 2.0 * bundle) * s[ARM + bundle] * s[SPEED] / physics.length_m
    return strands * volume, strands * slope * shortening_s


@compiled
def rest(p1_mpa: float, p2_mpa: float, warm: float, physics: Physics, rig: RigLaw) -> Array:
    """The state after a long time at these gauge pressures, but for friction: the joint at zero, bundles filled."""
    s: Any = np.zeros(STATES)
    s[SUPPLY], s[GEL], s[BOB] = physics.main_mpa, 1.0, math.sin(rig.bob_rad)
    s[VOLUME_AT_ZERO] = cavity(1.0 - physics.contraction, physics)[0]
    place(s, physics, rig)
    for bundle in range(2):
        p, at = (p1_mpa if bundle == 0 else p2_mpa), bundle * VALVE_STATES
        force = bundle_force(p, contraction_of(bundle, s, physics), 0.0, physics)
        s[TENSION + bundle], s[BELT + bundle] = force, force / physics.belt_n_m
        s[CREPT + bundle], s[HEAT + bundle] = crept_goal(force, physics, rig), warm
        s[at + OUTLET] = p + ATMOSPHERE_MPA
        s[at + AIR] = s[at + OUTLET] * bundle_volume(bundle, -1.0, s, physics, rig)[0]
        s[at + SIGNAL] = s[at + PROFILE] = s[at + SLOW] = p
    return np.asarray(s)


@compiled
def step(set_1: float, set_2: float, time_s: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """All of the rig by one internal step."""
    place(s, physics, rig)
    demand = 0.0
    for valve in range(2):
        target = set_point(set_1 if valve == 0 else set_2, valve, s, rig, dt_s)
        volume, rate = bundle_volume(valve, time_s, s, physics, rig)
        slit = slit_opening(contraction_of(valve, s, physics), physics) if rig.leak_1 + rig.leak_2 > 0.0 else 0.0
        demand += step_regulator(target, volume, rate, slit, valve, s, physics, rig, dt_s)
        s[PRESSURE + valve] = gauge_mpa(valve, volume, s)
    step_supply(demand, time_s, s, physics, rig, dt_s)
    step_joint(time_s, s, physics, rig, dt_s)


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

    A tick is read before its own set-point acts. `settling` internal steps at the first set-points come first, half-way
    through which the yarns' friction is forgotten; angles that leave +-1.2 rad end the record as NaN.
    """
    n = len(set_1_mpa) // substeps
    out = np.full((3, n), np.nan)
    s: Any = rest(set_1_mpa[0], set_2_mpa[0], warm, physics, rig)
    for i in range(settling):
        step(set_1_mpa[0], set_2_mpa[0], -1.0, s, physics, rig, dt_s)
        if i == settling // 2:
            set_out(s)
    for k in range(n):
        if not math.fabs(s[ANGLE]) < MOST_RAD:
            break
        out[0, k] = s[OUTLET] - ATMOSPHERE_MPA
        out[1, k] = s[VALVE_STATES + OUTLET] - ATMOSPHERE_MPA
        out[2, k] = s[ANGLE]
        for i in range(k * substeps, (k + 1) * substeps):
            step(set_1_mpa[i], set_2_mpa[i], i * dt_s, s, physics, rig, dt_s)
    return out
