"""Flows and chambers of the sixth family: sharp-edged ports, a sintered filter, air with a mass and walls. Compiled.

A port's flow is the ideal nozzle's (k = 1.4) times the discharge coefficient of a sharp-edged orifice by the polynomial
that is usually put through the measurements of Perry (1949): below the critical ratio it still grows a little. The
filter before a muscle by Darcy and Forchheimer for a gas. The muscle's air by its mass and energy, with heat to the
walls after Eichelberg (1939), by the root of pressure times temperature.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.sleeve.disturbance import RigLaw
from hil.reference.sleeve.physics import Physics
from hil.reference.sleeve.regulator import (
    AIR,
    BACK,
    CURRENT,
    EDDY,
    ICE,
    MASS,
    MOTOR,
    OUTLET,
    POPPED,
    SPOOL,
    TRIM,
    VALVE_STATES,
    step_control,
)

KAPPA = 1.4
CRITICAL = (2.0 / (KAPPA + 1.0)) ** (KAPPA / (KAPPA - 1.0))
CHOKED_FLOW = math.sqrt(CRITICAL ** (2.0 / KAPPA) - CRITICAL ** ((KAPPA + 1.0) / KAPPA))
"""Of an ideal nozzle at its critical ratio, where it is largest."""
PERRY = (0.8414, -0.1002, 0.8415, -3.9, 4.6001, -1.6827)
LAMINAR = 0.985
"""Ratio from which on the flow is proportional to the difference."""
REFERENCE_MPA = 0.3
POP_MPA_S, RESEAT = 6.0, 0.97
GAPE_MPA, GAPE_POWER = 0.04, 1.5
"""Gauge pressure from which a crimp gapes."""
NOZZLE_REFILL_MPA_S, LEAST_SUPPLY_MPA = 0.6, 0.13
ICE_MPA = 1.2
"""Pressure let out until the ice breaks off."""

RECEIVER, CLOCK_S = 2 * VALVE_STATES, 2 * VALVE_STATES + 1
"""The supply's absolute pressure (MPa), and the time since the trim last began."""
RIG_STATES = 2 * VALVE_STATES + 2


@compiled
def ideal(ratio: float) -> float:
    """Flow of an ideal nozzle at a ratio of downstream to upstream absolute pressure, not choked."""
    return math.sqrt(max(0.0, ratio ** (2.0 / KAPPA) - ratio ** ((KAPPA + 1.0) / KAPPA)))


@compiled
def sharp_edge_at(ratio: float) -> float:
    """Flow of a sharp-edged orifice against its flow into a vacuum, below LAMINAR: discharge coefficient times the
    nozzle's flow."""
    discharge = 0.0
    for k in range(5, -1, -1):
        discharge = discharge * ratio + PERRY[k]
    return discharge / PERRY[0] * (1.0 if ratio <= CRITICAL else ideal(ratio) / CHOKED_FLOW)


@compiled
def sharp_edge(ratio: float) -> float:
    """The same at any ratio, into no vacuum too."""
    if ratio >= 1.0:
        return 0.0
    if ratio > LAMINAR:
        return sharp_edge_at(LAMINAR) * (1.0 - ratio) / (1.0 - LAMINAR)
    return sharp_edge_at(ratio)


@compiled
def in_series(opening: float, soaked: float) -> float:
    """Opening of a port with a second orifice behind it that makes a full one slower by the share `soaked`."""
    return opening / math.sqrt(1.0 + ((1.0 + soaked) ** 2 - 1.0) * opening * opening)


