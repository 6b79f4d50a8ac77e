"""Effects of the joint; block stages as in `timing`.

Friction, mass and weight act against the stiffness of the muscles, which rises with their mean pressure: sizes hold at p0_mpa
and are scaled by 2 p0 / (p1 + p2). Backlash, a mere distance, is not; sweeps at several P0 tell them apart by that.
"""

import math
from collections.abc import Sequence

from rig.model.slots import Values

LOOP_RADII_DEG = (0.3, 1.0, 3.0, 8.0, 20.0)
"""Travel after which each Maxwell-slip element of the nominal joint slips."""
PRESLIDING_DEG = 0.05
"""Travel over which added dry friction builds up."""


def balance_again(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The joint's balance solved once more with something added: dry friction, drag, mass or a weight.

    y is the nominal angle. From it and from the nominal joint (a sum of Maxwell-slip elements `loop`, drag and mass, all over the
    stiffness) follows the angle to which the muscles pull, F = y + sum loop stop(y) + drag y' + sway^2 y''; the same balance with
    the added terms is then solved for the new angle, implicitly, so that it is stable for every step. Nothing added: y as it was.
    params: width_deg, tau_s, time_s, load_deg, phase_deg, p0_mpa, drag_s, sway_s, loop_1..5.
    state: started, nominal angle and speed, new angle and speed, stops of the nominal loop (5), of the new one (5), of the dry friction.
    """
    radian = math.pi / 180.0
    for i in range(len(y)):
        if state[0] == 0.0:
            state[0], state[1], state[3] = 1.0, y[i], y[i]
        soft = 2.0 * params[5] / max(p1[i] + p2[i], 0.02)
        # where the muscles pull to
        step = y[i] - state[1]
        speed = step / dt_s
        pull = y[i] + params[6] * speed + params[7] * params[7] * (speed - state[2]) / dt_s
        for j in range(5):
            radius = LOOP_RADII_DEG[j]
            state[5 + j] = min(max(state[5 + j] + step, -radius), radius)
            pull += params[8 + j] * state[5 + j]
        state[1], state[2] = y[i], speed
        # the new angle in that pull
        drag = (params[6] + soft * params[1]) / dt_s
        mass = (params[7] * params[7] + soft * params[2] * params[2]) / dt_s
        old, rate = state[3], state[4]
        new = old + rate * dt_s
        for _ in range(12):
            step = new - old
            miss = new + drag * step + mass * (step / dt_s - rate) - pull
            slope = 1.0 + drag + mass / dt_s
            for j in range(5):
                moved = state[10 + j] + step
                miss += params[8 + j] * min(max(moved, -LOOP_RADII_DEG[j]), LOOP_RADII_DEG[j])
                slope += params[8 + j] if abs(moved) < LOOP_RADII_DEG[j] else 0.0
            moved = state[15] + step
            miss += soft * params[0] / PRESLIDING_DEG * min(max(moved, -PRESLIDING_DEG), PRESLIDING_DEG)
            slope += soft * params[0] / PRESLIDING_DEG if abs(moved) < PRESLIDING_DEG else 0.0
            turned = (new + params[4]) * radian
            miss += soft * params[3] * math.sin(turned)
            slope += soft * params[3] * radian * math.cos(turned)
            change = miss / max(slope, 0.1)
            new -= change
            if abs(change) < 1e-7:
                break
        step = new - old
        for j in range(5):
            state[10 + j] = min(max(state[10 + j] + step, -LOOP_RADII_DEG[j]), LOOP_RADII_DEG[j])
        state[15] = min(max(state[15] + step, -PRESLIDING_DEG), PRESLIDING_DEG)
        state[3], state[4] = new, step / dt_s
        y[i] = new


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
