"""The joint's balance: muscles that pull to an angle, against Maxwell-slip friction, viscous friction, inertia and a
load.

    y + sum_j w_j stop_j(y) + T_v y' + T_i^2 y'' + (added terms) = F,

everything over the joint's stiffness at P0, so that every size is an angle (deg) or a time (s). w_j are the
Maxwell-slip weights, stop_j the deflection of an element that slips after about LOOP_RADII_DEG[j], part by part, T_v
the viscous and T_i the inertia time, F the equilibrium angle to which the muscles pull. Effects solve the balance once
more with something added (decision 0501); the diagnosis solves it with the equilibrium angle offset and the compliance
changed. Both use the functions below, which numba compiles; on whole columns:
`rig.model.compiled.columns.balanced`.
"""

import math
from collections.abc import Sequence

from rig.model.slots import StageNumbers, Values

LOOP_RADII_DEG = (0.3, 1.0, 3.0, 8.0, 20.0)
"""Travel after which each Maxwell-slip element of the nominal joint slips."""
SPREAD = (0.35, 0.6, 1.0, 1.7, 2.9)
"""No friction slips all at once: an element's parts, of equal force, slip after so many times its travel. Fewer: what
an effect changes has corners that no rig shows (docs/decisions/0564)."""
REACHES_DEG = StageNumbers(radius * share for radius in LOOP_RADII_DEG for share in SPREAD)
"""Travel after which each part slips."""
SHARES = StageNumbers(1.0 / (len(SPREAD) * share) for _ in LOOP_RADII_DEG for share in SPREAD)
"""Stiffness of each part over its element's weight."""
FULL = StageNumbers(share * radius for share, radius in zip(SHARES, REACHES_DEG, strict=True))
"""What a part that slips carries over its element's weight, deg."""
ELEMENTS, PARTS, OF_AN_ELEMENT = len(LOOP_RADII_DEG), len(REACHES_DEG), len(SPREAD)
TRAVELLED, FORCE, STIFFNESS, LEAST, MOST, FORWARDS, BACKWARDS = range(PARTS, PARTS + 7)
"""Where in the state of a joint's friction, behind its parts' deflections, stands how far the joint has moved since
these were taken, and the straight line that its friction follows meanwhile: see `on_its_line`."""
OF_A_FRICTION = PARTS + 7
"""Numbers in the state for one friction: the deflections of its parts, and the seven above."""
OWN, NEW, DRY = 5, 5 + OF_A_FRICTION, 5 + 2 * OF_A_FRICTION
"""Where in the state the nominal friction begins, the new one, and the deflection of what is added."""
PRESLIDING_DEG = 0.05
"""Travel over which added dry friction builds up where nothing else is said (`presliding_deg`): bare metal gives less
than that before it slips, a joint on rubber, bristles or a band up to several degrees."""
MOST_STEPS = 60
"""Newton's steps, or halvings of the interval that holds the angle; three or four are usual."""
OWN_BEFORE, NEW_BEFORE = DRY + 1, DRY + 2
"""Where in the state the speeds of the tick before the last one stand, nominal and new."""
STATE_SIZE = DRY + 3
"""Started, nominal angle and speed, new angle and speed, those deflections, and those speeds."""
EXACT_DEG = 1e-7
"""How exactly the balance holds."""
AT_REST_S = 1e6
"""A tick so long that speed and acceleration count for nothing: where a record starts, the joint has come to rest from
where it was, held by its friction."""
LEAST_COMPLIANCE = 0.5
"""Of a joint at its ends over that in the middle, and the inverse of the most: far from where it was fitted a
polynomial goes anywhere."""
MOST_SOFTER_PER_DEG, MOST_SOFTER_PER_DEG2 = 0.1, 0.01
"""How much the compliance of the nominal joint may grow with the angle, over that in the middle, to the first and the
second order (`softer`, `softer_out`): a joint is twice as soft within 10 degrees. More: a curve that was fitted to
little motion makes a joint of no stiffness."""
LEAST_DAMPING = 0.05
"""Damping ratio that an added mass has at least: rubber and fabric give back no more than nine tenths of what a swing
puts into them (a loss factor of 0.1, as natural rubber has; docs/decisions/0682). Less: behind a joint without
friction of its own a mass rings through a whole record, which none does on a rig."""
NOTHING_ADDED = (0.0, 0.0, 0.0, 0.0, 0.0)
"""width_deg, tau_s, time_s, load_deg, phase_deg of a joint without added terms."""