@compiled
def port_flow(opening: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Flow (MPa/s) through the spool's port into the outlet, below zero out of it; ice grows with what goes out."""
    at = valve * VALVE_STATES
    p, atm = s[at + OUTLET], physics.atmosphere_mpa
    ratio = 1.0 if valve == 0 else physics.rate_ratio_2
    if opening >= 0.0:
        supply = s[RECEIVER]
        port = in_series(opening, rig.soaked_fill) * supply / physics.main_mpa
        return ratio * physics.fill_mpa_s * port * sharp_edge(p / supply)
    port = in_series(-opening, rig.soaked_exhaust) / (1.0 + rig.ice * s[at + ICE])
    flow = ratio * physics.exhaust_mpa_s * port * p / REFERENCE_MPA * sharp_edge(atm / p)
    if rig.ice > 0.0:
        s[at + ICE] = s[at + ICE] + dt_s * flow / ICE_MPA if s[at + ICE] < 1.0 else 0.0
    return -flow


@compiled
def filter_flow(high: float, low: float, physics: Physics) -> float:
    """Flow (MPa/s) through the sintered filter between two absolute pressures, in the direction of the fall."""
    squares = high * high - low * low
    root = math.sqrt(physics.darcy * physics.darcy + 4.0 * physics.forchheimer * abs(squares))
    return math.copysign((root - physics.darcy) / (2.0 * physics.forchheimer), squares)


@compiled
def lost_flow(valve: int, s: State, physics: Physics, rig: RigLaw) -> float:
    """Flow (MPa/s) out of a muscle: through a crimp that gapes, and a relief valve that popped."""
    at = valve * VALVE_STATES
    gauge = s[at + AIR] - physics.atmosphere_mpa
    gape = max(0.0, gauge - GAPE_MPA) / (0.2 - GAPE_MPA)
    flow = (rig.leak_1 if valve == 0 else rig.leak_2) * math.pow(gape, GAPE_POWER)
    if gauge > rig.pop_mpa:
        s[at + POPPED] = 1.0
    elif gauge < RESEAT * rig.pop_mpa:
        s[at + POPPED] = 0.0
    return flow + s[at + POPPED] * POP_MPA_S * s[at + AIR] / REFERENCE_MPA


@compiled
def step_air(through: float, lost: float, volume: float, growth: float, s: State, at: int, physics: Physics,
             dt_s: float) -> None:  # fmt: skip
    """One step of a muscle's air under its flows (MPa/s at angle zero) and its volume, relative to that at zero, and
    what that grows by (1/s)."""
    p, mass = s[at + AIR], s[at + MASS]
    temperature = p * volume / mass
    inward, outward = max(0.0, through), max(0.0, -through) + lost
    walls = REFERENCE_MPA / physics.walls_s * math.sqrt(p / REFERENCE_MPA * temperature) * (1.0 - temperature)
    rise = KAPPA * (inward - temperature * outward - p * growth) + walls
    s[at + AIR] = max(physics.atmosphere_mpa, p + dt_s / volume * rise)
    s[at + MASS] = max(0.02, mass + dt_s * (inward - outward))


@compiled
def step_regulator(set_mpa: float, volume: float, growth: float, valve: int, s: State, physics: Physics, rig: RigLaw,
                   dt_s: float) -> float:  # fmt: skip
    """One step of a regulator, its filter and its muscle's air; returns what it took from the supply (MPa/s)."""
    at = valve * VALVE_STATES
    opening = step_control(set_mpa, valve, s, physics, rig, dt_s)
    flow = port_flow(opening, valve, s, physics, rig, dt_s) * (1.0 + physics.outlet_share)
    through = filter_flow(s[at + OUTLET], s[at + AIR], physics)
    least = physics.atmosphere_mpa
    s[at + OUTLET] = max(least, s[at + OUTLET] + dt_s / physics.outlet_share * (flow - through))
    step_air(through, lost_flow(valve, s, physics, rig), volume, growth, s, at, physics, dt_s)
    return max(0.0, flow)


@compiled
def step_supply(demand: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One step of what both regulators share: a receiver that a critical nozzle refills, and the restarts of a trim."""
    if rig.receiver > 0.0:
        risen = s[RECEIVER] + dt_s * (NOZZLE_REFILL_MPA_S - 0.01 * rig.receiver * demand)
        s[RECEIVER] = max(LEAST_SUPPLY_MPA, min(physics.main_mpa, risen))
    if rig.beam_mpa > 0.0:
        s[CLOCK_S] += dt_s
        if s[CLOCK_S] > rig.restart_s:
            s[CLOCK_S] = 0.0
            s[int(rig.restart_valve) * VALVE_STATES + TRIM] = 0.0


@compiled
def filled(p_mpa: float, valve: int, s: State, physics: Physics) -> None:
    """A regulator and its muscle as they stand after a long time at a gauge pressure, its beam trimmed."""
    at, p = valve * VALVE_STATES, p_mpa + physics.atmosphere_mpa
    s[at + OUTLET] = s[at + AIR] = s[at + MASS] = p
    s[at + CURRENT] = s[at + MOTOR] = p_mpa
    s[at + BACK], s[at + SPOOL] = 0.5, 0.0
    s[at + TRIM] = -(physics.beam_1_mpa if valve == 0 else physics.beam_2_mpa)
    for k in range(3):
        s[at + EDDY + k] = p_mpa
