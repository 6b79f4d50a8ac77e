"""Inside a regulator of the ninth family: two banks of binary-weighted valves, open or shut, under a program. Compiled.

Pulse code modulation as in digital fluid power (Linjama 2011): of five valves in parallel, each with twice the flow of
the one before, those are opened whose sum is nearest to the flow that the program asks for; what the code leaves over
is carried to the next cycle (first-order noise shaping, as in a delta-sigma converter). The program asks in proportion
to the error, takes the banks' conductances from their data, and shuts both banks within a zone. State is one float
array.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.pouch.disturbance import RigLaw
from hil.reference.pouch.physics import ATMOSPHERE_MPA, Physics

(
    SENSED,
    PHASE,
    LEFT,
    CODE,
    FEED,
    VENT,
    LAGGED,
    BUDGET,
    ZONE,
    BEFORE,
    BEHIND,
    OUTLET,
    AIR,
    MASS,
    HEAT,
    ROOM,
    OPENING,
    HALF,
    ANCHOR,
    PEELED,
) = range(20)
VALVE_STATES = 20
"""State of one regulator with its muscle: gauge MPa for SENSED, LAGGED, BUDGET and ZONE; s for PHASE; codes for LEFT
and CODE, below zero to exhaust; openings, 0 to 1, for FEED and VENT; absolute MPa for BEFORE and BEHIND (in the pipes
before the inlet and behind the exhaust), OUTLET and AIR (the muscle's); MASS, HEAT and ROOM as in `pneumatics`;
OPENING: the pouches' half angle (rad), HALF: the tangent of half of it; ANCHOR and PEELED in m. Regulator 2 follows at
VALVE_STATES."""

CYCLE_S = 0.002
CODES = 31
SHUT = 1e-4
"""Opening that is none."""
RANGE_MPA = 0.5
REFERENCE_MPA = 0.3
DIODE_MPA, DIODE = 0.02, 3.0
"""Difference from which on a diode conducts, and its conductance against the filter's."""
FOLD = 0.35
"""By how much a program asks for less, per pressure that it is asked for too much."""
NARROWS_S, NARROWEST, REARMED = 1.5, 0.3, 0.25
"""Within which a zone narrows, to which share, and the share of it at which a bank shuts again."""
WAVES = (1.0, 0.437, 1.713)
"""Frequencies of a zero that wanders, against the first."""


@compiled
def filtered(set_mpa: float, at: int, s: State, rig: RigLaw, dt_s: float) -> float:
    """The set-point (MPa) behind a filter that a diode bridges, which hurries it when it is far behind."""
    if rig.lag_s <= 0.0:
        return set_mpa
    off = set_mpa - s[at + LAGGED]
    hurried = off + DIODE * (off - max(-DIODE_MPA, min(DIODE_MPA, off)))
    s[at + LAGGED] += (1.0 - math.exp(-dt_s / rig.lag_s)) * hurried
    return s[at + LAGGED]


@compiled
def folded(set_mpa: float, rig: RigLaw) -> float:
    """What a program asks for (MPa) that folds back: beyond its limit the less, the more it is asked for."""
    return set_mpa - (1.0 + FOLD) * max(0.0, set_mpa - rig.fold_mpa)


@compiled
def wandered(time_s: float, valve: int, rig: RigLaw) -> float:
    """Error (MPa) of a sensor's zero that wanders: three waves that have no common period."""
    if rig.wander_mpa == 0.0:
        return 0.0
    total, turn = 0.0, max(0.0, time_s) / rig.wander_s
    for k in range(3):
        total += math.sin(WAVES[k] * turn + rig.wander_rad * (k + 1.0) + 2.1 * valve)
    return rig.wander_mpa * math.sqrt(2.0 / 3.0) * total


@compiled
def by_sensor(time_s: float, valve: int, s: State, physics: Physics, rig: RigLaw) -> float:
    """Gauge pressure (MPa) as the program has it."""
    first = valve == 0
    zero, span = (physics.zero_1_mpa, physics.span_1) if first else (physics.zero_2_mpa, physics.span_2)
    less, offset = (rig.gain_1, rig.offset_1_mpa) if first else (rig.gain_2, rig.offset_2_mpa)
    p = s[valve * VALVE_STATES + SENSED]
    less *= 1.0 + rig.gain_bend * (1.0 - 2.0 * max(0.0, min(1.0, p / RANGE_MPA)))
    return p * (1.0 + span) / (1.0 + less) + zero - offset + wandered(time_s, valve, rig)


@compiled
def protected(code: float, at: int, s: State, physics: Physics, rig: RigLaw) -> float:
    """What a coil's protection lets through of a code: short bursts, for long no more than its rate."""
    if rig.budget_mpa_s <= 0.0:
        return code
    s[at + BUDGET] = min(rig.budget_mpa, s[at + BUDGET] + CYCLE_S * rig.budget_mpa_s)
    per_code = CYCLE_S * physics.feed_mpa_s / CODES
    allowed = min(abs(code), max(0.0, s[at + BUDGET]) / per_code)
    s[at + BUDGET] -= per_code * allowed
    return math.copysign(allowed, code)


@compiled
def stays_shut(off_mpa: float, at: int, s: State, physics: Physics, rig: RigLaw) -> bool:
    """Whether a bank stays shut at an error: within a small zone, or a wide one that narrows as long as it does."""
    half = 0.5 * rig.zone_mpa
    if s[at + ZONE] <= 0.0:
        if abs(off_mpa) > max(physics.zone_mpa, REARMED * half):
            return False
        s[at + ZONE] = half
    if abs(off_mpa) > max(physics.zone_mpa, s[at + ZONE]):
        s[at + ZONE] = 0.0
        return False
    s[at + ZONE] += CYCLE_S / NARROWS_S * (NARROWEST * half - s[at + ZONE])
    return True


@compiled
def step_program(off_mpa: float, supply: float, at: int, s: State, physics: Physics, rig: RigLaw) -> None:
    """One cycle: which code both banks have."""
    if stays_shut(off_mpa, at, s, physics, rig):
        s[at + LEFT] = s[at + CODE] = 0.0
        return
    if off_mpa > 0.0:
        rate = physics.known_feed * physics.feed_mpa_s * supply / physics.main_mpa
    else:
        rate = physics.known_vent * physics.vent_mpa_s * s[at + OUTLET] / REFERENCE_MPA
    wanted = CODES * physics.gain_per_s * off_mpa / rate + s[at + LEFT]
    code = max(-float(CODES), min(float(CODES), math.floor(wanted + 0.5)))
    s[at + LEFT] = max(-1.0, min(1.0, wanted - code))
    s[at + CODE] = protected(code, at, s, physics, rig)


@compiled
def step_valves(at: int, s: State, physics: Physics, dt_s: float) -> None:
    """One step of both banks' openings towards the code."""
    share = s[at + CODE] / CODES
    for bank in (FEED, VENT):
        goal = max(0.0, share if bank == FEED else -share)
        time_s = physics.open_s if goal > s[at + bank] else physics.close_s
        s[at + bank] += dt_s / (time_s + dt_s) * (goal - s[at + bank])
        if s[at + bank] < SHUT:
            s[at + bank] = 0.0


@compiled
def step_control(
    set_mpa: float, time_s: float, supply: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> None:
    """One step of a regulator's sensor, program and banks."""
    at = valve * VALVE_STATES
    s[at + SENSED] += dt_s / (physics.sensor_s + dt_s) * (s[at + OUTLET] - ATMOSPHERE_MPA - s[at + SENSED])
    asked = folded(filtered(set_mpa, at, s, rig, dt_s), rig)
    s[at + PHASE] += dt_s
    if s[at + PHASE] > CYCLE_S - 1e-9:
        s[at + PHASE] -= CYCLE_S
        step_program(asked - by_sensor(time_s, valve, s, physics, rig), supply, at, s, physics, rig)
    step_valves(at, s, physics, dt_s)


@compiled
def balanced(p_mpa: float, valve: int, s: State, physics: Physics, rig: RigLaw) -> None:
    """A regulator after a long time at a gauge pressure."""
    at = valve * VALVE_STATES
    s[at + SENSED] = s[at + LAGGED] = p_mpa
    s[at + OUTLET], s[at + BEFORE], s[at + BEHIND] = p_mpa + ATMOSPHERE_MPA, physics.main_mpa, ATMOSPHERE_MPA
    s[at + BUDGET], s[at + ZONE] = rig.budget_mpa, 0.5 * rig.zone_mpa
