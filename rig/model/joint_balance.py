"""The joint's balance: muscles that pull to an angle, against Maxwell-slip friction, viscous friction, inertia and a
load.

    y + sum_j w_j stop_j(y) + T_v y' + T_i^2 y'' + (added terms) = F,

everything over the joint's stiffness at P0, so that every size is an angle (deg) or a time (s). w_j are the
Maxwell-slip weights, stop_j the deflection of an element that slips after about LOOP_RADII_DEG[j], part by part, T_v
the viscous and T_i the inertia time, F the equilibrium angle to which the muscles pull. Effects solve the balance once
more with something added (decision 0501); the diagnosis solves it with the equilibrium angle offset and the compliance
changed. Both use the functions below, which numba compiles; on whole columns: `rig.model.kernels.balanced`.
"""

import math
from collections.abc import Sequence

from rig.model.slots import Row, Values

LOOP_RADII_DEG = (0.3, 1.0, 3.0, 8.0, 20.0)
"""Travel after which each Maxwell-slip element of the nominal joint slips."""
SPREAD = (0.35, 0.6, 1.0, 1.7, 2.9)
"""No friction slips all at once: an element's parts, of equal force, slip after so many times its travel. Fewer: what
an effect changes has corners that no rig shows (docs/decisions/0564)."""
REACHES_DEG = Row(radius * share for radius in LOOP_RADII_DEG for share in SPREAD)
"""Travel after which each part slips."""
SHARES = Row(1.0 / (len(SPREAD) * share) for _ in LOOP_RADII_DEG for share in SPREAD)
"""Stiffness of each part over its element's weight."""
FULL = Row(share * radius for share, radius in zip(SHARES, REACHES_DEG, strict=True))
"""What a part that slips carries over its element's weight, deg."""
ELEMENTS, PARTS, OF_AN_ELEMENT = len(LOOP_RADII_DEG), len(REACHES_DEG), len(SPREAD)
OWN, NEW, DRY = 5, 5 + PARTS, 5 + 2 * PARTS
"""Where in the state the deflections of the nominal parts begin, those of the new ones, and of the added friction."""
PRESLIDING_DEG = 0.05
"""Travel over which added dry friction builds up."""
MOST_STEPS = 60
"""Newton's steps, or halvings of the interval that holds the angle; three or four are usual."""
STATE_SIZE = DRY + 1
"""Started, nominal angle and speed, new angle and speed, and those deflections."""
AT_REST_S = 1e6
"""A tick so long that speed and acceleration count for nothing: where a record starts, the joint has come to rest from
where it was, held by its friction."""
NOTHING_ADDED = (0.0, 0.0, 0.0, 0.0, 0.0)
"""width_deg, tau_s, time_s, load_deg, phase_deg of a joint without added terms."""


def equilibrium_angle(y: float, state: Values, params: Sequence[float], dt_s: float) -> float:
    """The angle F (deg) to which the muscles pull, from the nominal angle y; steps the nominal half of `state` on by
    one tick."""
    ticks_per_s = 1.0 / dt_s
    step = y - state[1]
    speed = step * ticks_per_s
    out = y + params[6] * speed + params[7] * params[7] * (speed - state[2]) * ticks_per_s
    for k in range(PARTS):
        state[OWN + k] = min(max(state[OWN + k] + step, -REACHES_DEG[k]), REACHES_DEG[k])
    for j in range(ELEMENTS):
        carried = 0.0
        for k in range(OF_AN_ELEMENT * j, OF_AN_ELEMENT * (j + 1)):
            carried += SHARES[k] * state[OWN + k]
        out += params[8 + j] * carried
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


def own_friction(step: float, state: Values, params: Sequence[float]) -> tuple[float, float]:
    """What the joint's own parts carry (deg) after a step of so many degrees, and how much more a degree further."""
    force, stiffness = 0.0, 0.0
    for j in range(ELEMENTS):
        if params[8 + j] == 0.0:
            continue
        carried, steep = 0.0, 0.0
        for k in range(OF_AN_ELEMENT * j, OF_AN_ELEMENT * (j + 1)):
            moved = state[NEW + k] + step
            if abs(moved) < REACHES_DEG[k]:
                carried += SHARES[k] * moved
                steep += SHARES[k]
            else:
                carried += math.copysign(FULL[k], moved)
        force += params[8 + j] * carried
        stiffness += params[8 + j] * steep
    return force, stiffness


