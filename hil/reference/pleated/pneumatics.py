"""Regulators of the third family: servo valves of second order, a parabolic flow law, air that warms when compressed.
Compiled.

Flow of an orifice as the parabola that is usually put for it (Andersen 1967), critical ratio 1/2; the muscle's chamber
by its energy balance, with heat lost to the walls. State is one float array.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.pleated.disturbance import RigLaw
from hil.reference.pleated.physics import ATMOSPHERE_MPA, Physics

ATM = ATMOSPHERE_MPA
KAPPA = 1.4
TUBE_REFERENCE_MPA = 0.3
EXHAUST_REFERENCE_MPA = 0.3
LINE_RAD_S, LINE_DAMPING = 25.0, 0.5
SOFT_MPA = 0.004
RATE_SOFT_S = 0.002
CROSS_S = 0.1
POLE_SHARES = (0.6, 0.3, 0.1)
SPAN_SETTLES_S = 6.0

OUTLET, OPENING, OPENING_RATE, LAG_1, LAG_2, LAG_3, RAMP, AIR, ENERGY, PLAY = range(10)
"""State of one valve with its muscle: absolute MPa for OUTLET; AIR is the muscle's mass and ENERGY its pressure times
volume, both in MPa of the volume at angle zero. Valve 2 follows at VALVE_STATES."""
VALVE_STATES = 10
SUPPLY, INFLOW, CROSS = 2 * VALVE_STATES, 2 * VALVE_STATES + 1, 2 * VALVE_STATES + 2
RIG_STATES = 2 * VALVE_STATES + 3


@compiled
def parabola(ratio: float) -> float:
    """Flow against choked flow at a ratio of downstream to upstream absolute pressure."""
    if ratio <= 0.5:
        return 1.0
    if ratio >= 1.0:
        return 0.0
    return 2.0 * math.sqrt(ratio * (1.0 - ratio))


@compiled
def limited(target: float, rig: RigLaw) -> float:
    """Never above the ceiling, with a rounded corner."""
    below = (rig.ceiling_mpa - target) / SOFT_MPA
    if below > 20.0:
        return target
    return rig.ceiling_mpa - SOFT_MPA * math.log1p(math.exp(below))


@compiled
def set_point(set_mpa: float, valve: int, time_s: float, s: State, rig: RigLaw, dt_s: float) -> float:
    """The gauge set-point (MPa) as the servo sees it: span, offset, filter, rate, ceiling."""
    at = valve * VALVE_STATES
    gain = rig.gain_1 if valve == 0 else rig.gain_2
    gain *= 1.0 - 0.17 * math.exp(-max(0.0, time_s) / SPAN_SETTLES_S)
    target = set_mpa * (1.0 + gain * (1.0 + rig.gain_bend * (set_mpa / 0.2 - 1.0)))
    target += rig.offset_1_mpa if valve == 0 else rig.offset_2_mpa
    if rig.lag_s > 0.0:
        for pole in range(3):
            keep = math.exp(-dt_s / (POLE_SHARES[pole] * rig.lag_s))
            s[at + LAG_1 + pole] = target + keep * (s[at + LAG_1 + pole] - target)
            target = s[at + LAG_1 + pole]
    if rig.rate_mpa_s > 0.0:
        s[at + RAMP] += dt_s * rig.rate_mpa_s * math.tanh((target - s[at + RAMP]) / (RATE_SOFT_S * rig.rate_mpa_s))
        target = s[at + RAMP]
    return limited(target, rig)


@compiled
def cross_talk(target_1: float, s: State, rig: RigLaw, dt_s: float) -> float:
    """What valve 2's set-point gets of valve 1's changes (MPa)."""
    s[CROSS] += dt_s / CROSS_S * (target_1 - s[CROSS])
    return rig.cross_talk * (target_1 - s[CROSS])


@compiled
def wanted_opening(target_mpa: float, rate_mpa_s: float, s: State, at: int, physics: Physics, rig: RigLaw) -> float:
    """-1 (exhaust) to 1 (fill), by error and rate of the outlet's pressure."""
    error = target_mpa - (s[at + OUTLET] - ATM)
    if rig.idle_mpa > 0.0:
        error *= 1.0 - math.exp(-((error / rig.idle_mpa) ** 2))
    return max(-1.0, min(1.0, physics.gain_per_mpa * (error - physics.damping_s * rate_mpa_s)))


