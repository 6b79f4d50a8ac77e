"""Effects that keep a regulator from following its set-point: limits of its flow, its ceiling, and what its supply
delivers; block stages as in `timing`.

They stand behind the nominal regulator as those of `valve` do, and a muscle moves by less than it would; a ramp of the
set-point stands on the commands.

integral_s above 0: regulators integrate with this time what their pressure falls short by, as those with a pilot do
(two solenoid valves let air into its chamber, or out of it, until the pressure agrees: SMC, ITV series). Once the
limit is over they go on for a while, late and too far (integral wind-up: Astrom and Hagglund, PID Controllers, 1995,
chapter 3.5). 0: they do not integrate.

State: whether it runs; the pressures, what the nominal ones were last, and what the integrators hold, of both valves.
"""

import math
from collections.abc import Sequence

from rig.model.effect_stages.valve import ATMOSPHERE_MPA, of_valve
from rig.model.slots import Values

IS, WAS, HELD, MORE = 1, 3, 5, 7
"""Places in the state: from MORE on stands what a stage has of its own."""
OFF, NOMINAL, TAKEN, LACKS, NUMB_STATE = 1, 3, 5, 7, 9
"""Places in the state of a regulator that does not see small errors."""
UNLIMITED_MPA_S = 100.0
"""A flow at this limit is none that is limited."""
MOST_HELD_MPA = 0.1
"""An integrator is full there: no pilot chamber goes beyond its supply."""
CRITICAL_RATIO = 0.3
"""Of the absolute pressures behind and ahead of an orifice: below it the flow is choked (ISO 6358; 0.2 to 0.5 for
valves)."""
TANK_MPA = 0.6
"""Absolute pressure of a full tank: what a sag is counted against."""
LEAST_LEFT = 0.02
"""Share of it that is left at least."""
SETTLING_TICKS = 400
"""For which a line that leaks has stood still before a record: 2 s at 5 ms. Fewer: records begin with its pressure
falling."""
LEAST_FLOW = 0.141
"""Share of choked flow that a full tank gives at least: at its own pressure none is left to compare with."""


def _begun(p1: Values, p2: Values, state: Values, most_mpa: float) -> None:
    """Both valves at rest where the nominal ones are, below `most_mpa`."""
    state[0] = 1.0
    state[IS], state[IS + 1] = min(p1[0], most_mpa), min(p2[0], most_mpa)
    state[WAS], state[WAS + 1] = p1[0], p2[0]


def _wanted(now: float, valve: int, state: Values, was: float) -> float:
    """By how much a valve's pressure would move in this step if nothing kept it."""
    move = now - was * state[WAS + valve] - (1.0 - was) * (state[IS + valve] - state[HELD + valve])
    state[WAS + valve] = now
    return move


def _moved(now: float, move: float, valve: int, state: Values, integral_s: float, dt_s: float) -> float:
    """The valve's pressure after it has moved; its integrator goes on."""
    state[IS + valve] += move
    if integral_s > 0.0:
        held = state[HELD + valve] + dt_s / integral_s * (now - state[IS + valve])
        state[HELD + valve] = min(max(held, -MOST_HELD_MPA), MOST_HELD_MPA)
    return state[IS + valve]


def _nominal_error(now: float, valve: int, state: Values, was: float) -> float:
    """What a valve's nominal regulator is short of in this step, by how far its pressure moves."""
    error = (now - state[NOMINAL + valve]) / (1.0 - was)
    state[NOMINAL + valve] = now
    return error


def _beyond(value: float, width: float) -> float:
    """What of a value lies outside of a dead zone."""
    return value - min(max(value, -width), width)


