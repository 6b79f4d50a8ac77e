"""Regulators of the second family: a sampled PI controller, nozzle flow, the hose, the muscle's chamber. Compiled.

Flow through an ideal nozzle (Saint-Venant and Wantzel, k = 1.4); the chamber is isothermal. State is one float array.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.fluidic.disturbance import RigLaw
from hil.reference.fluidic.physics import ATMOSPHERE_MPA, Physics

ATM = ATMOSPHERE_MPA
CHOKED = 0.528282
NOZZLE_PEAK = 0.258812
"""Largest value of the nozzle's function, reached at the choked ratio."""

PRESSURE, OUTLET, OPENING, WANTED, INTEGRAL, FILTER_1, FILTER_2, RAMP = range(8)
"""State of one valve, absolute MPa for PRESSURE (at the muscle) and OUTLET; valve 2 follows at VALVE_STATES."""
VALVE_STATES = 8
RIG_STATES = 2 * VALVE_STATES


@compiled
def nozzle(ratio: float) -> float:
    """Flow against choked flow at a ratio of downstream to upstream absolute pressure."""
    if ratio <= CHOKED:
        return 1.0
    if ratio >= 1.0:
        return 0.0
    root = math.pow(ratio, 2.0 / 7.0)
    return root * root * math.sqrt(root * (1.0 - root)) / NOZZLE_PEAK


@compiled
def set_point(set_mpa: float, valve: int, s: State, at: int, rig: RigLaw, dt_s: float) -> float:
    """The gauge set-point (MPa) as the regulator's program sees it: converter, filter, ramp."""
    gain = rig.gain_1 if valve == 0 else rig.gain_2
    target = set_mpa * (1.0 + gain * (1.0 + rig.gain_bend * (set_mpa / 0.2 - 1.0)))
    target += rig.offset_1_mpa if valve == 0 else rig.offset_2_mpa
    if rig.filter_s > 0.0:
        keep = math.exp(-2.0 * dt_s / rig.filter_s)
        s[at + FILTER_1] = target + keep * (s[at + FILTER_1] - target)
        s[at + FILTER_2] = s[at + FILTER_1] + keep * (s[at + FILTER_2] - s[at + FILTER_1])
        target = s[at + FILTER_2]
    if rig.ramp_mpa_s > 0.0:
        most = rig.ramp_mpa_s * dt_s * (0.7 + 0.3 * max(0.0, s[at + RAMP]) / 0.2)
        s[at + RAMP] += max(-most, min(most, target - s[at + RAMP]))
        target = s[at + RAMP]
    return target


@compiled
def control(target_mpa: float, s: State, at: int, physics: Physics, rig: RigLaw, period_s: float) -> None:
    """One sample of the PI controller: the wanted opening, -1 (exhaust) to 1 (fill); the integral stops where the
    opening does."""
    error = target_mpa - (s[at + OUTLET] - ATM)
    if rig.insensitive_mpa > 0.0:
        error = math.copysign(max(0.0, abs(error) - rig.insensitive_mpa), error)
    wanted = physics.gain_per_mpa * (error + s[at + INTEGRAL])
    if abs(wanted) < 1.0 or error * wanted < 0.0:
        s[at + INTEGRAL] += period_s * physics.integral_per_s * error
    wanted = max(-1.0, min(1.0, wanted))
    if abs(wanted - s[at + WANTED]) > rig.stiction:
        s[at + WANTED] = wanted


@compiled
def valve_flow(x: float, valve: int, supply: float, s: State, at: int, physics: Physics, rig: RigLaw) -> float:
    """Rate of pressure (MPa/s, as if muscle and hose had their volume at angle zero) through an opening x."""
    p = s[at + OUTLET]
    rate = physics.rate_mpa_s * (1.0 if valve == 0 else physics.rate_ratio_2)
    if x >= 0.0:
        flow = x * rate * supply / physics.main_mpa * nozzle(p / supply)
        return flow / (1.0 + rig.inlet_filter * x)
    flow = x * rate * physics.exhaust_ratio * p / physics.main_mpa * 1.6 * nozzle(ATM / p)
    return flow / (1.0 - rig.silencer * x)


@compiled
def step_valve(
    volume: float, volume_rate_s: float, valve: int, supply: float, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> None:
    """One step of valve, hose and chamber. `volume` relative to that at angle zero."""
    at = valve * VALVE_STATES
    s[at + OPENING] += dt_s / physics.opening_s * (s[at + WANTED] - s[at + OPENING])
    flow = valve_flow(s[at + OPENING], valve, supply, s, at, physics, rig) * (1.0 + physics.outlet_share)
    p, outlet = s[at + PRESSURE], s[at + OUTLET]
    through = (outlet - p) / physics.hose_s
    s[at + OUTLET] = max(ATM, outlet + dt_s * (flow - through) / physics.outlet_share)
    leak = (rig.leak_1_s if valve == 0 else rig.leak_2_s) * (p * p - ATM * ATM) / 0.4
    s[at + PRESSURE] = max(ATM, p + dt_s * (through - leak - p * volume_rate_s) / volume)