@compiled
def valve_flow(valve: int, supply: float, s: State, at: int, physics: Physics, rig: RigLaw) -> float:
    """Rate of pressure (MPa/s in the muscle's volume at angle zero) through the present opening."""
    x, p = max(-1.0, min(1.0, s[at + OPENING])), s[at + OUTLET]
    ratio = 1.0 if valve == 0 else physics.rate_ratio_2
    if x >= 0.0:
        narrow = 1.0 / (1.0 + rig.narrow_fill * (1.0 - x))
        return x * narrow * ratio * physics.fill_mpa_s * supply / physics.main_mpa * parabola(p / supply)
    narrow = 1.0 / (1.0 + rig.narrow_exhaust * (1.0 + x))
    return x * narrow * ratio * physics.exhaust_mpa_s * p / EXHAUST_REFERENCE_MPA * parabola(ATM / p)


@compiled
def step_air(
    through: float, volume: float, volume_rate_s: float, s: State, at: int, physics: Physics, dt_s: float
) -> None:
    """One step of the muscle's air: mass and energy, `through` comes in (MPa/s)."""
    air, energy = s[at + AIR], s[at + ENERGY]
    warmth = 1.0 if through > 0.0 else energy / air
    rate = KAPPA * through * warmth - (KAPPA - 1.0) * energy / volume * volume_rate_s - (energy - air) / physics.heat_s
    s[at + AIR] = max(0.05 * ATM, air + dt_s * through)
    s[at + ENERGY] = max(ATM * volume, energy + dt_s * rate)


@compiled
def step_valve(
    target: float, volume: float, volume_rate_s: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> float:
    """One step of valve, tube and muscle; returns the flow taken from the supply. `volume` relative to angle zero."""
    at, w = valve * VALVE_STATES, 2.0 * math.pi * physics.spool_hz
    flow = valve_flow(valve, s[SUPPLY], s, at, physics, rig)
    outlet, pressure = s[at + OUTLET], s[at + ENERGY] / volume
    through = (outlet * outlet - pressure * pressure) / (2.0 * TUBE_REFERENCE_MPA * physics.tube_s)
    rate = (flow * (1.0 + physics.outlet_share) - through) / physics.outlet_share
    opening, speed = s[at + OPENING], s[at + OPENING_RATE]
    pull = (
        w * w * (wanted_opening(target, rate, s, at, physics, rig) - opening) - 2.0 * physics.spool_damping * w * speed
    )
    s[at + OPENING_RATE] = speed + dt_s * pull
    s[at + OPENING] = opening + dt_s * s[at + OPENING_RATE]
    s[at + OUTLET] = max(ATM, outlet + dt_s * rate)
    leak = (rig.leak_1 if valve == 0 else rig.leak_2) * math.sqrt(max(0.0, pressure - ATM) / 0.2)
    step_air(through - leak, volume, volume_rate_s, s, at, physics, dt_s)
    return max(0.0, flow)


@compiled
def step_supply(demand: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """The long line ahead of both valves; without its sag the main itself."""
    if rig.line <= 0.0:
        s[SUPPLY] = physics.main_mpa
        return
    w, gap = LINE_RAD_S, physics.main_mpa - s[SUPPLY]
    s[INFLOW] += dt_s * (w * w * gap / rig.line + 2.0 * LINE_DAMPING * w * (demand - s[INFLOW]))
    s[SUPPLY] = max(0.12, s[SUPPLY] + dt_s * rig.line * (s[INFLOW] - demand))


@compiled
def acting_pressure(valve: int, volume: float, s: State, rig: RigLaw) -> float:
    """Gauge pressure (MPa) that acts on a membrane, behind folds that stick."""
    at = valve * VALVE_STATES
    p = max(0.0, s[at + ENERGY] / volume - ATM)
    half = rig.fold_play_mpa
    s[at + PLAY] = min(max(s[at + PLAY], p - half), p + half)
    return max(0.0, s[at + PLAY])