def valve_slew(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """|dp/dt| has a limit; params: fill_mpa_s, exhaust_mpa_s, balance, tau0_s, choked, soft, integral_s.

    With a balance the less limited valve has the limits divided by its share. choked 1: a small orifice, through which
    the muscle exhausts the more slowly the less (absolute) pressure is left; the limit then holds at 0.3 MPa. soft 1: a
    resistance in series (a filter, a silencer), which takes the more of the flow the larger it is; half of it at the
    limit.
    """
    was = math.exp(-dt_s / max(params[3], 1e-6))
    for i in range(len(p1)):
        if state[0] == 0.0:
            _begun(p1, p2, state, math.inf)
        for valve in range(2):
            now = p1[i] if valve == 0 else p2[i]
            share = max(of_valve(1.0, params[2], valve), 1e-6)
            move = _wanted(now, valve, state, was)
            most = params[0] * dt_s / share
            if move < 0.0:
                most = params[1] * dt_s / share
                most *= 1.0 + params[4] * ((state[IS + valve] + ATMOSPHERE_MPA) / 0.4013 - 1.0)
            if params[5] > 0.5:
                narrow = max(1.0 / max(most, 1e-12) - 1.0 / (UNLIMITED_MPA_S * dt_s), 0.0)
                move = move / (1.0 + abs(move) * narrow)
            else:
                move = min(max(move, -most), most)
            _moved(now, move, valve, state, params[6], dt_s)
        p1[i], p2[i] = state[IS], state[IS + 1]


def fed_leak(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """One muscle's line leaks ahead of its monitor, and the regulator feeds the leak through an orifice: it fills the
    more slowly and empties the faster, and falls short most near the supply's pressure, where least comes through (ISO
    6358); params: loss, muscle (1 or 2), tau0_s, supply_mpa, fill_mpa_s (choked filling).

    The leak is choked: it takes in proportion to the absolute pressure, `loss` times as much as the regulator gives for
    as large an error.
    """
    if params[0] == 0.0:
        return
    was, valve = math.exp(-dt_s / max(params[2], 1e-6)), 0 if params[1] < 1.5 else 1
    column = p1 if valve == 0 else p2
    if state[0] == 0.0:
        _begun(p1, p2, state, math.inf)
        for _ in range(SETTLING_TICKS):
            _fed(column[0], valve, state, params, was, dt_s)
    for i in range(len(column)):
        column[i] = _fed(column[i], valve, state, params, was, dt_s)


def _fed(now: float, valve: int, state: Values, params: Sequence[float], was: float, dt_s: float) -> float:
    """The pressure of a valve that feeds a leak, after one tick."""
    absolute = state[IS + valve] + ATMOSPHERE_MPA
    most = params[4] * dt_s * _orifice(absolute / (params[3] + ATMOSPHERE_MPA))
    move = min(_wanted(now, valve, state, was), most) - (1.0 - was) * params[0] * absolute
    return _moved(now, move, valve, state, 0.0, dt_s)


def set_point_ramp(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A regulator's program moves its set-point at a limited rate, and the regulator follows; params: rate_mpa_s."""
    most = params[0] * dt_s
    for i in range(len(p1)):
        if state[0] == 0.0:
            _begun(p1, p2, state, math.inf)
        state[IS] += min(max(p1[i] - state[IS], -most), most)
        state[IS + 1] += min(max(p2[i] - state[IS + 1], -most), most)
        p1[i], p2[i] = state[IS], state[IS + 1]


def numb_regulator(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A regulator that integrates does not see errors below a width: its valve stays as open as it was; params:
    width_mpa, integral_s, balance, tau0_s.

    On a ramp the integrator alone gives the flow (a PI controller before a muscle, Astrom and Hagglund, PID
    Controllers, 1995, chapter 3), so a pressure goes on by itself until it is off by the width to the other side. The
    state holds, of each valve: how far it is off the nominal pressure, that pressure, the nominal error (what of the
    flow the integrator has not taken over yet), and what its integrator lacks.
    """
    was, takes_over = math.exp(-dt_s / max(params[3], 1e-6)), dt_s / max(params[1], dt_s)
    for i in range(len(p1)):
        if state[0] == 0.0:
            state[0], state[NOMINAL], state[NOMINAL + 1] = 1.0, p1[i], p2[i]
        for valve in range(2):
            now = p1[i] if valve == 0 else p2[i]
            width = of_valve(params[0], params[2], valve)
            # what the flow changes by is asked of the error first, and handed to the integrator in its time
            flow = _nominal_error(now, valve, state, was)
            error = flow - state[TAKEN + valve]
            state[TAKEN + valve] += takes_over * error
            seen = _beyond(error - state[OFF + valve], width)
            state[OFF + valve] += (1.0 - was) * (seen - error + state[LACKS + valve])
            state[LACKS + valve] += takes_over * (seen - error)
        p1[i] += state[OFF]
        p2[i] += state[OFF + 1]


def overlapped_valve(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The valve of a regulator that integrates does not open below a drive: its spool overlaps, or sticks on its seat;
    params: overlap_mpa, integral_s, balance, tau0_s.

    Unlike a regulator that sees no small errors its integrator goes on until the valve opens, so a pressure stands
    still at turning points, and then goes all the way (dead zone of an actuator behind a PI controller: Tao and
    Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996, chapter 2). Places of the
    state as in `numb_regulator`.
    """
    was, winds = math.exp(-dt_s / max(params[3], 1e-6)), dt_s / max(params[1], dt_s)
    for i in range(len(p1)):
        if state[0] == 0.0:
            state[0], state[NOMINAL], state[NOMINAL + 1] = 1.0, p1[i], p2[i]
        for valve in range(2):
            now = p1[i] if valve == 0 else p2[i]
            width = of_valve(params[0], params[2], valve)
            nominal = _nominal_error(now, valve, state, was)
            drive = _beyond(nominal - state[OFF + valve] + state[LACKS + valve], width)
            state[LACKS + valve] -= winds * state[OFF + valve]
            state[OFF + valve] += (1.0 - was) * (drive - nominal)
        p1[i] += state[OFF]
        p2[i] += state[OFF + 1]


def pressure_ceiling(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """No regulator goes beyond the ceiling, whatever its set-point; params: ceiling_mpa, tau0_s, integral_s."""
    was = math.exp(-dt_s / max(params[1], 1e-6))
    for i in range(len(p1)):
        if state[0] == 0.0:
            _begun(p1, p2, state, params[0])
        for valve in range(2):
            now = p1[i] if valve == 0 else p2[i]
            move = _wanted(now, valve, state, was)
            _moved(now, min(move, (1.0 - was) * (params[0] - state[IS + valve])), valve, state, params[2], dt_s)
        p1[i], p2[i] = state[IS], state[IS + 1]


def _orifice(ratio: float) -> float:
    """Flow function of ISO 6358: flow over choked flow at this ratio of the absolute pressures behind and ahead."""
    beyond = min(max((ratio - CRITICAL_RATIO) / (1.0 - CRITICAL_RATIO), 0.0), 1.0)
    return math.sqrt(1.0 - beyond * beyond)


def low_supply(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The main is set too low: a muscle fills through an orifice, the more slowly the less is left of the supply above
    it (flow function of ISO 6358); params: supply_mpa, tau0_s, integral_s."""
    was = math.exp(-dt_s / max(params[1], 1e-6))
    for i in range(len(p1)):
        if state[0] == 0.0:
            _begun(p1, p2, state, params[0])
        for valve in range(2):
            now = p1[i] if valve == 0 else p2[i]
            move = _wanted(now, valve, state, was)
            if move > 0.0:
                flow = _orifice((state[IS + valve] + ATMOSPHERE_MPA) / (params[0] + ATMOSPHERE_MPA))
                move = min(move * flow, max(params[0] - state[IS + valve], 0.0))
            _moved(now, move, valve, state, params[2], dt_s)
        p1[i], p2[i] = state[IS], state[IS + 1]


def _filling(move: float, p_mpa: float, sag_mpa: float) -> float:
    """What is left of a move where a tank has sagged: the flow into a pressure goes with the tank's absolute pressure
    and the flow function, over that of a full one."""
    if sag_mpa <= 0.0:
        return move
    left = max(1.0 - sag_mpa / TANK_MPA, LEAST_LEFT)
    ratio = (p_mpa + ATMOSPHERE_MPA) / TANK_MPA
    return min(move, move * left * _orifice(ratio / left) / max(_orifice(ratio), LEAST_FLOW))


def supply_droop(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The supply sags by droop_s x (the filling rate of both muscles); params: droop_s, supply_mpa, tau0_s, refill_s,
    integral_s.

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
            _begun(p1, p2, state, math.inf)
        filled1, filled2 = state[MORE], state[MORE + 1]
        for valve in range(2):
            now = p1[i] if valve == 0 else p2[i]
            goal = (now - was * state[WAS + valve]) / (1.0 - was)
            move = _wanted(now, valve, state, was)
            if move > 0.0 and params[3] > 0.0:
                move = _filling(move, state[IS + valve], state[MORE + 2])
            elif move > 0.0:
                roof = (params[1] if params[1] > 0.0 else goal) - params[0] * (filled2 if valve == 0 else filled1)
                move = min(move, max((1.0 - was) * (roof - state[IS + valve]) / slower, 0.0))
            _moved(now, move, valve, state, params[4], dt_s)
            state[MORE + valve] = max(move, 0.0) / dt_s
        state[MORE + 2] += refill * (params[0] * (state[MORE] + state[MORE + 1]) - state[MORE + 2])
        p1[i], p2[i] = state[IS], state[IS + 1]


def clogged_line(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """A filter or a long hose ahead of both regulators takes the more of the flow the larger it is, half of it at
    fill_mpa_s of both together; params: fill_mpa_s, tau0_s, integral_s."""
    was = math.exp(-dt_s / max(params[1], 1e-6))
    narrow = max(1.0 / params[0] - 1.0 / UNLIMITED_MPA_S, 0.0) / dt_s
    for i in range(len(p1)):
        if state[0] == 0.0:
            _begun(p1, p2, state, math.inf)
        filled1, filled2 = state[MORE], state[MORE + 1]
        for valve in range(2):
            now = p1[i] if valve == 0 else p2[i]
            move = _wanted(now, valve, state, was)
            if move > 0.0:
                move = move / (1.0 + (move + (filled2 if valve == 0 else filled1)) * narrow)
            _moved(now, move, valve, state, params[2], dt_s)
            state[MORE + valve] = max(move, 0.0)
        p1[i], p2[i] = state[IS], state[IS + 1]


def emptied_receiver(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """The supply delivers no more than capacity_mpa_s of filling for long: beyond that a receiver ahead of both
    regulators empties; params: capacity_mpa_s, fall, tau0_s, integral_s.

    It falls by `fall` of what the muscles are filled with beyond that, and fills up again while they take less; the
    flow into a muscle is in proportion to its absolute pressure.
    """
    was = math.exp(-dt_s / max(params[2], 1e-6))
    for i in range(len(p1)):
        if state[0] == 0.0:
            _begun(p1, p2, state, math.inf)
        taken = 0.0
        for valve in range(2):
            now = p1[i] if valve == 0 else p2[i]
            move = _wanted(now, valve, state, was)
            if move > 0.0:
                move = _filling(move, state[IS + valve], state[MORE])
                taken += move
            _moved(now, move, valve, state, params[3], dt_s)
        sag = state[MORE] + params[1] * (taken - params[0] * dt_s)
        state[MORE] = min(max(sag, 0.0), (1.0 - LEAST_LEFT) * TANK_MPA)
        p1[i], p2[i] = state[IS], state[IS + 1]
