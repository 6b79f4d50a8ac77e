"""Regulators of the fourth family: pulsed pilot solenoids, a pilot chamber, a diaphragm on two main valves. Compiled.

The build is that of SMC's ITV: a controller samples the outlet's pressure and pulses a supply and an exhaust solenoid;
the diaphragm between pilot chamber and outlet opens a main supply or exhaust valve. Flow of valves and holes after ISO
6358-1:2013 with its subsonic index; the muscle's chamber after Richer and Hurmuzlu (2000), whose exponents differ for
air that comes in, air that goes out and work. State is one float array.
"""

import math

from hil.reference.bellows.disturbance import RigLaw
from hil.reference.bellows.physics import ATMOSPHERE_MPA, Physics
from hil.reference.compiling import State, compiled

ATM = ATMOSPHERE_MPA
CRITICAL, SUBSONIC, LAMINAR = 0.36, 0.55, 0.985
"""Critical ratio, subsonic index, and the ratio from which on the flow is proportional to the difference."""
LAMINAR_FLOW: float = (1.0 - ((LAMINAR - CRITICAL) / (1.0 - CRITICAL)) ** 2) ** SUBSONIC
INWARD, OUTWARD, WORK = 1.3, 1.05, 1.2
REFERENCE_MPA = 0.3
TUBE_SMOOTH = 0.002
"""Difference of squares below which the tube's flow is laminar (MPa^2)."""
KINK_MPA = 0.015
SWITCH_MPA, COMPRESSOR_S = 0.05, 0.6
MANIFOLD_S = 0.12

PHASE, PULSE, PILOT, DIAPHRAGM, LIFT, OUTLET, MUSCLE, LADDER = range(8)
"""State of one regulator with its muscle: absolute MPa for PILOT, OUTLET and MUSCLE; PULSE: time for which a solenoid
stays open, below zero the exhaust's. Three rungs of LADDER follow each other; regulator 2 follows at VALVE_STATES."""
VALVE_STATES = 10
TANK, COMPRESSOR, MANIFOLD, INFLOW = (2 * VALVE_STATES + k for k in range(4))
"""INFLOW: what comes into muscle 1 at present (MPa/s), then muscle 2."""
RIG_STATES = 2 * VALVE_STATES + 5


@compiled
def conductance(ratio: float) -> float:
    """Flow against choked flow at a ratio of downstream to upstream absolute pressure."""
    if ratio <= CRITICAL:
        return 1.0
    if ratio >= 1.0:
        return 0.0
    if ratio > LAMINAR:
        return LAMINAR_FLOW * (1.0 - ratio) / (1.0 - LAMINAR)
    part = (ratio - CRITICAL) / (1.0 - CRITICAL)
    return math.pow(1.0 - part * part, SUBSONIC)


@compiled
def through_ladder(target: float, at: int, s: State, lag_s: float, dt_s: float) -> float:
    """The end of a ladder of three equal rungs, one implicit step; its Elmore delay is six rungs'."""
    k = 6.0 * dt_s / lag_s
    first = 1.0 + 2.0 * k
    second = first - k * k / first
    third = 1.0 + k - k * k / second
    right_1 = s[at] + k * target
    right_2 = s[at + 1] + k / first * right_1
    s[at + 2] = (s[at + 2] + k / second * right_2) / third
    s[at + 1] = (right_2 + k * s[at + 2]) / second
    s[at] = (right_1 + k * s[at + 1]) / first
    return s[at + 2]


@compiled
def set_point(set_mpa: float, valve: int, s: State, rig: RigLaw, dt_s: float) -> float:
    """The gauge set-point (MPa) as the regulator's controller sees it: span, zero, signal tube."""
    gain = rig.gain_1 if valve == 0 else rig.gain_2
    target = set_mpa
    if gain != 0.0:
        target *= (1.0 + gain) * math.pow(max(0.02, set_mpa / 0.2), gain * rig.gain_bend)
    target += rig.offset_1_mpa if valve == 0 else rig.offset_2_mpa
    if rig.lag_s > 0.0:
        target = through_ladder(target, valve * VALVE_STATES + LADDER, s, rig.lag_s, dt_s)
    return target