def on_its_line(step: float, state: Values, at: int, params: Sequence[float]) -> None:
    """Makes the friction that stands `at` a place of the state follow the line on which it is after a step of so many
    degrees.

    Where no part begins or ends to slip, friction is a straight line over the travel t since the deflections were
    taken: FORCE + STIFFNESS t, from LEAST to MOST. Most ticks stay on the line of the tick before; only a step beyond
    its ends asks all parts.
    """
    to = state[at + TRAVELLED] + step
    if state[at + LEAST] <= to <= state[at + MOST] and state[at + LEAST] < state[at + MOST]:
        return
    force, stiffness, least, most, forwards, backwards = 0.0, 0.0, -math.inf, math.inf, 0.0, 0.0
    for j in range(ELEMENTS):
        if params[8 + j] == 0.0:  # carries nothing, wherever its parts stand
            continue
        stop, slope = 0.0, 0.0
        for k in range(OF_AN_ELEMENT * j, OF_AN_ELEMENT * (j + 1)):
            held = deflection(k, state, at)
            state[at + k] = held
            if held + step >= REACHES_DEG[k]:
                stop += FULL[k]
                least, forwards = max(least, REACHES_DEG[k] - held), 1.0
            elif held + step <= -REACHES_DEG[k]:
                stop -= FULL[k]
                most, backwards = min(most, -REACHES_DEG[k] - held), 1.0
            else:
                stop += SHARES[k] * (held + step)
                slope += SHARES[k]
                least, most = max(least, -REACHES_DEG[k] - held), min(most, REACHES_DEG[k] - held)
        force += params[8 + j] * stop
        stiffness += params[8 + j] * slope
    state[at + TRAVELLED], state[at + FORCE], state[at + STIFFNESS] = 0.0, force - stiffness * step, stiffness
    state[at + LEAST], state[at + MOST] = least, most
    state[at + FORWARDS], state[at + BACKWARDS] = forwards, backwards


def deflection(part: int, state: Values, at: int) -> float:
    """Of one part of the friction `at` a place of the state, deg."""
    reach = REACHES_DEG[part]
    return min(max(state[at + part] + state[at + TRAVELLED], -reach), reach)


def moved_on(step: float, state: Values, at: int, params: Sequence[float]) -> float:
    """Steps the friction `at` a place of the state on by so many degrees; what it carries there, deg. A part that slips
    sticks as soon as the joint turns back, where the line ends."""
    on_its_line(step, state, at, params)
    to = state[at + TRAVELLED] + step
    state[at + TRAVELLED] = to
    if state[at + FORWARDS] > 0.0:
        state[at + LEAST] = to
    if state[at + BACKWARDS] > 0.0:
        state[at + MOST] = to
    return state[at + FORCE] + state[at + STIFFNESS] * to


def acceleration(speed: float, before: float, earlier: float, ticks_per_s: float) -> float:
    """Of a tick (deg/s^2), by its speed and those of the two ticks before, each the difference of two angles.

    Implicit and of second order (Houbolt, J. Aeronautical Sciences 17, 1950): stable for every step, and a mass rings
    as long as it does on a rig. The difference of two speeds is the acceleration of a tick ago, and damps as viscous
    friction of a whole tick does (docs/decisions/0682).
    """
    return (2.0 * speed - 3.0 * before + earlier) * ticks_per_s


def equilibrium_angle(y: float, state: Values, params: Sequence[float], dt_s: float) -> float:
    """The angle F (deg) to which the muscles pull, from the nominal angle y; steps the nominal half of `state` on by
    one tick."""
    ticks_per_s = 1.0 / dt_s
    step = y - state[1]
    speed = step * ticks_per_s
    faster = acceleration(speed, state[2], state[OWN_BEFORE], ticks_per_s)
    out = y + params[6] * speed + params[7] * params[7] * faster
    out += moved_on(step, state, OWN, params)
    state[1], state[2], state[OWN_BEFORE] = y, speed, state[2]
    return out


