"""The joint of the eighth family: two cylinders against each other on a Scotch yoke, and what it carries. Compiled.

The pin of the joint's lever slides in a slot of the yoke, so that the stroke is the tangent of the lever's angle and
the moment arm one over the square of its cosine, as in quarter-turn valve actuators; a lever that is canted at angle
zero makes both sides unlike. The yoke and what it pushes along are inertia by the square of that arm (Lagrange). A ball
rolls in a tube on the arm with 5/7 of gravity. Behind a piston is the atmosphere, or air that leaves through a vent.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.diaphragm.bearing import bearing_torque, damper_drag, slot_torque, stack_torque
from hil.reference.diaphragm.cylinder import (
    ROLLS,
    RUBBER_STATES,
    area,
    push,
    roll_force,
    roll_on,
    rubber_force,
    volume,
)
from hil.reference.diaphragm.disturbance import RigLaw
from hil.reference.diaphragm.physics import ATMOSPHERE_MPA, Physics
from hil.reference.diaphragm.pneumatics import RIG_STATES
from hil.reference.diaphragm.regulator import AIR, BEHIND, VALVE_STATES

ANGLE, SPEED, BRISTLE, DWELT, BALL, BALL_SPEED = (RIG_STATES + k for k in range(6))
"""BALL: place in its tube, -1 to 1."""
ROLLED = RIG_STATES + 6
RUBBER = ROLLED + 2 * ROLLS
STATES = RUBBER + RUBBER_STATES

BEHIND_M, LEAST_BEHIND = 0.040, 0.15
"""Length of the air behind a piston in the middle, and the least share of it."""
SECOND_HEAT, QUICK_HEAT, HOUSING = 0.55, 0.7, 6.0
"""Of the heat, what cylinder 2 gets, what the diaphragm alone takes, and how much slower the housing is."""
WARM_SHARE = 0.15
CHAIN = 0.8
"""By how much more chain hangs for each arm's length of height."""
BALL_PER_S2, BALL_DRAG_PER_S, BALL_RESTS, BALL_BACK = 55.0, 2.0, 0.02, 0.3
"""Acceleration (half tubes per s^2) of a ball in a tube on end, its drag, sine of the slope on which it stays, and what
is left of its speed at an end."""


@compiled
def stroke(angle: float, physics: Physics) -> float:
    """Stroke (m) of the yoke at an angle of the joint."""
    return physics.arm_m * (math.tan(angle + physics.cant_rad) - math.tan(physics.cant_rad))


@compiled
def moment_arm(angle: float, physics: Physics) -> float:
    """Stroke per angle (m/rad)."""
    turned = math.cos(angle + physics.cant_rad)
    return physics.arm_m / (turned * turned)


@compiled
def out(cylinder: int, angle: float, physics: Physics) -> float:
    """Stroke (m) of a cylinder out from its middle: cylinder 1 goes out as the angle rises."""
    return (1.0 - 2.0 * cylinder) * stroke(angle, physics) + physics.apart_m * cylinder


@compiled
def wide_of(cylinder: int, rig: RigLaw) -> float:
    """Relative error of a diaphragm's size."""
    return rig.wide_1 if cylinder == 0 else rig.wide_2


@compiled
def cylinder_air(cylinder: int, s: State, physics: Physics, rig: RigLaw) -> float:
    """A cylinder's volume against one of the build at angle zero."""
    gauge = s[cylinder * VALVE_STATES + AIR] - ATMOSPHERE_MPA
    return (1.0 + rig.stiff) * volume(gauge, out(cylinder, s[ANGLE], physics), wide_of(cylinder, rig), physics)


