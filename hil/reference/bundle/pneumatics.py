"""Regulators of the fifth family: an analogue PI controller, piezo benders on two seats, a tube with inertance.
Compiled.

Flow through a seat after the sizing equation of control valves (IEC 60534-2-1): pressure drop ratio x, expansion factor
1 - x / (3 x_T), choked from x_T on. The tube is one column of air with laminar and turbulent drag; the strands hold an
ideal gas whose temperature goes back to theirs. State is one float array.
"""

import math

from hil.reference.bundle.disturbance import RigLaw
from hil.reference.bundle.physics import ATMOSPHERE_MPA, Physics
from hil.reference.compiling import State, compiled

ATM = ATMOSPHERE_MPA
CHOKED_DROP, LAMINAR_DROP = 0.68, 0.01
"""Ratio of pressure drop from which on the flow is choked, and below which it is in proportion to the drop."""
LAMINAR_FLOW: float = 1.5 * math.sqrt(LAMINAR_DROP / CHOKED_DROP) * (1.0 - LAMINAR_DROP / (3.0 * CHOKED_DROP))
KAPPA = 1.4
REFERENCE_MPA = 0.3
SPAN_MPA = 0.15
"""Width of the bend of an amplifier's span."""
SIGNAL_MPA, SIGNAL_SOFT_MPA = 0.05, 0.0005
PROFILE_S = 0.06
"""A set-point generator reaches its largest rate within this time."""
CUT_BACK_MPA = 0.012
"""The safety switch opens again so far below."""
REDUCER_S, LOCK_UP, LOCK_UP_MPA_S = 0.06, 0.1, 0.05
"""Lag of the reducer, its drop at any flow against that at 1 MPa/s, and the flow at which it is there."""
DRAW_SHARE, DRAW_S = 0.3, 0.04
"""For which share of its turn a neighbour draws air, and how fast it comes."""

(OUTLET, TUBE, AIR, WARMTH, DRIVE, LIFT, INTEGRAL, SIGNAL, PROFILE, PROFILE_RATE, CUT, SLOW) = range(12)
"""State of one regulator with its bundle: absolute MPa for OUTLET; TUBE: flow into the bundle (MPa/s); AIR: what the
bundle holds, in MPa of the volume at angle zero; WARMTH: excess of its temperature, relative; SLOW: gauge MPa behind a
clogged manifold. Regulator 2 follows at VALVE_STATES."""
VALVE_STATES = 12
SUPPLY = 2 * VALVE_STATES
RIG_STATES = 2 * VALVE_STATES + 1


@compiled
def seat_flow(ratio: float) -> float:
    """Flow against choked flow at a ratio of downstream to upstream absolute pressure."""
    drop = 1.0 - ratio
    if drop <= 0.0:
        return 0.0
    if drop < LAMINAR_DROP:
        return LAMINAR_FLOW * drop / LAMINAR_DROP
    part = min(1.0, drop / CHOKED_DROP)
    return 1.5 * math.sqrt(part) * (1.0 - part / 3.0)


@compiled
def through_signal(target: float, at: int, s: State, rig: RigLaw, dt_s: float) -> float:
    """A signal volume behind a turbulent restriction, one implicit step by its present conductance."""
    off = abs(target - s[at + SIGNAL])
    pace = dt_s / rig.signal_s * math.sqrt(SIGNAL_MPA / (off + SIGNAL_SOFT_MPA))
    s[at + SIGNAL] += pace / (1.0 + pace) * (target - s[at + SIGNAL])
    return s[at + SIGNAL]


@compiled
def through_profile(target: float, at: int, s: State, rig: RigLaw, dt_s: float) -> float:
    """A set-point generator: rate and change of rate are limited, so that it brakes in time."""
    most, change = rig.profile_mpa_s, rig.profile_mpa_s / PROFILE_S
    off = target - s[at + PROFILE]
    wanted = math.copysign(min(most, math.sqrt(2.0 * change * abs(off)), abs(off) / (4.0 * dt_s)), off)
    s[at + PROFILE_RATE] += max(-change * dt_s, min(change * dt_s, wanted - s[at + PROFILE_RATE]))
    s[at + PROFILE] += dt_s * s[at + PROFILE_RATE]
    return s[at + PROFILE]


@compiled
def set_point(set_mpa: float, valve: int, s: State, rig: RigLaw, dt_s: float) -> float:
    """The gauge set-point (MPa) that the controller compares with: span, signal volume, generator, its sensor's
    zero."""
    gain = rig.gain_1 if valve == 0 else rig.gain_2
    target = set_mpa * (1.0 + gain * (1.0 + rig.gain_bend * math.tanh((set_mpa - 0.2) / SPAN_MPA)))
    at = valve * VALVE_STATES
    if rig.signal_s > 0.0:
        target = through_signal(target, at, s, rig, dt_s)
    if rig.profile_mpa_s > 0.0:
        target = through_profile(target, at, s, rig, dt_s)
    return target + (rig.offset_1_mpa if valve == 0 else rig.offset_2_mpa)