def slipping(step: float, state: Values) -> int:
    """How many parts slip forwards after a step of so many degrees, less those that slip backwards. Whatever slips
    forwards does so after a longer step too: between two steps with the same number no part begins or ends to slip."""
    count = int(state[DRY] + step >= PRESLIDING_DEG) - int(state[DRY] + step <= -PRESLIDING_DEG)
    for k in range(PARTS):
        moved = state[NEW + k] + step
        count += int(moved >= REACHES_DEG[k]) - int(moved <= -REACHES_DEG[k])
    return count


def step_on(new: float, state: Values, ticks_per_s: float) -> None:
    """Steps the new half of `state` on to an angle."""
    step = new - state[3]
    for k in range(PARTS):
        state[NEW + k] = min(max(state[NEW + k] + step, -REACHES_DEG[k]), REACHES_DEG[k])
    state[DRY] = min(max(state[DRY] + step, -PRESLIDING_DEG), PRESLIDING_DEG)
    state[3], state[4] = new, step * ticks_per_s


def balanced_angle(
    equilibrium: float, compliance: float, friction: float, state: Values, params: Sequence[float], dt_s: float
) -> float:
    """The new angle (deg) at which the balance holds, implicitly, so that it is stable for every step; steps the new
    half of `state`.

    compliance: ratio by which the added terms count; friction: ratio by which the nominal friction and inertia count.
    params: width_deg, tau_s, time_s, load_deg, phase_deg, p0_mpa, viscous time, inertia time, the five Maxwell-slip
    weights. Below zero, width_deg, tau_s and time_s take off what the nominal joint has of that, down to nothing.
    """
    radian, ticks_per_s = math.pi / 180.0, 1.0 / dt_s
    viscous = max(friction * params[6] + compliance * params[1], 0.0) * ticks_per_s
    inertia = max(friction * params[7] * params[7] + compliance * params[2] * abs(params[2]), 0.0) * ticks_per_s
    moving = 1.0 + viscous + inertia * ticks_per_s
    dry = compliance * max(params[0], 0.0) / PRESLIDING_DEG
    load = compliance * params[3]
    slip = friction * kept_slip(params, compliance)
    old, rate = state[3], state[4]
    new = old + rate * dt_s
    below, above = -math.inf, math.inf
    for _ in range(MOST_STEPS):
        step = new - old
        force, stiffness = own_friction(step, state, params)
        miss = new + viscous * step + inertia * (step * ticks_per_s - rate) - equilibrium + slip * force
        slope = moving + slip * stiffness
        if dry > 0.0:
            moved = state[DRY] + step
            miss += dry * min(max(moved, -PRESLIDING_DEG), PRESLIDING_DEG)
            slope += dry if abs(moved) < PRESLIDING_DEG else 0.0
        if load != 0.0:  # a sine and a cosine take as long as all the rest
            turned = (new + params[4]) * radian
            miss += load * math.sin(turned)
            slope += load * radian * math.cos(turned)
        change = miss / max(slope, 0.1)
        if abs(change) < 1e-7:
            new -= change
            break
        if miss > 0.0:
            above = min(above, new)
        else:
            below = max(below, new)
        new -= change
        # from beyond an element's reach Newton's step may lead past it to and fro for ever
        if not below < new < above:
            new = 0.5 * (below + above)
        elif load == 0.0 and slipping(step, state) == slipping(new - old, state):
            break  # the balance is a straight line between the two, on which Newton's step is exact
    step_on(new, state, ticks_per_s)
    return new


def balanced_angles(
    y: Values, offset: Sequence[float], friction: Sequence[float], state: Values, params: Sequence[float], dt_s: float
) -> None:
    """The joint's angles, in place: every row's equilibrium angle `offset` degrees further, its friction `friction`
    times."""
    for i in range(len(y)):
        if state[0] == 0.0:
            state[0], state[1], state[3] = 1.0, y[i], y[i]
            balanced_angle(y[i] + offset[i], 1.0, friction[i], state, params, AT_REST_S)
        pulled_to = equilibrium_angle(y[i], state, params, dt_s) + offset[i]
        y[i] = balanced_angle(pulled_to, 1.0, friction[i], state, params, dt_s)
