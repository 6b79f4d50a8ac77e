"""Effects of the two regulators, seen by their pressure monitors; block stages as in `timing`.

`balance` says how a size is shared: 0 both valves alike, 1 valve 1 alone, -1 valve 2 alone, +-2 opposite signs
(for effects that have a sign). The size is that of the valve that has more of it.

Lag, limit, asymmetry, dead band, ceiling and droop change the inside of a regulator. They stand behind the nominal one:
from its pressure and time constant tau0 they recover the set-point that it followed, and follow it again in their own
way, so that the neutral value gives the nominal pressure exactly. tau0_s = 0 takes the pressure for the set-point.
"""

import math
from collections.abc import Sequence

from rig.model.effect_stages.low_pass import through_poles
from rig.model.slots import Values

ATMOSPHERE_MPA = 0.1013
"""Pressures count from the atmosphere's, air by what is absolute."""
VALVE_POLES = 3
"""Most poles of a filter beside a regulator."""
UNLIMITED_MPA_S = 100.0
"""A flow at this limit is none that is limited."""
CRITICAL_RATIO = 0.3
"""Of the absolute pressures behind and ahead of an orifice: below it the flow is choked (ISO 6358; 0.2 to 0.5 for
valves)."""
TANK_MPA = 0.6
"""Absolute pressure of a full tank: what a sag is counted against."""
LEAST_FLOW = 0.141
"""Share of choked flow that a full tank gives at least: at its own pressure none is left to compare with."""


