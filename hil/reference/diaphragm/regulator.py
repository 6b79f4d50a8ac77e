"""Inside a regulator of the eighth family: two pulsed solenoids on a dome, a relieving volume booster. Compiled.

The build is that of SMC's ITV and of Proportion-Air's QB with a booster: a program compares the set-point with a sensor
at the outlet and pulses a feed or an exhaust solenoid, which fills or empties the dome over a diaphragm. What is less
than the shortest pulse is saved up until it is one (pulse-frequency modulation). The dome's excess over the outlet
lifts a feed or a relief poppet; the stem's O-ring sticks. State is one float array.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.diaphragm.disturbance import RigLaw
from hil.reference.diaphragm.physics import ATMOSPHERE_MPA, Physics

(SENSED, PHASE, SAVED, PULSE, FEED, VENT, DOME, STEM, QUICK, SLOW, OUTLET, INTO, AIR, MASS, RESTED, BEHIND) = range(16)
VALVE_STATES = 16
"""State of one regulator with its cylinder: gauge MPa for SENSED, STEM and the amplifier's QUICK and SLOW; s for PHASE,
SAVED and PULSE, which are below zero to exhaust; openings for FEED and VENT; absolute MPa for DOME, OUTLET and AIR (the
cylinder's); INTO: flow through the tube (MPa/s); MASS and RESTED as in `pneumatics`; BEHIND: air behind the piston, as
the pressure it has in the middle. Regulator 2 follows at VALVE_STATES."""

CYCLE_S = 0.003
QUICK_SHARE, QUICK_TIME = 0.45, 0.4
"""Share of an amplifier's output that is quick, and its time constant against the mean."""
SLOW_TIME = (1.0 - QUICK_SHARE * QUICK_TIME) / (1.0 - QUICK_SHARE)
RANGE_MPA = 0.5
CRACKED = 0.02
"""Difference of pressure, against the upstream one, below which a flow is taken for laminar (Beater 2007)."""
DOME_RATIO, REFERENCE_MPA = 0.35, 0.3
GIVES_PER_S = 400.0
"""Rate by which a dome gives way, per pressure beyond its limit."""


@compiled
def ellipse(ratio: float, critical: float) -> float:
    """Flow at a ratio of downstream to upstream absolute pressure, against the choked one (Sanville 1971)."""
    if ratio >= 1.0:
        return 0.0
    if ratio <= critical:
        return 1.0
    edge = max(critical, 1.0 - CRACKED)
    off = (max(ratio, critical) - critical) / (1.0 - critical)
    if ratio <= edge:
        return math.sqrt(1.0 - off * off)
    at_edge = (edge - critical) / (1.0 - critical)
    return math.sqrt(1.0 - at_edge * at_edge) * (1.0 - ratio) / (1.0 - edge)


@compiled
def in_series(first: float, second: float) -> float:
    """Conductance of two restrictions behind one another (Eckersten 1975: their cubes)."""
    if first <= 0.0 or second <= 0.0:
        return 0.0
    return first * second / math.pow(first * first * first + second * second * second, 1.0 / 3.0)


@compiled
def amplified(set_mpa: float, at: int, s: State, rig: RigLaw, dt_s: float) -> float:
    """The set-point (MPa) behind a compensated amplifier: a quick part and a slow one."""
    if rig.amplifier_s <= 0.0:
        return set_mpa
    s[at + QUICK] += (1.0 - math.exp(-dt_s / (QUICK_TIME * rig.amplifier_s))) * (set_mpa - s[at + QUICK])
    s[at + SLOW] += (1.0 - math.exp(-dt_s / (SLOW_TIME * rig.amplifier_s))) * (set_mpa - s[at + SLOW])
    return QUICK_SHARE * s[at + QUICK] + (1.0 - QUICK_SHARE) * s[at + SLOW]


@compiled
def spanned(set_mpa: float, valve: int, rig: RigLaw) -> float:
    """The set-point (MPa) behind the span and the zero of a comparator's input."""
    gain, zero = (rig.gain_1, rig.offset_1_mpa) if valve == 0 else (rig.gain_2, rig.offset_2_mpa)
    swell = 1.0 + rig.gain_bend * math.sin(math.pi * max(0.0, min(1.0, set_mpa / RANGE_MPA)))
    return set_mpa * (1.0 + gain * swell) + zero


@compiled
def by_sensor(valve: int, s: State, physics: Physics) -> float:
    """Gauge pressure (MPa) as the program has it."""
    zero, span = (physics.zero_1_mpa, physics.span_1) if valve == 0 else (physics.zero_2_mpa, physics.span_2)
    return s[valve * VALVE_STATES + SENSED] * (1.0 + span) + zero


@compiled
def step_program(asked_mpa: float, valve: int, s: State, physics: Physics, rig: RigLaw) -> None:
    """One cycle: what pulse is due."""
    at = valve * VALVE_STATES
    off = asked_mpa - by_sensor(valve, s, physics)
    if abs(off) <= physics.numb_mpa + 0.5 * rig.sticky_mpa:
        s[at + SAVED] = s[at + PULSE] = 0.0
        return
    due = s[at + SAVED] + CYCLE_S * max(-1.0, min(1.0, physics.duty_per_mpa * off))
    ready = abs(due) >= physics.shortest_s
    s[at + PULSE] = max(-CYCLE_S, min(CYCLE_S, due)) if ready else 0.0
    s[at + SAVED] = 0.0 if ready else due


@compiled
def step_solenoids(at: int, s: State, physics: Physics, dt_s: float) -> None:
    """One step of both solenoids and of the pulse that one of them has."""
    driven = max(-1.0, min(1.0, s[at + PULSE] / dt_s))
    s[at + PULSE] -= driven * dt_s
    pace = dt_s / (physics.solenoid_s + dt_s)
    s[at + FEED] += pace * (max(0.0, driven) - s[at + FEED])
    s[at + VENT] += pace * (max(0.0, -driven) - s[at + VENT])


@compiled
def step_dome(supply: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One step of a dome's pressure: both solenoids, a jet in its line, a seat that weeps, a limit that gives way."""
    at, weep = valve * VALVE_STATES, rig.weep_1_mpa_s if valve == 0 else rig.weep_2_mpa_s
    dome = s[at + DOME]
    feed, vent = physics.pilot_mpa_s * s[at + FEED], physics.vent_mpa_s * s[at + VENT]
    if rig.jet_mpa_s > 0.0:
        feed, vent = in_series(feed, rig.jet_mpa_s), in_series(vent, rig.jet_mpa_s)
    rate = (feed + weep) * supply / physics.main_mpa * ellipse(dome / supply, DOME_RATIO)
    rate -= vent * dome / REFERENCE_MPA * ellipse(ATMOSPHERE_MPA / dome, DOME_RATIO)
    rate -= GIVES_PER_S * max(0.0, dome - ATMOSPHERE_MPA - rig.dome_limit_mpa)
    s[at + DOME] = max(ATMOSPHERE_MPA, dome + dt_s * rate)
    half = physics.ring_mpa + 0.5 * rig.sticky_mpa
    gauge = s[at + DOME] - ATMOSPHERE_MPA
    s[at + STEM] = max(gauge - half, min(gauge + half, s[at + STEM]))


@compiled
def lift(valve: int, s: State, physics: Physics) -> float:
    """How far a poppet is lifted, above zero the feed's, below zero the relief's."""
    at = valve * VALVE_STATES
    excess = s[at + STEM] - (s[at + OUTLET] - ATMOSPHERE_MPA)
    return math.copysign(min(1.0, max(0.0, abs(excess) - physics.seat_mpa) / physics.lift_mpa), excess)


@compiled
def step_control(
    set_mpa: float, supply: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> float:
    """Lift of a regulator's poppets after one step."""
    at = valve * VALVE_STATES
    tapped = s[at + OUTLET] - ATMOSPHERE_MPA + rig.pitot_mpa * s[at + INTO] * abs(s[at + INTO])
    s[at + SENSED] += dt_s / (physics.sensor_s + dt_s) * (tapped - s[at + SENSED])
    asked = spanned(amplified(set_mpa, at, s, rig, dt_s), valve, rig)
    s[at + PHASE] += dt_s
    if s[at + PHASE] > CYCLE_S - 1e-9:
        s[at + PHASE] -= CYCLE_S
        step_program(asked, valve, s, physics, rig)
    step_solenoids(at, s, physics, dt_s)
    step_dome(supply, valve, s, physics, rig, dt_s)
    return lift(valve, s, physics)


@compiled
def balanced(p_mpa: float, valve: int, s: State) -> None:
    """A regulator after a long time at a gauge pressure."""
    at = valve * VALVE_STATES
    s[at + SENSED] = s[at + STEM] = s[at + QUICK] = s[at + SLOW] = p_mpa
    s[at + DOME] = s[at + OUTLET] = p_mpa + ATMOSPHERE_MPA
