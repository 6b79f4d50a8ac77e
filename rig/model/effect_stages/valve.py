"""Effects of the two regulators, seen by their pressure monitors; block stages as in `timing`.

`balance` says how a size is shared: 0 both valves alike, 1 valve 1 alone, -1 valve 2 alone, +-2 opposite signs
(for effects that have a sign). The size is that of the valve that has more of it.

Lag, asymmetry and dead band change the inside of a regulator, as `limits` do. They stand behind the nominal one: from
its pressure and time constant tau0 they recover the set-point that it followed, and follow it again in their own way,
so that the neutral value gives the nominal pressure exactly. tau0_s = 0 takes the pressure for the set-point.
"""

import math
from collections.abc import Sequence

from rig.model.effect_stages.low_pass import through_poles
from rig.model.slots import Values

ATMOSPHERE_MPA = 0.1013
"""Pressures count from the atmosphere's, air by what is absolute."""
VALVE_POLES = 3
"""Most poles of a filter beside a regulator."""
LAMINAR_MPA_S = 1000.0
"""Flow from which a throttle's drop goes with its square, of one that is laminar at any flow."""


def of_valve(size: float, balance: float, valve: int) -> float:
    """An effect's size on one of both valves, 0 the first, or on the muscle that it feeds."""
    return size * min(1.0, 1.0 + balance * (1.0 - 2.0 * valve))


