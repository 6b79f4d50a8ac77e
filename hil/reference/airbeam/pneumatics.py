"""Flows and air of the seventh family. Compiled.

A port's flow is the ideal nozzle's times a discharge coefficient that falls with the flow number, by its hyperbolic
tangent (McCloy and Martin 1980): laminar at a small difference or a small opening. Ports are slots with round ends.
A felt is Darcy's for a gas, with a small space before it. The beam's air by mass and energy; heat goes to the fabric by
free convection (McAdams 1954: the power 4/3 of the difference), which warms the fabric.
"""

import math

from hil.reference.airbeam.disturbance import RigLaw
from hil.reference.airbeam.line import INTO_BEAM, INTO_LINE, TO_BEAM, TO_VALVE, admittance, arriving, send, still
from hil.reference.airbeam.physics import ATMOSPHERE_MPA, Physics
from hil.reference.airbeam.regulator import (
    AIR,
    FABRIC,
    FELT_IN,
    FELT_OUT,
    LIMITED,
    LINE,
    MASS,
    OUTLET,
    VALVE_STATES,
    balanced,
    step_control,
)
from hil.reference.compiling import State, compiled

ATM = ATMOSPHERE_MPA
KAPPA = 1.4
CRITICAL = (2.0 / (KAPPA + 1.0)) ** (KAPPA / (KAPPA - 1.0))
MOST_NOZZLE = math.sqrt(CRITICAL ** (2.0 / KAPPA) - CRITICAL ** ((KAPPA + 1.0) / KAPPA))
FLOW_NUMBER = 14.0
"""Flow number against its critical one, of a full opening into a vacuum."""
ROUND_END = 0.04
"""Travel over which the round ends of a slot open."""
REFERENCE_MPA = 0.3
FELT_SHARE, FELT_MPA2_S = 0.02, 0.02
"""Space before a felt against a beam's, and its difference of the squares of pressure per flow for one unit."""
LIMITER_MPA, LIMITER_S = 0.03, 0.01
"""Range in which a limiting valve closes, and its time constant."""
COMPRESSOR_MPA_S, CLEARANCE, EXPANSION, LEAST_MPA = 0.55, 0.05, 1.25, 0.13
"""What a compressor delivers at the atmosphere's pressure; its clearance gives back the more, the higher it works."""
CONVECTION_AT = 0.02
FABRIC_SHARE, ROOM_S = 12.0, 8.0
"""Heat that fabric holds against a beam's air, and within which it takes the room's temperature."""
TORN_AT_MPA = 0.3

BOTTLE = 2 * VALVE_STATES
RIG_STATES = BOTTLE + 1


@compiled
def metered(ratio: float, opening: float) -> float:
    """Flow at a ratio of downstream to upstream absolute pressure, against the choked flow of a full opening, per
    opening."""
    if ratio >= 1.0:
        return 0.0
    discharge = math.tanh(FLOW_NUMBER * math.sqrt(opening * (1.0 - ratio)))
    if ratio <= CRITICAL:
        return discharge
    return discharge * math.sqrt(ratio ** (2.0 / KAPPA) - ratio ** ((KAPPA + 1.0) / KAPPA)) / MOST_NOZZLE


@compiled
def slot(travel: float) -> float:
    """Opening of a slot with round ends, against the whole one."""
    return travel * travel / (travel + ROUND_END) * (1.0 + ROUND_END)


@compiled
def step_felt(flow: float, at: int, clogged: float, beyond: float, way: float, s: State, dt_s: float) -> None:
    """One implicit step of the space before a felt, `way` 1, or of that behind it, -1; `beyond`: the pressure on its
    other side."""
    p, resistance = s[at], clogged * FELT_MPA2_S
    through = (p * p - beyond * beyond) / resistance
    slope = dt_s / FELT_SHARE * 2.0 * p / resistance
    s[at] = max(0.5 * ATM, p + dt_s / FELT_SHARE * (way * flow - through) / (1.0 + slope))


@compiled
def limiting(at: int, s: State, rig: RigLaw, dt_s: float) -> float:
    """How far a limiting valve leaves the inlet open."""
    goal = max(0.0, min(1.0, (rig.limiter_mpa - (s[at + OUTLET] - ATM)) / LIMITER_MPA))
    s[at + LIMITED] += dt_s / LIMITER_S * (goal - s[at + LIMITED])
    return s[at + LIMITED]