def valve_gain(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """p = (1 + gain) p; params: gain, balance."""
    first = 1.0 + params[0] * min(1.0, 1.0 + params[1])
    second = 1.0 + params[0] * min(1.0, 1.0 - params[1])
    for i in range(len(p1)):
        p1[i] *= first
        p2[i] *= second


def valve_offset(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """p = p + offset; params: offset_mpa, balance."""
    first = params[0] * min(1.0, 1.0 + params[1])
    second = params[0] * min(1.0, 1.0 - params[1])
    for i in range(len(p1)):
        p1[i] += first
        p2[i] += second


def valve_lag(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The regulator is slower: time constant tau0 + tau instead of tau0; params: tau_s, balance, tau0_s."""
    was = math.exp(-dt_s / max(params[2], 1e-6))
    late1, late2 = params[0] * min(1.0, 1.0 + params[1]), params[0] * min(1.0, 1.0 - params[1])
    keep1, keep2 = math.exp(-dt_s / max(params[2] + late1, 1e-6)), math.exp(-dt_s / max(params[2] + late2, 1e-6))
    for i in range(len(p1)):
        if state[0] == 0.0:
            state[0], state[1], state[2], state[3], state[4] = 1.0, p1[i], p2[i], p1[i], p2[i]
        goal1, goal2 = (p1[i] - was * state[3]) / (1.0 - was), (p2[i] - was * state[4]) / (1.0 - was)
        state[3], state[4] = p1[i], p2[i]
        state[1] = goal1 + keep1 * (state[1] - goal1)
        state[2] = goal2 + keep2 * (state[2] - goal2)
        p1[i], p2[i] = state[1], state[2]


def valve_filter(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A low pass beside the regulator, which keeps its own pole: a filter of the set-point, a pilot chamber, a tube; as
    many equal poles as `poles`, whose time constants sum to tau; params: tau_s, balance, poles."""
    poles = int(params[2])
    through_poles(p1, state, 1, params[0] * min(1.0, 1.0 + params[1]), poles, dt_s)
    through_poles(p2, state, 1 + 2 * VALVE_POLES, params[0] * min(1.0, 1.0 - params[1]), poles, dt_s)
    state[0] = 1.0


def valve_slew(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """|dp/dt| has a limit inside the regulator; params: fill_mpa_s, exhaust_mpa_s, balance, tau0_s, choked, soft.

    With a balance the less limited valve has the limits divided by its share. choked 1: a small orifice, through which
    the muscle exhausts the more slowly the less (absolute) pressure is left; the limit then holds at 0.3 MPa. soft 1: a
    resistance in series (a filter, a silencer), which takes the more of the flow the larger it is; half of it at the
    limit.
    """
    was = math.exp(-dt_s / max(params[3], 1e-6))
    for i in range(len(p1)):
        if state[0] == 0.0:
            state[0], state[1], state[2], state[3], state[4] = 1.0, p1[i], p2[i], p1[i], p2[i]
        for valve in range(2):
            now = p1[i] if valve == 0 else p2[i]
            share = max(min(1.0, 1.0 + params[2] * (1.0 - 2.0 * valve)), 1e-6)
            move = now - was * state[3 + valve] - (1.0 - was) * state[1 + valve]
            state[3 + valve] = now
            most = params[0] * dt_s / share
            if move < 0.0:
                most = params[1] * dt_s / share
                most *= 1.0 + params[4] * ((state[1 + valve] + ATMOSPHERE_MPA) / 0.4013 - 1.0)
            if params[5] > 0.5:
                narrow = max(1.0 / max(most, 1e-12) - 1.0 / (UNLIMITED_MPA_S * dt_s), 0.0)
                state[1 + valve] += move / (1.0 + abs(move) * narrow)
            else:
                state[1 + valve] += min(max(move, -most), most)
        p1[i], p2[i] = state[1], state[2]


def fill_exhaust_asymmetry(
    p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float
) -> None:
    """Exhausting takes `ratio` times as long as filling; params: ratio, fill_share, balance, tau0_s.

    fill_share 0 changes the time constant of exhausting (tau0 x ratio), 1 that of filling (tau0 / ratio).
    """
    was = math.exp(-dt_s / max(params[3], 1e-6))
    fill_s, exhaust_s = params[3] * params[0] ** -params[1], params[3] * params[0] ** (1.0 - params[1])
    share1, share2 = min(1.0, 1.0 + params[2]), min(1.0, 1.0 - params[2])
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


def valve_dead_band(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """No reaction while set-point and pressure differ by less than the width; params: width_mpa, edge, balance, tau0_s.

    Beyond it the regulator moves until the width is left (edge 1), or on to the set-point until the share `edge` of the
    width is left, where it holds again (edge below 1).
    """
    was = math.exp(-dt_s / max(params[3], 1e-6))
    width1, width2 = params[0] * min(1.0, 1.0 + params[2]), params[0] * min(1.0, 1.0 - params[2])
    stops = 1.0 if params[1] > 0.95 else 0.0
    for i in range(len(p1)):
        if state[0] == 0.0:
            state[0], state[1], state[2], state[3], state[4] = 1.0, p1[i], p2[i], p1[i], p2[i]
        gap = (p1[i] - was * state[3]) / (1.0 - was) - state[1]
        if abs(gap) > width1:
            state[5] = 1.0
        elif abs(gap) <= max(params[1], 0.02) * width1:
            state[5] = 0.0
        state[1] += state[5] * (1.0 - was) * (gap - stops * math.copysign(width1, gap))
        gap = (p2[i] - was * state[4]) / (1.0 - was) - state[2]
        if abs(gap) > width2:
            state[6] = 1.0
        elif abs(gap) <= max(params[1], 0.02) * width2:
            state[6] = 0.0
        state[2] += state[6] * (1.0 - was) * (gap - stops * math.copysign(width2, gap))
        state[3], state[4] = p1[i], p2[i]
        p1[i], p2[i] = state[1], state[2]


def pressure_ceiling(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """No regulator goes beyond the ceiling, whatever its set-point; params: ceiling_mpa, tau0_s."""
    was = math.exp(-dt_s / max(params[1], 1e-6))
    for i in range(len(p1)):
        if state[0] == 0.0:
            state[0], state[1], state[2], state[3], state[4] = (
                1.0,
                min(p1[i], params[0]),
                min(p2[i], params[0]),
                p1[i],
                p2[i],
            )
        goal1, goal2 = (p1[i] - was * state[3]) / (1.0 - was), (p2[i] - was * state[4]) / (1.0 - was)
        state[3], state[4] = p1[i], p2[i]
        state[1] += (1.0 - was) * (min(goal1, params[0]) - state[1])
        state[2] += (1.0 - was) * (min(goal2, params[0]) - state[2])
        p1[i], p2[i] = state[1], state[2]


def _orifice(ratio: float) -> float:
    """Flow function of ISO 6358: flow over choked flow at this ratio of the absolute pressures behind and ahead."""
    beyond = min(max((ratio - CRITICAL_RATIO) / (1.0 - CRITICAL_RATIO), 0.0), 1.0)
    return math.sqrt(1.0 - beyond * beyond)


def low_supply(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The main is set too low: a muscle fills through an orifice, the more slowly the less is left of the supply above
    it (flow function of ISO 6358); params: supply_mpa, tau0_s."""
    was = math.exp(-dt_s / max(params[1], 1e-6))
    for i in range(len(p1)):
        if state[0] == 0.0:
            state[0], state[3], state[4] = 1.0, p1[i], p2[i]
            state[1], state[2] = min(p1[i], params[0]), min(p2[i], params[0])
        for valve in range(2):
            now = p1[i] if valve == 0 else p2[i]
            move = now - was * state[3 + valve] - (1.0 - was) * state[1 + valve]
            state[3 + valve] = now
            if move > 0.0:
                flow = _orifice((state[1 + valve] + ATMOSPHERE_MPA) / (params[0] + ATMOSPHERE_MPA))
                move = min(move * flow, max(params[0] - state[1 + valve], 0.0))
            state[1 + valve] += move
        p1[i], p2[i] = state[1], state[2]


def _filling(p_mpa: float, left: float) -> float:
    """Flow function into a pressure from a tank that has so much left, over that of a full one."""
    ratio = (p_mpa + ATMOSPHERE_MPA) / TANK_MPA
    return _orifice(ratio / left) / max(_orifice(ratio), LEAST_FLOW)


def supply_droop(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The supply sags by droop_s x (the filling rate of both muscles); params: droop_s, supply_mpa, tau0_s, refill_s.

    supply_mpa 0: what a regulator fills towards sags with it at every pressure. Above 0: filling cannot go beyond the
    sagging supply. droop_s is MPa of sag for each MPa/s of filling, so a time. refill_s above 0: a tank ahead of both
    regulators, which is refilled with this time constant; the flow into a muscle is in proportion to the tank's
    absolute pressure.
    """
    was = math.exp(-dt_s / max(params[2], 1e-6))
    slower = 1.0 + (1.0 - was) * params[0] / dt_s
    refill = 1.0 - math.exp(-dt_s / max(params[3], 1e-6))
    for i in range(len(p1)):
        if state[0] == 0.0:
            state[0], state[1], state[2], state[3], state[4] = 1.0, p1[i], p2[i], p1[i], p2[i]
        goal1, goal2 = (p1[i] - was * state[3]) / (1.0 - was), (p2[i] - was * state[4]) / (1.0 - was)
        state[3], state[4] = p1[i], p2[i]
        move1, move2 = (1.0 - was) * (goal1 - state[1]), (1.0 - was) * (goal2 - state[2])
        if params[3] > 0.0:
            left = max(1.0 - state[7] / TANK_MPA, 0.02)
            move1 = min(move1, move1 * left * _filling(state[1], left))
            move2 = min(move2, move2 * left * _filling(state[2], left))
            state[7] += refill * (params[0] * (max(move1, 0.0) + max(move2, 0.0)) / dt_s - state[7])
        else:
            roof1 = (params[1] if params[1] > 0.0 else goal1) - params[0] * state[6]
            roof2 = (params[1] if params[1] > 0.0 else goal2) - params[0] * state[5]
            if move1 > 0.0:
                move1 = min(move1, max((1.0 - was) * (roof1 - state[1]) / slower, 0.0))
            if move2 > 0.0:
                move2 = min(move2, max((1.0 - was) * (roof2 - state[2]) / slower, 0.0))
        state[1] += move1
        state[2] += move2
        state[5], state[6] = max(move1, 0.0) / dt_s, max(move2, 0.0) / dt_s
        p1[i], p2[i] = state[1], state[2]


def co_contraction(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """P0 of both muscles is shifted; params: shift_mpa."""
    for i in range(len(p1)):
        p1[i] += params[0]
        p2[i] += params[0]
