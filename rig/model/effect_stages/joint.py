"""Effects of the joint; block stages as in `timing`.

Friction, mass and weight act against the stiffness of the muscles, which rises with their mean pressure and towards the
ends of the motion: sizes hold at p0_mpa and 0 deg, and are scaled by 2 p0 / (p1 + p2) and by the nominal joint's
compliance. Backlash, a mere distance, is not; sweeps at several P0 tell them apart by
that.
"""

import math
from collections.abc import Sequence

from rig.model.equations.joint_balance import (
    AT_REST_S,
    STATE_SIZE,
    balanced_angle,
    equilibrium_angle,
    nominal_compliance,
)
from rig.model.slots import Values


def balance_again(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The joint's balance (`rig.model.equations.joint_balance`) solved once more with something added: dry or viscous
    friction, mass, a weight.

    y is the nominal angle. From it and from the nominal joint follows the angle to which the muscles pull; the same
    balance with the added terms is then solved for the new angle. Nothing added: y as it was.
    params: width_deg, tau_s, time_s, load_deg, phase_deg, p0_mpa, viscous_time_s, inertia_time_s, loop_1..5, softer,
    softer_out, presliding_deg. state: see `joint_balance.STATE_SIZE`.
    """
    for i in range(len(y)):
        compliance = nominal_compliance(y[i], params) * 2.0 * params[5] / max(p1[i] + p2[i], 0.02)
        if state[0] == 0.0:
            state[0], state[1], state[3] = 1.0, y[i], y[i]
            balanced_angle(y[i], compliance, 1.0, state, params, AT_REST_S)
        pulled_to = equilibrium_angle(y[i], state, params, dt_s)
        y[i] = balanced_angle(pulled_to, compliance, 1.0, state, params, dt_s)


def stiffness(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The joint is held by another stiffness, or a servo by another loop gain, while it is sent to the same angles:
    all that stands against the stiffness (dry and viscous friction, inertia, a weight) counts 1 / (1 + stiffness)
    times. With `spring` the muscles are held against as well: a spring beside the joint, at rest at 0 deg, or one that
    comes to rest where the joint is, in relax_s (Maxwell's element, as rubber and fabric creep). A spring is as stiff
    at every pressure, so that it counts less where the muscles are stiffer.

    The stiffness may rise steadily, as that of muscles that warm up. The nominal angle already holds the weight
    `load_deg`; params: those of `balance_again`, then stiffness, spring (0 or 1), rise_per_min, relax_s.
    """
    radian = math.pi / 180.0
    comes = 1.0 - math.exp(-dt_s / params[19]) if params[19] > 0.0 else 0.0
    for i in range(len(y)):
        if state[0] == 0.0:
            state[0], state[1], state[3] = 1.0, y[i], y[i]
            state[STATE_SIZE + 1] = y[i] if params[19] > 0.0 else 0.0
        compliance = nominal_compliance(y[i], params) * 2.0 * params[5] / max(p1[i] + p2[i], 0.02)
        against = 1.0 + params[17] * (compliance - 1.0)
        counts = 1.0 / max(1.0 + against * (params[16] + params[18] * state[STATE_SIZE] / 60.0), 0.1)
        state[STATE_SIZE] += dt_s
        weight = params[3] * math.sin((y[i] + params[4]) * radian) if params[3] != 0.0 else 0.0
        pulled_to = equilibrium_angle(y[i], state, params, dt_s) + weight
        held = pulled_to + params[17] * (1.0 - counts) * (state[STATE_SIZE + 1] - pulled_to)
        y[i] = balanced_angle(held, counts, counts, state, params, dt_s)
        state[STATE_SIZE + 1] += comes * (y[i] - state[STATE_SIZE + 1])


def backlash(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """Play between joint and load or sensor; params: width_deg (half of the whole play)."""
    for i in range(len(y)):
        if state[0] == 0.0:
            state[0], state[1] = 1.0, y[i]
        state[1] = min(max(state[1], y[i] - params[0]), y[i] + params[0])
        y[i] = state[1]


def end_stop(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The joint meets a stop and yields by the share give beyond it; params: high_deg, low_deg, give."""
    for i in range(len(y)):
        if y[i] > params[0]:
            y[i] = params[0] + params[2] * (y[i] - params[0])
        elif y[i] < params[1]:
            y[i] = params[1] + params[2] * (y[i] - params[1])