@compiled
def behind_force(cylinder: int, stroke_m: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Force (N) of the air behind a piston, and one step of what leaves through its vent."""
    if rig.vent_s <= 0.0 or rig.vent_cylinder != cylinder:
        return 0.0
    at = cylinder * VALVE_STATES + BEHIND
    share = max(LEAST_BEHIND, 1.0 - stroke_m / BEHIND_M)
    pace = dt_s / (rig.vent_s + dt_s)
    s[at] += pace * (ATMOSPHERE_MPA * share - s[at])
    return -1e6 * area(0.0, 0.0, physics) * (s[at] / share - ATMOSPHERE_MPA)


@compiled
def taken_by_heat(time_s: float, warm: float, rig: RigLaw) -> float:
    """Share of the force that heat has taken: a diaphragm that warms quickly, in a housing that warms slowly."""
    if rig.heat == 0.0:
        return 0.0
    t = max(0.0, time_s) / rig.heat_s
    grown = QUICK_HEAT * (1.0 - math.exp(-t)) + (1.0 - QUICK_HEAT) * (1.0 - math.exp(-t / HOUSING))
    return rig.heat * (WARM_SHARE * warm + grown)


@compiled
def yoke_force(time_s: float, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Force (N) of both cylinders on the yoke, with how they resist rolling, and of their rubber."""
    taken, total = taken_by_heat(time_s, warm, rig), 0.0
    for cylinder in range(2):
        way, at = out(cylinder, s[ANGLE], physics), cylinder * VALVE_STATES
        gauge = s[at + AIR] - ATMOSPHERE_MPA
        force = push(gauge, way, wide_of(cylinder, rig), physics)
        force *= (1.0 - taken) if cylinder == 0 else physics.strength_2 * (1.0 - SECOND_HEAT * taken)
        force = force * (1.0 + rig.stiff) + roll_force(gauge, ROLLED + cylinder * ROLLS, s, physics)
        total += (1.0 - 2.0 * cylinder) * (force + behind_force(cylinder, way, s, physics, rig, dt_s))
    return total + rubber_force(rig.rubber, stroke(s[ANGLE], physics), RUBBER, s, physics, dt_s)


@compiled
def load_torque(angle: float, rig: RigLaw) -> float:
    """Torque (N m) of a chain on an arm: the higher the arm, the more of it hangs."""
    turn = angle + rig.load_rad
    return -rig.load_nm * math.sin(turn) * (1.0 + CHAIN * (1.0 - math.cos(turn)))


@compiled
def ball_torque(s: State, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of a ball that rolls to the lower end of its tube, and one step of it."""
    if rig.ball_nm <= 0.0:
        return 0.0
    slope = math.sin(s[ANGLE] - rig.ball_rad)
    pulled = -BALL_PER_S2 * (slope - max(-BALL_RESTS, min(BALL_RESTS, slope)))
    s[BALL_SPEED] = (s[BALL_SPEED] + dt_s * pulled) / (1.0 + dt_s * BALL_DRAG_PER_S)
    s[BALL] += dt_s * s[BALL_SPEED]
    if abs(s[BALL]) > 1.0:
        s[BALL] = math.copysign(1.0, s[BALL])
        s[BALL_SPEED] *= -BALL_BACK
    return -rig.ball_nm * s[BALL] * math.cos(s[ANGLE] - rig.ball_rad)


@compiled
def inertias(angle: float, physics: Physics, rig: RigLaw) -> tuple[float, float]:
    """(inertia in kg m^2, half of its slope by the angle): what turns, and what the yoke moves."""
    arm, lever = moment_arm(angle, physics), angle + physics.cant_rad
    at_zero = moment_arm(0.0, physics)
    moved = (physics.yoke_kg + rig.sledge_kgm2 / (at_zero * at_zero)) * arm * arm
    return physics.inertia_kgm2 + moved, 2.0 * moved * math.tan(lever)


@compiled
def step_joint(time_s: float, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One semi-implicit step of the joint."""
    angle, speed = s[ANGLE], s[SPEED]
    inertia, slope = inertias(angle, physics, rig)
    carried = moment_arm(angle, physics) * yoke_force(time_s, warm, s, physics, rig, dt_s)
    spring = -physics.spring_nm_rad * angle * (1.0 + physics.spring_cube * angle * angle)
    torque = carried + slot_torque(carried, angle + physics.cant_rad, speed, physics.slot)
    torque += (1.0 + rig.stiff) * spring + load_torque(angle, rig) + ball_torque(s, rig, dt_s)
    torque += stack_torque(angle, speed, rig) - slope * speed * speed
    torque += bearing_torque(physics.bearing_nm + rig.dry_nm, inertia, BRISTLE, s, speed, dt_s)
    drag = physics.drag_nm_s + damper_drag(speed, rig)
    s[SPEED] = (speed + dt_s / inertia * torque) / (1.0 + dt_s / inertia * drag)
    s[ANGLE] = angle + dt_s * s[SPEED]
    rolled = stroke(s[ANGLE], physics) - stroke(angle, physics)
    roll_on(rolled, ROLLED, s, physics)
    roll_on(-rolled, ROLLED + ROLLS, s, physics)


@compiled
def rested(s: State, physics: Physics, rig: RigLaw) -> None:
    """The joint where it is, its diaphragms and rubber as after a long rest there."""
    for k in range(2 * ROLLS):
        s[ROLLED + k] = 0.0
    for k in range(RUBBER_STATES):
        s[RUBBER + k] = stroke(s[ANGLE], physics)
    s[BALL] = math.copysign(1.0, rig.ball_rad - s[ANGLE])
