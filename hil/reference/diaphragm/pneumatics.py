"""Flows and air of the eighth family. Compiled.

A poppet's curtain and its body are two restrictions in series, whose conductances and critical ratios combine after
Eckersten (1975; ISO 6358-3:2014), so that a poppet that hardly opens chokes later. The tube is the isothermal flow of a
long pipe: the difference of the squares of pressure is a laminar part and one by the square of the flow. Air: its
temperature is a power of its pressure over the one that it has rested at (reduced order: Carneiro and de Almeida 2006),
which follows as heat goes to the walls: adiabatic at once, isothermal after a while. Flows are rates of pressure in a
cylinder at angle zero (MPa/s), MASS the pressure that the air would have there, at the walls' temperature.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.diaphragm.disturbance import RigLaw
from hil.reference.diaphragm.physics import ATMOSPHERE_MPA, Physics
from hil.reference.diaphragm.regulator import (
    AIR,
    BEHIND,
    INTO,
    MASS,
    OUTLET,
    RESTED,
    VALVE_STATES,
    balanced,
    ellipse,
    in_series,
    step_control,
)

ATM = ATMOSPHERE_MPA
KAPPA = 1.4
CURTAIN_RATIO, BODY_RATIO, CLOTH_RATIO = 0.48, 0.25, 0.15
"""Critical ratios of a curtain, of a body, and of what clogs."""
CLOTH = 1.3
"""Conductance of what clogs at a size of 1."""
REFERENCE_MPA = 0.3
HOLE_RATIO = 0.4
COVERED, COVER_M = 0.12, 0.002
"""What of a pinhole is open while the bore covers it, and over which stroke that changes."""
LINE_SHARE, LEAST_MPA = 0.4, 0.12
"""Volume behind a dryer against a cylinder's, and the least pressure there."""

SUPPLY = 2 * VALVE_STATES
RIG_STATES = SUPPLY + 1


@compiled
def poppet(opening: float, clogged: float, ratio: float, physics: Physics) -> float:
    """Flow through a lifted poppet, its body and what clogs the way, against the choked one of a whole curtain; 0 where
    it is shut."""
    if opening <= 1e-6 or ratio >= 1.0:
        return 0.0
    conductance = in_series(opening, physics.body)
    sum_of = (1.0 - CURTAIN_RATIO) / (opening * opening) + (1.0 - BODY_RATIO) / (physics.body * physics.body)
    if clogged > 0.0:
        cloth = CLOTH / clogged
        conductance = in_series(conductance, cloth)
        sum_of += (1.0 - CLOTH_RATIO) / (cloth * cloth)
    critical = max(0.05, 1.0 - conductance * conductance * sum_of)
    return conductance * ellipse(ratio, critical)


@compiled
def booster_flow(lifted: float, valve: int, s: State, physics: Physics, rig: RigLaw) -> float:
    """Flow (MPa/s) from the supply into the outlet, below zero out of it."""
    p, size = s[valve * VALVE_STATES + OUTLET], 1.0 if valve == 0 else physics.ratio_2
    if lifted > 0.0:
        rate = size * physics.feed_mpa_s * s[SUPPLY] / physics.main_mpa
        return rate * poppet(lifted, rig.strainer, p / s[SUPPLY], physics)
    rate = size * physics.relief_mpa_s * p / REFERENCE_MPA
    return -rate * poppet(-lifted, rig.silencer, ATM / p, physics)


@compiled
def tube_flow(first: float, second: float, physics: Physics) -> float:
    """Flow (MPa/s) through the tube from one absolute pressure to another."""
    squares, straight = first * first - second * second, physics.laminar_mpa2_s
    root = math.sqrt(straight * straight + 4.0 * physics.turbulent_mpa2_s * abs(squares))
    return math.copysign(2.0 * abs(squares) / (root + straight), squares)


@compiled
def pinhole(stroke_m: float, valve: int, s: State, rig: RigLaw) -> float:
    """Flow (MPa/s) out of a cylinder through a hole which the bore covers until the lobe has rolled by."""
    leak, p = rig.leak_1 if valve == 0 else rig.leak_2, s[valve * VALVE_STATES + AIR]
    if leak <= 0.0:
        return 0.0
    off = max(-40.0, min(40.0, (stroke_m - rig.leak_at_m) / COVER_M))
    open_share = COVERED + (1.0 - COVERED) / (1.0 + math.exp(-off))
    return leak * open_share * p / REFERENCE_MPA * ellipse(ATM / p, HOLE_RATIO)


@compiled
def step_air(into: float, volume: float, at: int, s: State, physics: Physics, dt_s: float) -> None:
    """One step of a cylinder's air under a flow (MPa/s), at its volume against that at angle zero."""
    s[at + MASS] = max(0.02, s[at + MASS] + dt_s * into)
    cold = s[at + MASS] / volume
    s[at + RESTED] += dt_s / (physics.walls_s + dt_s) * (cold - s[at + RESTED])
    s[at + AIR] = max(0.5 * ATM, cold * math.pow(cold / s[at + RESTED], KAPPA - 1.0))


@compiled
def step_regulator(set_mpa: float, volume: float, lost: float, valve: int, s: State, physics: Physics, rig: RigLaw,
                   dt_s: float) -> float:  # fmt: skip
    """One step of a regulator, its tube and its cylinder's air, which loses a flow (MPa/s); returns what it took from
    the supply (MPa/s)."""
    at, share = valve * VALVE_STATES, physics.outlet_share
    lifted = step_control(set_mpa, s[SUPPLY], valve, s, physics, rig, dt_s)
    flow = booster_flow(lifted, valve, s, physics, rig)
    through = tube_flow(s[at + OUTLET], s[at + AIR], physics)
    gives = 2.0 * s[at + OUTLET] / (physics.laminar_mpa2_s + 2.0 * physics.turbulent_mpa2_s * abs(through))
    gives += physics.feed_mpa_s / physics.lift_mpa
    s[at + OUTLET] = max(ATM, s[at + OUTLET] + dt_s * (flow - through) / (share + dt_s * gives))
    s[at + INTO] = tube_flow(s[at + OUTLET], s[at + AIR], physics)
    step_air(s[at + INTO] - lost, volume, at, s, physics, dt_s)
    return max(0.0, flow)


@compiled
def step_supply(demand: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One implicit step of the supply behind a membrane dryer: hollow fibres, laminar, by the difference of the
    squares."""
    if rig.dryer_mpa <= 0.0:
        return
    resistance = 2.0 * physics.main_mpa * rig.dryer_mpa
    given = (physics.main_mpa**2 - s[SUPPLY] ** 2) / resistance
    slope = 2.0 * s[SUPPLY] / resistance
    s[SUPPLY] = max(LEAST_MPA, s[SUPPLY] + dt_s * (given - demand) / (LINE_SHARE + dt_s * slope))


@compiled
def filled(p_mpa: float, volume: float, valve: int, s: State) -> None:
    """A regulator, its tube and its cylinder after a long time at a gauge pressure."""
    at, p = valve * VALVE_STATES, p_mpa + ATM
    balanced(p_mpa, valve, s)
    s[at + AIR], s[at + MASS], s[at + RESTED], s[at + BEHIND] = p, p * volume, p, ATM
