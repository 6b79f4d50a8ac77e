"""Inside a regulator of the sixth family: force motor, beam, flapper, nozzle, spool, and a slow trim. Compiled.

A force-balance converter before a booster: the current of a force motor pulls a beam against a bellows that feels the
outlet; the beam's flapper throttles a nozzle, whose back pressure moves a spool of finite travel (Blackburn, Reethof
and Shearer 1960; Anderson 1967). What the beam is out of balance a slow controller trims away. State is one float
array.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.sleeve.disturbance import RigLaw
from hil.reference.sleeve.physics import Physics

CURRENT, BACK, SPOOL, TRIM, TRIM_PHASE, STILL_S, MOTOR, ICE, POPPED, OUTLET, AIR, MASS, EDDY = range(13)
"""State of one regulator with its muscle: gauge MPa for CURRENT, TRIM and MOTOR; BACK of 1; SPOOL from -1 to 1; OUTLET
and AIR (the muscle's) absolute MPa; MASS relative to 1 MPa in a muscle at angle zero. Three modes of EDDY follow each
other; regulator 2 follows at VALVE_STATES."""
VALVE_STATES = 16

EDDY_WEIGHT = tuple(8.0 / (math.pi * (2 * k + 1)) ** 2 for k in range(3))
EDDY_MEAN = math.pi**2 / 12.0
"""Mean delay of a core's flux against its slowest time constant (diffusion into a plate, Stoll 1974)."""
MOTOR_STEP_MPA = 0.001
HALF_GAP = 0.5
TRIM_S, TRIM_MOST_MPA = 0.02, 0.03
SAVER_S = 0.04
CUBE_AT_MPA = 0.2


@compiled
def through_core(target: float, at: int, s: State, delay_s: float, dt_s: float) -> float:
    """The flux in a solid core behind its current: three modes of diffusion, and at once what is left of them."""
    slow_s, total, left = delay_s / EDDY_MEAN, 0.0, 1.0
    for k in range(3):
        pace = dt_s * (2 * k + 1) ** 2 / slow_s
        s[at + EDDY + k] = (s[at + EDDY + k] + pace * target) / (1.0 + pace)
        total += EDDY_WEIGHT[k] * s[at + EDDY + k]
        left -= EDDY_WEIGHT[k]
    return total + left * target


@compiled
def turned(target: float, at: int, s: State, rate_mpa_s: float, dt_s: float) -> float:
    """A stepping motor's place on its way to a set-point: whole steps, as fast as it can."""
    s[at + MOTOR] += max(-rate_mpa_s * dt_s, min(rate_mpa_s * dt_s, target - s[at + MOTOR]))
    return MOTOR_STEP_MPA * math.floor(s[at + MOTOR] / MOTOR_STEP_MPA + 0.5)


@compiled
def wanted(set_mpa: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """The gauge pressure (MPa) that the force motor stands for: stepping motor, span, zero, driver, solid core."""
    at, target = valve * VALVE_STATES, set_mpa
    if rig.motor_mpa_s > 0.0:
        target = turned(target, at, s, rig.motor_mpa_s, dt_s)
    gain = rig.gain_1 if valve == 0 else rig.gain_2
    target *= 1.0 + gain * (1.0 + rig.gain_bend * (((set_mpa - CUBE_AT_MPA) / CUBE_AT_MPA) ** 3))
    target += rig.offset_1_mpa if valve == 0 else rig.offset_2_mpa
    if rig.eddy_s > 0.0:
        target = through_core(target, at, s, rig.eddy_s, dt_s)
    s[at + CURRENT] += dt_s / (physics.driver_s + dt_s) * (target - s[at + CURRENT])
    return s[at + CURRENT]


@compiled
def step_trim(error: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """The beam's imbalance (MPa) that is left, after the trim's own step when its period is over."""
    at = valve * VALVE_STATES
    s[at + TRIM_PHASE] += dt_s
    if s[at + TRIM_PHASE] >= TRIM_S:
        s[at + TRIM_PHASE] -= TRIM_S
        trim = s[at + TRIM] + TRIM_S * physics.trim_per_s * error
        s[at + TRIM] = max(-TRIM_MOST_MPA, min(TRIM_MOST_MPA, trim))
    beam = physics.beam_1_mpa if valve == 0 else physics.beam_2_mpa
    return beam + s[at + TRIM]


@compiled
def back_flow(gap: float, back: float) -> float:
    """Rate at which the back pressure rises: in through the restriction, out past a flapper that stands off by `gap`
    (1 halves it)."""
    return math.sqrt(max(0.0, 1.0 - back)) - gap * math.sqrt(max(0.0, back))


@compiled
def step_spool(error: float, s: State, at: int, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Opening from -1 (exhaust) to 1 (fill) after one step of flapper, nozzle and spool under an error (MPa)."""
    gap = max(0.0, min(1.0, HALF_GAP - error / physics.band_mpa)) / HALF_GAP
    s[at + BACK] = max(0.0, min(1.0, s[at + BACK] + dt_s / physics.nozzle_s * back_flow(gap, s[at + BACK])))
    goal = max(-1.0, min(1.0, physics.relay * (s[at + BACK] - 0.5)))
    s[at + SPOOL] += dt_s / (physics.spool_s + dt_s) * (goal - s[at + SPOOL])
    return s[at + SPOOL]


@compiled
def step_control(set_mpa: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Opening of a regulator's spool after one step of everything that moves it."""
    at = valve * VALVE_STATES
    error = wanted(set_mpa, valve, s, physics, rig, dt_s) - (s[at + OUTLET] - physics.atmosphere_mpa)
    if rig.saver_mpa > 0.0:
        s[at + STILL_S] = s[at + STILL_S] + dt_s if abs(error) < rig.saver_mpa else 0.0
        if s[at + STILL_S] > SAVER_S:
            s[at + SPOOL] = 0.0
            return 0.0
    left = step_trim(error, valve, s, physics, rig, dt_s)
    if rig.restart_valve == valve:
        left += rig.beam_mpa
    return step_spool(error + left, s, at, physics, rig, dt_s)
