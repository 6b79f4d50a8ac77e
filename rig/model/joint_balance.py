"""The joint's balance: muscles that pull to an angle, against Maxwell-slip friction, viscous friction, inertia and a
load.

    y + sum_j w_j stop_j(y) + T_v y' + T_i^2 y'' + (added terms) = F,

everything over the joint's stiffness at P0, so that every size is an angle (deg) or a time (s). w_j are the
Maxwell-slip weights, stop_j the deflection of an element that slips after LOOP_RADII_DEG[j], T_v the viscous and T_i
the inertia time, F the equilibrium angle to which the muscles pull. Effects solve the balance once more with something
added (decision 0501); the diagnosis solves it with the equilibrium angle offset and the compliance changed. Both use
the functions below, which numba compiles; on whole columns: `rig.model.kernels.balanced`.
"""

import math
from collections.abc import Sequence

from rig.model.slots import Values

LOOP_RADII_DEG = (0.3, 1.0, 3.0, 8.0, 20.0)
"""Travel after which each Maxwell-slip element of the nominal joint slips."""
PRESLIDING_DEG = 0.05
"""Travel over which added dry friction builds up."""
STATE_SIZE = 16
"""Started, nominal angle and speed, new angle and speed, stops of the nominal loop (5), of the new one (5), of the dry
friction."""
NOTHING_ADDED = (0.0, 0.0, 0.0, 0.0, 0.0)
"""width_deg, tau_s, time_s, load_deg, phase_deg of a joint without added terms."""


def equilibrium_angle(y: float, state: Values, params: Sequence[float], dt_s: float) -> float:
    """The angle F (deg) to which the muscles pull, from the nominal angle y; steps the nominal half of `state` on by
    one tick."""
    step = y - state[1]
    speed = step / dt_s
    out = y + params[6] * speed + params[7] * params[7] * (speed - state[2]) / dt_s
    for j in range(5):
        radius = LOOP_RADII_DEG[j]
        state[5 + j] = min(max(state[5 + j] + step, -radius), radius)
        out += params[8 + j] * state[5 + j]
    state[1], state[2] = y, speed
    return out


def kept_slip(params: Sequence[float], compliance: float) -> float:
    """Share of the nominal dry friction that is left where width_deg is negative."""
    if params[0] >= 0.0:
        return 1.0
    whole = 1e-9
    for j in range(5):
        whole += params[8 + j] * LOOP_RADII_DEG[j]
    return max(1.0 + compliance * params[0] / whole, 0.0)


def balanced_angle(
    equilibrium: float, compliance: float, friction: float, state: Values, params: Sequence[float], dt_s: float
) -> float:
    """The new angle (deg) at which the balance holds, implicitly, so that it is stable for every step; steps the new
    half of `state`.

    compliance: ratio by which the added terms count; friction: ratio by which the nominal friction and inertia count.
    params: width_deg, tau_s, time_s, load_deg, phase_deg, p0_mpa, viscous time, inertia time, the five Maxwell-slip
    weights. Below zero, width_deg, tau_s and time_s take off what the nominal joint has of that, down to nothing.
    """
    radian = math.pi / 180.0
    viscous = max(friction * params[6] + compliance * params[1], 0.0) / dt_s
    inertia = max(friction * params[7] * params[7] + compliance * params[2] * abs(params[2]), 0.0) / dt_s
    width = compliance * max(params[0], 0.0)
    slip = friction * kept_slip(params, compliance)
    old, rate = state[3], state[4]
    new = old + rate * dt_s
    for _ in range(12):
        step = new - old
        miss = new + viscous * step + inertia * (step / dt_s - rate) - equilibrium
        slope = 1.0 + viscous + inertia / dt_s
        for j in range(5):
            moved = state[10 + j] + step
            weight = slip * params[8 + j]
            miss += weight * min(max(moved, -LOOP_RADII_DEG[j]), LOOP_RADII_DEG[j])
            slope += weight if abs(moved) < LOOP_RADII_DEG[j] else 0.0
        moved = state[15] + step
        miss += width / PRESLIDING_DEG * min(max(moved, -PRESLIDING_DEG), PRESLIDING_DEG)
        slope += width / PRESLIDING_DEG if abs(moved) < PRESLIDING_DEG else 0.0
        turned = (new + params[4]) * radian
        miss += compliance * params[3] * math.sin(turned)
        slope += compliance * params[3] * radian * math.cos(turned)
        change = miss / max(slope, 0.1)
        new -= change
        if abs(change) < 1e-7:
            break
    step = new - old
    for j in range(5):
        state[10 + j] = min(max(state[10 + j] + step, -LOOP_RADII_DEG[j]), LOOP_RADII_DEG[j])
    state[15] = min(max(state[15] + step, -PRESLIDING_DEG), PRESLIDING_DEG)
    state[3], state[4] = new, step / dt_s
    return new


def balanced_angles(
    y: Values, offset: Sequence[float], friction: Sequence[float], state: Values, params: Sequence[float], dt_s: float
) -> None:
    """The joint's angles, in place: every row's equilibrium angle `offset` degrees further, its friction `friction`
    times."""
    for i in range(len(y)):
        if state[0] == 0.0:
            state[0], state[1], state[3] = 1.0, y[i], y[i] + offset[i]
        pulled_to = equilibrium_angle(y[i], state, params, dt_s) + offset[i]
        y[i] = balanced_angle(pulled_to, 1.0, friction[i], state, params, dt_s)