@compiled
def control(target_mpa: float, s: State, at: int, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """When the controller's period is over: how long which solenoid opens in the next one."""
    s[at + PHASE] += dt_s
    if s[at + PHASE] < physics.sample_s:
        return
    s[at + PHASE] -= physics.sample_s
    error = target_mpa - (s[at + OUTLET] - ATM)
    duty = max(-1.0, min(1.0, error / physics.full_pulse_mpa))
    s[at + PULSE] = duty * physics.sample_s if abs(error) > max(physics.sensitive_mpa, rig.numb_mpa) else 0.0


@compiled
def step_pilot(valve: int, supply: float, s: State, at: int, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One step of the pilot chamber through the solenoid that is open, for as much of the step as it is."""
    pulse, p = s[at + PULSE], s[at + PILOT]
    ratio = 1.0 if valve == 0 else physics.pilot_ratio_2
    if pulse > 0.0:
        open_s, feed = min(pulse, dt_s), min(supply, rig.pilot_supply_mpa + ATM)
        rate = ratio * physics.pilot_fill_mpa_s / (1.0 + rig.weak_fill)
        s[at + PILOT] = p + open_s * rate * feed / physics.main_mpa * conductance(p / feed)
        s[at + PULSE] = pulse - open_s
    elif pulse < 0.0:
        open_s = min(-pulse, dt_s)
        rate = ratio * physics.pilot_exhaust_mpa_s / (1.0 + rig.weak_exhaust)
        s[at + PILOT] = max(ATM, p - open_s * rate * p / REFERENCE_MPA * conductance(ATM / p))
        s[at + PULSE] = pulse + open_s


@compiled
def step_lift(s: State, at: int, physics: Physics, dt_s: float) -> None:
    """One step of the diaphragm and of the main valves' lift, -1 (exhaust) to 1 (supply)."""
    push, rub = s[at + PILOT] - s[at + OUTLET], physics.rub_mpa
    s[at + DIAPHRAGM] = min(max(s[at + DIAPHRAGM], push - rub), push + rub)
    beyond = max(0.0, abs(s[at + DIAPHRAGM]) - physics.crack_mpa) / physics.full_open_mpa
    wanted = math.copysign(min(1.0, beyond), s[at + DIAPHRAGM])
    s[at + LIFT] += dt_s / physics.lift_s * (wanted - s[at + LIFT])


@compiled
def behind_throat(flow: float, most: float) -> float:
    """A flow (MPa/s) that a throat lets through, `most` when it is choked."""
    return flow / math.sqrt(1.0 + (flow / most) ** 2)


@compiled
def main_flow(supply: float, s: State, at: int, physics: Physics, rig: RigLaw) -> float:
    """Rate of pressure (MPa/s in the muscle's volume at angle zero) through the main valve that is open."""
    x, p = s[at + LIFT], s[at + OUTLET]
    if x >= 0.0:
        flow = x * physics.fill_mpa_s * supply / physics.main_mpa * conductance(p / supply)
        upstream = supply / physics.main_mpa
    else:
        upstream = p / REFERENCE_MPA
        flow = x * physics.exhaust_mpa_s * upstream * conductance((ATM + s[MANIFOLD]) / p)
    return behind_throat(flow, rig.throat_mpa_s * upstream) if rig.throat_mpa_s > 0.0 else flow


@compiled
def tube_flow(valve: int, s: State, at: int, physics: Physics, rig: RigLaw) -> float:
    """Flow from the outlet to the muscle (MPa/s): turbulent, laminar when small."""
    outlet, muscle = s[at + OUTLET], s[at + MUSCLE]
    difference, width = outlet * outlet - muscle * muscle, physics.tube
    if rig.kink > 0.0 and valve == 0:
        width /= 1.0 + rig.kink / (1.0 + math.exp((max(outlet, muscle) - ATM - rig.kink_mpa) / KINK_MPA))
    return width * difference / math.sqrt(abs(difference) + TUBE_SMOOTH)


@compiled
def leak_flow(valve: int, p: float, rig: RigLaw) -> float:
    """Out of a hole in a muscle (MPa/s), which the pressure widens."""
    leak = rig.leak_1 if valve == 0 else rig.leak_2
    return leak * (p / REFERENCE_MPA) ** 2 * conductance(ATM / p) if leak > 0.0 else 0.0


@compiled
def step_regulator(
    target: float, volume: float, volume_rate_s: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> tuple[float, float]:
    """One step of a regulator, its tube and its muscle's air; returns what it took from the supply and what it let out
    (MPa/s). `volume` relative to a muscle of the build at angle zero."""
    at = valve * VALVE_STATES
    control(target, s, at, physics, rig, dt_s)
    step_pilot(valve, s[TANK], s, at, physics, rig, dt_s)
    step_lift(s, at, physics, dt_s)
    share, p = physics.outlet_share, s[at + MUSCLE]
    flow, through = main_flow(s[TANK], s, at, physics, rig) * (1.0 + share), tube_flow(valve, s, at, physics, rig)
    s[at + OUTLET] = max(ATM, s[at + OUTLET] + dt_s / share * (flow - through))
    air = (INWARD if through > 0.0 else OUTWARD) * through - OUTWARD * leak_flow(valve, p, rig)
    s[at + MUSCLE] = max(ATM, p + dt_s / volume * (air - WORK * p * volume_rate_s))
    s[INFLOW + valve] = max(0.0, through)
    return max(0.0, flow), max(0.0, -flow)


@compiled
def step_tank(demand: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One step of a tank that a compressor with a pressure switch fills up; without its fall the main itself."""
    if rig.tank <= 0.0:
        s[TANK] = physics.main_mpa
        return
    missing = physics.main_mpa - s[TANK]
    if missing > SWITCH_MPA:
        s[COMPRESSOR] = 1.0
    elif missing < 0.1 * SWITCH_MPA:
        s[COMPRESSOR] = 0.0
    filled = s[COMPRESSOR] * (missing + SWITCH_MPA) / COMPRESSOR_S
    s[TANK] = max(0.13, s[TANK] + dt_s * (filled - 0.01 * rig.tank * demand))


@compiled
def step_manifold(let_out: float, s: State, rig: RigLaw, dt_s: float) -> None:
    """One step of the pressure (gauge MPa) in a manifold that both exhausts share and a silencer empties."""
    if rig.manifold > 0.0:
        s[MANIFOLD] += dt_s * (rig.manifold * let_out - s[MANIFOLD] / MANIFOLD_S)