def valve_gain(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """p = (1 + gain) p; params: gain, balance."""
    first = 1.0 + of_valve(params[0], params[1], 0)
    second = 1.0 + of_valve(params[0], params[1], 1)
    for i in range(len(p1)):
        p1[i] *= first
        p2[i] *= second


def valve_offset(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """p = p + offset; params: offset_mpa, balance."""
    first = of_valve(params[0], params[1], 0)
    second = of_valve(params[0], params[1], 1)
    for i in range(len(p1)):
        p1[i] += first
        p2[i] += second


def valve_lag(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The regulator is slower: time constant tau0 + tau instead of tau0; params: tau_s, balance, tau0_s."""
    was = math.exp(-dt_s / max(params[2], 1e-6))
    late1, late2 = of_valve(params[0], params[1], 0), of_valve(params[0], params[1], 1)
    keep1, keep2 = math.exp(-dt_s / max(params[2] + late1, 1e-6)), math.exp(-dt_s / max(params[2] + late2, 1e-6))
    for i in range(len(p1)):
        if state[0] == 0.0:
            state[0], state[1], state[2], state[3], state[4] = 1.0, p1[i], p2[i], p1[i], p2[i]
        goal1, goal2 = (p1[i] - was * state[3]) / (1.0 - was), (p2[i] - was * state[4]) / (1.0 - was)
        state[3], state[4] = p1[i], p2[i]
        state[1] = goal1 + keep1 * (state[1] - goal1)
        state[2] = goal2 + keep2 * (state[2] - goal2)
        p1[i], p2[i] = state[1], state[2]


def behind_throttle(before: float, p: float, tau_s: float, turbulent_mpa_s: float, dt_s: float) -> float:
    """Pressure after one tick behind a throttle that has `p` ahead of it: the drop is in proportion to the flow, and to
    its square beyond `turbulent_mpa_s`, at which the two are alike."""
    drop = abs(p - before)
    flow = 0.5 * turbulent_mpa_s * (math.sqrt(1.0 + 4.0 * drop / (tau_s * turbulent_mpa_s)) - 1.0)
    return p + math.exp(-dt_s / (tau_s * (1.0 + flow / turbulent_mpa_s))) * (before - p)


def valve_filter(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A low pass beside the regulator, which keeps its own pole: a filter of the set-point, a pilot chamber, a tube; as
    many equal poles as `poles`, whose time constants sum to tau; params: tau_s, balance, poles, turbulent_mpa_s.

    A throttle whose flow turns turbulent (`behind_throttle`) has one pole: it is the later, the more it has to follow.
    """
    poles = int(params[2])
    tau1, tau2 = of_valve(params[0], params[1], 0), of_valve(params[0], params[1], 1)
    if params[3] < LAMINAR_MPA_S:
        _throttled(p1, state, 1, tau1, params[3], dt_s)
        _throttled(p2, state, 1 + 2 * VALVE_POLES, tau2, params[3], dt_s)
    else:
        through_poles(p1, state, 1, tau1, poles, dt_s)
        through_poles(p2, state, 1 + 2 * VALVE_POLES, tau2, poles, dt_s)
    state[0] = 1.0


def _throttled(column: Values, state: Values, at: int, tau_s: float, turbulent_mpa_s: float, dt_s: float) -> None:
    """The column in a volume behind a throttle, in place; its last value stands at a place of the state."""
    for i in range(len(column)):
        if state[0] != 0.0 or i > 0:
            column[i] = behind_throttle(state[at], column[i], max(tau_s, 1e-9), turbulent_mpa_s, dt_s)
        state[at] = column[i]


def fill_exhaust_asymmetry(
    p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float
) -> None:
    """Exhausting takes `ratio` times as long as filling; params: ratio, fill_share, balance, tau0_s.

    fill_share 0 changes the time constant of exhausting (tau0 x ratio), 1 that of filling (tau0 / ratio).
    """
    was = math.exp(-dt_s / max(params[3], 1e-6))
    fill_s, exhaust_s = params[3] * params[0] ** -params[1], params[3] * params[0] ** (1.0 - params[1])
    share1, share2 = of_valve(1.0, params[2], 0), of_valve(1.0, params[2], 1)
    fill1, exhaust1 = (
        math.exp(-dt_s / max(params[3] + share1 * (fill_s - params[3]), 1e-6)),
        math.exp(-dt_s / max(params[3] + share1 * (exhaust_s - params[3]), 1e-6)),
    )
    fill2, exhaust2 = (
        math.exp(-dt_s / max(params[3] + share2 * (fill_s - params[3]), 1e-6)),
        math.exp(-dt_s / max(params[3] + share2 * (exhaust_s - params[3]), 1e-6)),
    )
    for i in range(len(p1)):
        if state[0] == 0.0:
            state[0], state[1], state[2], state[3], state[4] = 1.0, p1[i], p2[i], p1[i], p2[i]
        goal1, goal2 = (p1[i] - was * state[3]) / (1.0 - was), (p2[i] - was * state[4]) / (1.0 - was)
        state[3], state[4] = p1[i], p2[i]
        state[1] = goal1 + (fill1 if goal1 > state[1] else exhaust1) * (state[1] - goal1)
        state[2] = goal2 + (fill2 if goal2 > state[2] else exhaust2) * (state[2] - goal2)
        p1[i], p2[i] = state[1], state[2]


def one_way_line(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A throttle with a check valve between monitor and muscle: the muscle's pressure follows the monitor's at once in
    one direction, late in the other; params: tau_s, fill_share (0 late in exhausting, 1 in filling), balance,
    turbulent_mpa_s."""
    tau1, tau2 = of_valve(params[0], params[2], 0), of_valve(params[0], params[2], 1)
    late = 1.0 if params[1] > 0.5 else -1.0
    for i in range(len(p1)):
        slow1, slow2 = late * (p1[i] - state[1]) > 0.0, late * (p2[i] - state[2]) > 0.0
        if state[0] != 0.0 and slow1 and tau1 > 0.0:
            p1[i] = behind_throttle(state[1], p1[i], tau1, params[3], dt_s)
        if state[0] != 0.0 and slow2 and tau2 > 0.0:
            p2[i] = behind_throttle(state[2], p2[i], tau2, params[3], dt_s)
        state[0], state[1], state[2] = 1.0, p1[i], p2[i]


def valve_dead_band(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """No reaction while set-point and pressure differ by less than the width; params: width_mpa, edge, balance, tau0_s,
    one_way.

    Beyond it the regulator moves until the width is left (edge 1), or on to the set-point until the share `edge` of the
    width is left, where it holds again (edge below 1). To fill takes the width times 1 + one_way, to exhaust times
    1 - one_way.
    """
    was = math.exp(-dt_s / max(params[3], 1e-6))
    width1, width2 = of_valve(params[0], params[2], 0), of_valve(params[0], params[2], 1)
    fill, exhaust = 1.0 + params[4], 1.0 - params[4]
    stops = 1.0 if params[1] > 0.95 else 0.0
    for i in range(len(p1)):
        if state[0] == 0.0:
            state[0], state[1], state[2], state[3], state[4] = 1.0, p1[i], p2[i], p1[i], p2[i]
        gap = (p1[i] - was * state[3]) / (1.0 - was) - state[1]
        width = width1 * (fill if gap > 0.0 else exhaust)
        if abs(gap) > width:
            state[5] = 1.0
        elif abs(gap) <= max(params[1], 0.02) * width:
            state[5] = 0.0
        state[1] += state[5] * (1.0 - was) * (gap - stops * math.copysign(width, gap))
        gap = (p2[i] - was * state[4]) / (1.0 - was) - state[2]
        width = width2 * (fill if gap > 0.0 else exhaust)
        if abs(gap) > width:
            state[6] = 1.0
        elif abs(gap) <= max(params[1], 0.02) * width:
            state[6] = 0.0
        state[2] += state[6] * (1.0 - was) * (gap - stops * math.copysign(width, gap))
        state[3], state[4] = p1[i], p2[i]
        p1[i], p2[i] = state[1], state[2]


def co_contraction(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """P0 of both muscles is shifted; params: shift_mpa."""
    for i in range(len(p1)):
        p1[i] += params[0]
        p2[i] += params[0]