@compiled
def step_bender(target_mpa: float, s: State, at: int, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One step of controller and bender: LIFT goes to -1 (exhaust) to 1 (supply), late, with the ceramic's play, and
    not before it is torn off its seat, on which the pressure presses it."""
    error = target_mpa - (s[at + OUTLET] - ATM)
    drive = physics.gain_per_mpa * (error + s[at + INTEGRAL])
    if abs(drive) < 1.0 or drive * error < 0.0:
        s[at + INTEGRAL] += dt_s * physics.integral_per_s * error
    drive, half = max(-1.0, min(1.0, drive)), 0.5 * physics.bender_play
    s[at + DRIVE] = min(max(s[at + DRIVE], drive - half), drive + half)
    pressing = s[SUPPLY] - s[at + OUTLET] if s[at + DRIVE] > 0.0 else s[at + OUTLET] - ATM
    crack = physics.crack * max(0.0, pressing) / REFERENCE_MPA + rig.seat_mpa * physics.gain_per_mpa
    wanted = math.copysign(max(0.0, abs(s[at + DRIVE]) - crack), s[at + DRIVE])
    s[at + LIFT] += dt_s / physics.bender_s * (wanted - s[at + LIFT])


@compiled
def cut_off(s: State, at: int, rig: RigLaw) -> bool:
    """Whether the safety switch of this outlet has closed the supply."""
    over = s[at + OUTLET] - ATM - rig.cut_off_mpa
    if over > 0.0:
        s[at + CUT] = 1.0
    elif over < -CUT_BACK_MPA:
        s[at + CUT] = 0.0
    return s[at + CUT] > 0.5


@compiled
def valve_flow(valve: int, s: State, at: int, physics: Physics, rig: RigLaw) -> float:
    """Rate of pressure (MPa/s in the bundle's volume at angle zero) through the seat that is open."""
    x, p = s[at + LIFT], s[at + OUTLET]
    ratio = 1.0 if valve == 0 else physics.ratio_2
    if x < 0.0:
        return x * ratio * physics.exhaust_mpa_s * p / REFERENCE_MPA * seat_flow(ATM / p)
    if cut_off(s, at, rig):
        return 0.0
    return x * ratio * physics.fill_mpa_s * s[SUPPLY] / physics.main_mpa * seat_flow(p / s[SUPPLY])


@compiled
def gauge_mpa(valve: int, volume: float, s: State) -> float:
    """Gauge pressure in a bundle, never below the atmosphere's."""
    at = valve * VALVE_STATES
    return max(0.0, s[at + AIR] * (1.0 + s[at + WARMTH]) / volume - ATM)


@compiled
def step_tube(p: float, s: State, at: int, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """One implicit step of the air in the tube; `p`: absolute pressure in the bundle. Returns the flow (MPa/s)."""
    w, flow = 2.0 * math.pi * physics.line_hz, s[at + TUBE]
    drag = physics.line_drag_s + physics.line_drag_mpa * abs(flow)
    drag *= 1.0 + (rig.throttle_in if flow > 0.0 else rig.throttle_out)
    s[at + TUBE] = (flow + dt_s * w * w * (s[at + OUTLET] - p)) / (1.0 + dt_s * drag)
    return s[at + TUBE]


@compiled
def step_regulator(
    target: float, volume: float, volume_rate_s: float, slit: float, valve: int, s: State, physics: Physics,
    rig: RigLaw, dt_s: float
) -> float:  # fmt: skip
    """One step of a regulator, its tube and its bundle's air; returns what it took from the supply (MPa/s). `volume`
    against that at angle zero, `slit`: how far open a slit in the bladders is, against there."""
    at = valve * VALVE_STATES
    step_bender(target, s, at, physics, rig, dt_s)
    flow = valve_flow(valve, s, at, physics, rig)
    p = gauge_mpa(valve, volume, s) + ATM
    through = step_tube(p, s, at, physics, rig, dt_s)
    share, leak = physics.outlet_share, (rig.leak_1 if valve == 0 else rig.leak_2) * slit
    s[at + OUTLET] = max(ATM, s[at + OUTLET] + dt_s / share * (flow * (1.0 + share) - through))
    if leak > 0.0:
        leak *= p / REFERENCE_MPA * seat_flow(ATM / p)
    air = s[at + AIR]
    s[at + AIR] = max(0.3 * ATM * volume, air + dt_s * (through - leak))
    worked = (KAPPA - 1.0) * ((through - leak) / air - volume_rate_s / volume)
    s[at + WARMTH] = (s[at + WARMTH] + dt_s * worked) / (1.0 + dt_s / physics.heat_s)
    s[at + SLOW] += dt_s / rig.clogged_s * (p - ATM - s[at + SLOW])
    return max(0.0, flow)


@compiled
def drawn(time_s: float, rig: RigLaw) -> float:
    """How much of its air a neighbour draws at present, 0 to 1; not before the record."""
    turn = time_s % rig.neighbour_s
    if time_s < 0.0 or turn > DRAW_SHARE * rig.neighbour_s:
        return 0.0
    return min(1.0, turn / DRAW_S)


@compiled
def step_supply(demand: float, time_s: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One step of the main behind its reducer, which falls with the flow, at the first bit of it more."""
    fall = rig.droop_s * (demand + LOCK_UP * math.tanh(demand / LOCK_UP_MPA_S))
    if rig.neighbour_mpa > 0.0:
        fall += rig.neighbour_mpa * drawn(time_s, rig)
    s[SUPPLY] += dt_s / REDUCER_S * (physics.main_mpa - fall - s[SUPPLY])
    s[SUPPLY] = max(1.1 * ATM, s[SUPPLY])