@compiled
def filling(opening: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Flow (MPa/s) from the bottle into the outlet."""
    at, rate = valve * VALVE_STATES, physics.fill_mpa_s * (1.0 if valve == 0 else physics.ratio_2)
    supply = s[BOTTLE] if rig.felt_in <= 0.0 else s[at + FELT_IN]
    flow = opening * rate * supply / physics.main_mpa * metered(s[at + OUTLET] / supply, opening)
    if rig.felt_in > 0.0:
        step_felt(flow, at + FELT_IN, rig.felt_in, s[BOTTLE], -1.0, s, dt_s)
    return flow


@compiled
def exhausting(opening: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Flow (MPa/s) out of the outlet."""
    at, rate = valve * VALVE_STATES, physics.exhaust_mpa_s * (1.0 if valve == 0 else physics.ratio_2)
    p, behind = s[at + OUTLET], ATM if rig.felt_out <= 0.0 else s[at + FELT_OUT]
    flow = opening * rate * p / REFERENCE_MPA * metered(behind / p, opening)
    if rig.felt_out > 0.0:
        step_felt(flow, at + FELT_OUT, rig.felt_out, ATM, 1.0, s, dt_s)
    return flow


@compiled
def port_flow(travel: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Flow (MPa/s) through the spool into the outlet, below zero out of it."""
    most = 1.0 if rig.stroke_mpa_s <= 0.0 else min(1.0, rig.stroke_mpa_s / physics.fill_mpa_s)
    opening = min(most, slot(abs(travel)))
    into = opening if travel > 0.0 else 0.0
    if rig.limiter_mpa < 5.0:
        into *= limiting(valve * VALVE_STATES, s, rig, dt_s)
    out = opening if travel < 0.0 else 0.0
    return filling(into, valve, s, physics, rig, dt_s) - exhausting(out, valve, s, physics, rig, dt_s)


@compiled
def pores(fold: float, valve: int, s: State, physics: Physics, rig: RigLaw) -> float:
    """Flow (MPa/s) out of a beam through pores that open with the square of its corner."""
    leak, p = rig.leak_1 if valve == 0 else rig.leak_2, s[valve * VALVE_STATES + AIR]
    if leak <= 0.0:
        return 0.0
    corner = math.tan(0.5 * max(0.0, fold)) / math.tan(0.5 * physics.fold_rad)
    return leak * corner * corner * p / TORN_AT_MPA * metered(ATM / p, 1.0)


@compiled
def step_air(through: float, lost: float, volume: float, growth: float, s: State, at: int, physics: Physics,
             dt_s: float) -> None:  # fmt: skip
    """One step of a beam's air under its flows (MPa/s), its volume against that at angle zero, and what that grows by
    while the pressure stays (1/s). Fabric that stretches takes more air."""
    p, mass = s[at + AIR], s[at + MASS]
    temperature = p * volume / mass
    off = s[at + FABRIC] - temperature
    heat = REFERENCE_MPA / physics.walls_s * off * math.pow(abs(off) / CONVECTION_AT + 1e-9, 1.0 / 3.0)
    inward, outward = max(0.0, through), max(0.0, -through) + lost
    rise = KAPPA * (inward - temperature * outward - p * growth) + heat
    stretch = physics.stretch_per_mpa
    gives = KAPPA * p * 2.0 * stretch / (1.0 + stretch * (p - ATM))
    s[at + AIR] = max(ATM, p + dt_s * rise / (volume * (1.0 + gives)))
    s[at + MASS] = max(0.02, mass + dt_s * (inward - outward))
    s[at + FABRIC] += dt_s * ((1.0 - s[at + FABRIC]) / ROOM_S - heat / (FABRIC_SHARE * REFERENCE_MPA))


@compiled
def bridged(s: State, rig: RigLaw) -> float:
    """Flow (MPa/s) from beam 1 to beam 2."""
    first, second = s[AIR], s[VALVE_STATES + AIR]
    return rig.bridge * (first * first - second * second)


@compiled
def step_regulator(set_mpa: float, volume: float, growth: float, lost: float, valve: int, s: State, physics: Physics,
                   rig: RigLaw, dt_s: float) -> float:  # fmt: skip
    """One step of a regulator, its line and its beam's air, which loses a flow (MPa/s); returns what it took from the
    supply (MPa/s)."""
    at = valve * VALVE_STATES
    travel, share = step_control(set_mpa, valve, s, physics, rig, dt_s), physics.outlet_share
    flow = port_flow(travel, valve, s, physics, rig, dt_s) * (1.0 + share + physics.line_share)
    wave, there = arriving(TO_VALVE, at + LINE, s, physics, dt_s), arriving(TO_BEAM, at + LINE, s, physics, dt_s)
    pace = admittance(s[at + LINE + INTO_LINE], physics)
    outlet = (s[at + OUTLET] + dt_s / share * (flow + pace * wave)) / (1.0 + dt_s / share * pace)
    into_line = pace * (outlet - wave)
    into_beam = admittance(s[at + LINE + INTO_BEAM], physics) * (there - s[at + AIR])
    s[at + OUTLET] = max(ATM, outlet)
    s[at + LINE + INTO_LINE], s[at + LINE + INTO_BEAM] = into_line, into_beam
    send(into_line, into_beam, at + LINE, s, physics, dt_s)
    step_air(into_beam, lost, volume, growth, s, at, physics, dt_s)
    return max(0.0, flow)


@compiled
def step_bottle(demand: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One step of the supply: a small compressor before a bottle, which a switch holds below the main's pressure."""
    if rig.bottle <= 0.0:
        return
    given_back = CLEARANCE * (math.pow(s[BOTTLE] / ATM, 1.0 / EXPANSION) - 1.0)
    delivered = COMPRESSOR_MPA_S * max(0.0, 1.0 - given_back)
    risen = s[BOTTLE] + dt_s * 0.01 * rig.bottle * (delivered - demand)
    s[BOTTLE] = max(LEAST_MPA, min(physics.main_mpa, risen))


@compiled
def filled(p_mpa: float, volume: float, valve: int, s: State, physics: Physics) -> None:
    """A regulator, its line and its beam after a long time at a gauge pressure."""
    at, p = valve * VALVE_STATES, p_mpa + ATM
    balanced(p_mpa, valve, s, physics)
    still(p, at + LINE, s)
    s[at + OUTLET] = s[at + AIR] = p
    s[at + MASS], s[at + FABRIC], s[at + LIMITED] = p * volume, 1.0, 1.0
    s[at + FELT_IN], s[at + FELT_OUT] = physics.main_mpa, ATM