def nominal_compliance(y: float, params: Sequence[float]) -> float:
    """How far a torque turns the nominal joint at the angle y (deg), over how far it does at 0."""
    return min(max(1.0 + y * (params[13] + y * params[14]), LEAST_COMPLIANCE), 1.0 / LEAST_COMPLIANCE)


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
    weights; then what `nominal_compliance` takes, and presliding_deg. A mass that is added has LEAST_DAMPING at least.
    Below zero, width_deg, tau_s and time_s take off what the nominal joint has of that, down to nothing.
    """
    radian, ticks_per_s = math.pi / 180.0, 1.0 / dt_s
    lost = 2.0 * LEAST_DAMPING * math.sqrt(compliance) * max(params[2], 0.0)
    viscous = max(friction * params[6] + compliance * params[1], lost) * ticks_per_s
    inertia = max(friction * params[7] * params[7] + compliance * params[2] * abs(params[2]), 0.0)
    moving = 1.0 + viscous + 2.0 * inertia * ticks_per_s * ticks_per_s
    gives = params[15] if params[0] > 0.0 else PRESLIDING_DEG
    dry = compliance * max(params[0], 0.0) / gives
    load = compliance * params[3]
    slip = friction * kept_slip(params, compliance)
    old, rate, earlier = state[3], state[4], state[NEW_BEFORE]
    new = old + rate * dt_s
    below, above = -math.inf, math.inf
    for _ in range(MOST_STEPS):
        step = new - old
        on_its_line(step, state, NEW, params)
        moved, added = state[NEW + TRAVELLED] + step, state[DRY] + step
        miss = new - equilibrium + viscous * step
        miss += inertia * acceleration(step * ticks_per_s, rate, earlier, ticks_per_s)
        miss += slip * (state[NEW + FORCE] + state[NEW + STIFFNESS] * moved)
        slope = moving + slip * state[NEW + STIFFNESS]
        if dry > 0.0:
            miss += dry * min(max(added, -gives), gives)
            slope += dry if abs(added) < gives else 0.0
        if load != 0.0:  # a sine and a cosine take as long as all the rest
            turned = (new + params[4]) * radian
            miss += load * math.sin(turned)
            slope += load * radian * math.cos(turned)
        change = miss / max(slope, 0.1)
        if abs(change) < EXACT_DEG:
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
        elif (
            state[NEW + LEAST] <= moved - change <= state[NEW + MOST]
            and (dry == 0.0 or sticks(added, gives) == sticks(added - change, gives))
            and 0.5 * abs(load) * radian * radian * change * change < EXACT_DEG
        ):
            break  # but for the load the balance is a straight line between the two, on which Newton's step is exact
    step = new - old
    moved_on(step, state, NEW, params)
    state[DRY] = min(max(state[DRY] + step, -gives), gives)
    state[3], state[4], state[NEW_BEFORE] = new, step * ticks_per_s, rate
    return new


def sticks(deflection_deg: float, gives_deg: float) -> int:
    """0 where added dry friction, which gives by so much before it slips, sticks, else which way it slips."""
    return int(deflection_deg >= gives_deg) - int(deflection_deg <= -gives_deg)


def equilibrium_angles(
    y: Sequence[float], pulled_to: Values, _: Values, state: Values, params: Sequence[float], dt_s: float
) -> None:
    """The equilibrium angle of every row, into `pulled_to`, under which the nominal joint has the angles y."""
    for i in range(len(y)):
        if state[0] == 0.0:
            state[0], state[1] = 1.0, y[i]
        pulled_to[i] = equilibrium_angle(y[i], state, params, dt_s)


def balanced_angles(
    y: Values,
    pulled_to: Sequence[float],
    friction: Sequence[float],
    state: Values,
    params: Sequence[float],
    dt_s: float,
) -> None:
    """The joint's angles under these equilibrium angles, its friction `friction` times, in place of the nominal ones y,
    the first of which is where it comes from before it rests."""
    for i in range(len(y)):
        if state[0] == 0.0:
            state[0], state[3] = 1.0, y[i]
            balanced_angle(pulled_to[i], 1.0, friction[i], state, params, AT_REST_S)
        y[i] = balanced_angle(pulled_to[i], 1.0, friction[i], state, params, dt_s)
