"""Inside a regulator of the seventh family: a pressure loop on a bus, and in it the place of a spool. Compiled.

The outer loop is a program that comes round once in a bus cycle: PI with a weighted set-point, and an integral that is
tracked back from what is saturated (Astrom and Hagglund 1995). It asks for a flow, which is taken for an opening by
the valve's data; what it decides acts one cycle later, and it steps over most of the spool's lap. The inner loop, PI
too, drives a force motor's coil, which moves the spool against its springs. State is one float array.
"""

import math

from hil.reference.airbeam.disturbance import RigLaw
from hil.reference.airbeam.line import LINE_STATES
from hil.reference.airbeam.physics import ATMOSPHERE_MPA, Physics
from hil.reference.compiling import State, compiled

(SENSED, REPORTED, PHASE, INTEGRAL, NEXT, COMMAND, COIL_SUM, COIL, SPOOL, OUTLET, AIR, MASS, FABRIC, FELT_IN,
 FELT_OUT, LIMITED, BEHIND, MEAN_AT, MEAN) = range(19)  # fmt: skip
"""State of one regulator with its beam: gauge MPa for SENSED, REPORTED and BEHIND (the crease); MPa/s for
INTEGRAL; openings from -1 to 1 for NEXT, COMMAND, COIL and SPOOL; absolute MPa for OUTLET, AIR (the beam's) and both
felts; MASS in MPa of a beam at angle zero; FABRIC: its temperature against the room's; LIMITED: how far the limiting
valve is open; and from MEAN on the last set-points. Regulator 2 follows at VALVE_STATES."""
REMEMBERED = 176
LINE = MEAN + REMEMBERED
VALVE_STATES = LINE + LINE_STATES

BUS_S = 0.002
MEAN_EVERY = 2
"""Cycles from one set-point that is averaged to the next."""
DATA_MPA_S = 3.0
"""Flow of a full opening by the valve's data."""
TRACK_S = 0.06
STEP_OVER = 0.03
"""Opening at which most of the lap is stepped over."""
COIL_GAIN, COIL_PER_S, MOST_COIL = 2.0, 350.0, 1.6
BRIDGE_MPA = 0.2


@compiled
def program_mean(set_mpa: float, at: int, s: State, delay_s: float) -> float:
    """Mean of the last set-points (MPa), as many as make it late by that; the oldest counts in part."""
    every_s = MEAN_EVERY * BUS_S
    newest = int(s[at + MEAN_AT] / MEAN_EVERY) % REMEMBERED
    s[at + MEAN + newest] = set_mpa
    s[at + MEAN_AT] = (s[at + MEAN_AT] + 1.0) % (MEAN_EVERY * REMEMBERED)
    width = min(REMEMBERED - 2.0, 1.0 + 2.0 * delay_s / every_s)
    whole = int(width)
    total = (width - whole) * s[at + MEAN + (newest - whole) % REMEMBERED]
    for k in range(whole):
        total += s[at + MEAN + (newest - k) % REMEMBERED]
    return total / width


@compiled
def by_sensor(valve: int, s: State, rig: RigLaw) -> float:
    """Gauge pressure (MPa) as the program has it: the bridge's span, its zero, a ground shared with the other coil,
    sent by exception."""
    at = valve * VALVE_STATES
    p, gain = s[at + SENSED], rig.gain_1 if valve == 0 else rig.gain_2
    p /= 1.0 + gain * (1.0 + rig.gain_bend * (p - BRIDGE_MPA) / (abs(p) + BRIDGE_MPA))
    p -= rig.offset_1_mpa if valve == 0 else rig.offset_2_mpa
    p += rig.ground_mpa * s[(1 - valve) * VALVE_STATES + COIL]
    if rig.exception_mpa <= 0.0 or abs(p - s[at + REPORTED]) > rig.exception_mpa:
        s[at + REPORTED] = p
    return s[at + REPORTED]


@compiled
def stepped_over(opening: float, physics: Physics) -> float:
    """Place of the spool for an opening: most of its lap is stepped over, softly about its null."""
    known = physics.lap * physics.lap_known
    return opening * (1.0 - known) + known * opening / (abs(opening) + STEP_OVER)


@compiled
def step_program(set_mpa: float, valve: int, s: State, physics: Physics, rig: RigLaw) -> None:
    """One cycle of the outer loop; what it decided in the last one begins to act."""
    at = valve * VALVE_STATES
    s[at + COMMAND] = s[at + NEXT]
    target = program_mean(set_mpa, at, s, rig.mean_s) if rig.mean_s > 0.0 else set_mpa
    p = by_sensor(valve, s, rig)
    flow = physics.gain_per_s * (physics.weight * target - p) + s[at + INTEGRAL]
    opening = max(-1.0, min(1.0, flow / DATA_MPA_S))
    unmet = DATA_MPA_S * opening - flow
    s[at + INTEGRAL] += BUS_S * (physics.gain_per_s * (target - p) / physics.integral_s + unmet / TRACK_S)
    s[at + NEXT] = stepped_over(opening, physics)


@compiled
def step_coil(at: int, s: State, physics: Physics, dt_s: float) -> None:
    """One step of the inner loop, its coil and the spool."""
    off = s[at + COMMAND] - s[at + SPOOL]
    asked = COIL_GAIN * off + s[at + COIL_SUM]
    driven = max(-MOST_COIL, min(MOST_COIL, asked))
    if driven == asked or off * asked < 0.0:
        s[at + COIL_SUM] += dt_s * COIL_PER_S * off
    s[at + COIL] += dt_s / (physics.coil_s + dt_s) * (driven - s[at + COIL])
    s[at + SPOOL] += dt_s / (physics.spool_s + dt_s) * (s[at + COIL] - s[at + SPOOL])


@compiled
def step_control(set_mpa: float, valve: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Travel of a regulator's spool beyond its lap after one step: above zero it fills."""
    at = valve * VALVE_STATES
    gauge = s[at + OUTLET] - ATMOSPHERE_MPA
    s[at + SENSED] += dt_s / (physics.sensor_s + dt_s) * (gauge - s[at + SENSED])
    s[at + PHASE] += dt_s
    if s[at + PHASE] > BUS_S - 1e-9:
        s[at + PHASE] -= BUS_S
        step_program(set_mpa, valve, s, physics, rig)
    step_coil(at, s, physics, dt_s)
    beyond = max(0.0, abs(s[at + SPOOL]) - physics.lap) / (1.0 - physics.lap)
    return math.copysign(min(1.0, beyond), s[at + SPOOL])


@compiled
def balanced(p_mpa: float, valve: int, s: State, physics: Physics) -> None:
    """A regulator after a long time at a gauge pressure."""
    at = valve * VALVE_STATES
    s[at + SENSED] = s[at + REPORTED] = s[at + BEHIND] = p_mpa
    s[at + INTEGRAL] = physics.gain_per_s * (1.0 - physics.weight) * p_mpa
    for k in range(REMEMBERED):
        s[at + MEAN + k] = p_mpa
