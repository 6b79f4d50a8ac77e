"""Regulators and supply: set-point -> pilot -> spool -> orifice flow -> chamber. Compiled; state is one float array.

Flow function of ISO 6358 with critical pressure ratio b = 0.3; chamber filling polytropic (n = 1.2).
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.mckibben.disturbance import RigLaw
from hil.reference.mckibben.physics import ATMOSPHERE_MPA, Physics

ATM = ATMOSPHERE_MPA
POLYTROPIC = 1.2
REFILL_S = 0.15
EXHAUST_REFERENCE_MPA = 0.3
RELIEF_RATE_S = 250.0
"""Of an open relief valve: rate of pressure per excess."""

PRESSURE, LINE, SPOOL, IS_OPEN, PILOT, HOSE, HOSE_RATE, HUNT, HUNT_RATE = range(9)
"""State of one valve; valve 2 follows at VALVE_STATES."""
VALVE_STATES = 9
TANK = 2 * VALVE_STATES


@compiled
def flow_function(ratio: float) -> float:
    """ISO 6358: flow against choked flow at a ratio of downstream to upstream absolute pressure."""
    if ratio <= 0.3:
        return 1.0
    if ratio >= 1.0:
        return 0.0
    return math.sqrt(1.0 - ((ratio - 0.3) / 0.7) ** 2)


@compiled
def shaped_set_point(set_mpa: float, valve: int, s: State, at: int, rig: RigLaw, dt_s: float) -> float:
    """The gauge set-point (MPa) as the spool's controller sees it: hose, pilot chamber, hunting."""
    target = set_mpa + (rig.offset_1_mpa if valve == 0 else rig.offset_2_mpa)
    if rig.hose_hz > 0.0:
        w = 2.0 * math.pi * rig.hose_hz
        s[at + HOSE_RATE] += dt_s * (w * w * (target - s[at + HOSE]) - 2.0 * rig.hose_damping * w * s[at + HOSE_RATE])
        s[at + HOSE] += dt_s * s[at + HOSE_RATE]
        target = s[at + HOSE]
    if rig.pilot_s > 0.0:
        upper, lower = target + ATM, s[at + PILOT] + ATM
        s[at + PILOT] += dt_s * (upper * upper - lower * lower) / (2.0 * EXHAUST_REFERENCE_MPA * rig.pilot_s)
        target = s[at + PILOT]
    if rig.hunt_mpa > 0.0:
        w = 2.0 * math.pi * rig.hunt_hz * (1.0 if valve == 0 else 1.07)
        x, v = s[at + HUNT], s[at + HUNT_RATE]
        s[at + HUNT_RATE] += dt_s * (w * 0.8 * (1.0 - x * x) * v - w * w * x)
        s[at + HUNT] += dt_s * s[at + HUNT_RATE]
        target += 0.5 * rig.hunt_mpa * x
    return target


@compiled
def spool_command(error_mpa: float, s: State, at: int, full_open_mpa: float, rig: RigLaw) -> float:
    """Wanted opening in -1..1; with overlap, the spool opens late and closes late."""
    if rig.overlap_mpa > 0.0:
        size = abs(error_mpa)
        if size > rig.overlap_mpa:
            s[at + IS_OPEN] = 1.0
        elif size < 0.25 * rig.overlap_mpa:
            s[at + IS_OPEN] = 0.0
        if s[at + IS_OPEN] < 0.5:
            return 0.0
    return max(-1.0, min(1.0, error_mpa / full_open_mpa))


@compiled
def step_valve(
    set_mpa: float,
    volume: float,
    volume_rate_s: float,
    valve: int,
    s: State,
    physics: Physics,
    rig: RigLaw,
    dt_s: float,
) -> None:
    """One step of one regulator and its muscle's chamber. `volume` relative to the joint at zero."""
    at = valve * VALVE_STATES
    p = s[at + PRESSURE]
    gain = rig.gain_1 if valve == 0 else rig.gain_2
    sensed = (p - ATM) / (1.0 + gain * (1.0 + rig.gain_bend * ((p - ATM) / 0.2 - 1.0)))
    target = shaped_set_point(set_mpa, valve, s, at, rig, dt_s)
    full_open = physics.full_open_mpa
    if rig.keep_bandwidth > 0.5:
        full_open *= rig.orifice_fill
    opening = spool_command(target - sensed, s, at, full_open, rig)
    s[at + SPOOL] += dt_s / physics.spool_s * (opening - s[at + SPOOL])
    x = s[at + SPOOL]
    if x >= 0.0:
        supply = s[TANK]
        rate = physics.fill_mpa_s * rig.orifice_fill * (1.0 if valve == 0 else physics.fill_ratio_2)
        flow = x * rate * supply / physics.main_mpa * flow_function(p / supply)
        s[TANK] -= dt_s * rig.tank * flow
    else:
        rate = physics.exhaust_mpa_s * rig.orifice_exhaust * (1.0 if valve == 0 else physics.exhaust_ratio_2)
        flow = x * rate * p / EXHAUST_REFERENCE_MPA * flow_function(ATM / p)
    leak = (rig.leak_1_s if valve == 0 else rig.leak_2_s) * p * flow_function(ATM / p)
    leak += RELIEF_RATE_S * max(0.0, p - ATM - rig.relief_mpa)
    s[at + PRESSURE] = max(ATM, p + dt_s * ((flow - leak) / volume - POLYTROPIC * p * volume_rate_s / volume))
    s[at + LINE] += dt_s / physics.line_s * (s[at + PRESSURE] - s[at + LINE])


@compiled
def muscle_pressure(valve: int, s: State, rig: RigLaw) -> float:
    """Gauge pressure (MPa) inside the muscle, behind a leak that the monitor does not see, above the bladder's
    threshold."""
    p = s[valve * VALVE_STATES + LINE]
    tap = rig.tap_1 if valve == 0 else rig.tap_2
    return max(0.0, p - tap * p * p / EXHAUST_REFERENCE_MPA - ATM - rig.threshold_mpa)
