"""Muscles and joint of the second family: membrane muscles on a lever, Dahl hysteresis, stick, air cushions. Compiled.

Force of a fluidic muscle in the form of Sárosi (2012): an exponential of the contraction plus a plane in pressure and
contraction; the numbers are ours. Hysteresis after Dahl (1968) with exponent 1/2, its level growing with each muscle's
own pressure.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.fluidic.disturbance import RigLaw
from hil.reference.fluidic.physics import Physics
from hil.reference.fluidic.pneumatics import RIG_STATES

ANGLE, SPEED, HEAT, FOLDED = RIG_STATES, RIG_STATES + 1, RIG_STATES + 2, RIG_STATES + 3
MESH = RIG_STATES + 4
"""Dahl states: inner and outer loop of muscle 1, then of muscle 2."""
CREEP = MESH + 4
"""Crept stroke (m): fast and slow of muscle 1, then of muscle 2."""
STATES = CREEP + 4

CREEP_S = (1.2, 11.0)
STICK = 1.2
"""Friction at rest against friction in motion."""
CUSHION_RAD = 0.12
DETENT_RAD = 0.05
WARMING_RAD_S = 0.3
"""Speed that heats by one unit."""
LOCKED = 0.13
"""Contraction from which meshes that lock push back."""


@compiled
def muscle_force(pressure_mpa: float, contraction: float, weak: float, physics: Physics) -> float:
    """Force in newtons; a muscle only pulls."""
    plane = (1.0 - weak) * physics.area_n_mpa * pressure_mpa * (1.0 - contraction / physics.end_contraction)
    membrane = (
        physics.membrane_n * (1.0 + pressure_mpa / physics.membrane_mpa) * math.exp(-physics.membrane_per * contraction)
    )
    return max(0.0, plane + membrane)


@compiled
def stroke(angle: float, side: float, physics: Physics) -> float:
    """By how much a muscle is shorter than at angle zero (m); side 1 or -1."""
    bent = side * physics.lever_rad
    return side * physics.lever_m * (math.sin(angle + bent) - math.sin(bent))


@compiled
def crept(taken: float, pressure_mpa: float, at: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Crept part of a stroke (m): two Kelvin elements that give way faster under pressure."""
    total = 0.0
    for i in range(2):
        goal = (0.5 * rig.creep + physics.creep) * taken
        s[at + i] += dt_s / CREEP_S[i] * (0.3 + 0.7 * pressure_mpa / 0.2) * (goal - s[at + i])
        total += s[at + i]
    return total


@compiled
def mesh_friction(turn: float, pressure_mpa: float, at: int, s: State, physics: Physics) -> float:
    """Friction of one muscle's mesh (N) after the joint has turned by `turn` (rad)."""
    total = 0.0
    for i in range(2):
        width = physics.mesh_rad * (1.0 if i == 0 else 5.0)
        room = 1.0 - s[at + i] if turn > 0.0 else 1.0 + s[at + i]
        s[at + i] = max(-1.0, min(1.0, s[at + i] + turn / width * math.sqrt(max(0.0, room))))
        total += 0.5 * s[at + i]
    return total * (physics.mesh_n + physics.mesh_n_mpa * pressure_mpa)


@compiled
def muscles_torque(p1: float, p2: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> tuple[float, float]:
    """(torque of both muscles, sum of their forces) with creep, hysteresis, heat and folds."""
    angle, turn = s[ANGLE], dt_s * s[SPEED]
    bent = physics.lever_rad
    up, down = stroke(angle, 1.0, physics), stroke(angle, -1.0, physics)
    if p2 > rig.snap_mpa:
        s[FOLDED] = 1.0
    elif p2 < rig.snap_mpa - 0.06:
        s[FOLDED] = 0.0
    warm = (1.0 - rig.heat * s[HEAT]) * (1.0 + rig.stiff)
    up_eff = physics.contraction + (up - crept(up, p1, CREEP, s, physics, rig, dt_s)) / physics.length_m
    down_eff = physics.contraction + (down - crept(down, p2, CREEP + 2, s, physics, rig, dt_s)) / physics.length_m
    f1 = warm * muscle_force(p1, up_eff, rig.weak_1, physics)
    f2 = warm * physics.strength_2 * muscle_force(p2, down_eff, rig.weak_2, physics) * (1.0 - rig.snap * s[FOLDED])
    if rig.lockup > 0.0:
        f1 -= 1000.0 * rig.lockup * max(0.0, up_eff - LOCKED)
        f2 -= 1000.0 * rig.lockup * max(0.0, down_eff - LOCKED)
    arm_1, arm_2 = physics.lever_m * math.cos(angle + bent), physics.lever_m * math.cos(angle - bent)
    friction = arm_1 * mesh_friction(turn, p1, MESH, s, physics) + arm_2 * mesh_friction(turn, p2, MESH + 2, s, physics)
    return arm_1 * f1 - arm_2 * f2 - friction, f1 + f2


@compiled
def outer_torque(angle: float, physics: Physics, rig: RigLaw) -> float:
    """Springs, weight, air cushions and a spring that snaps over."""
    total = -(1.0 + rig.stiff) * (physics.passive_nm_rad * angle + physics.passive_fifth_nm * angle**5)
    total -= rig.weight_nm * (math.sin(angle + rig.weight_rad) + 0.12 * math.sin(2.0 * angle))
    high, low = angle - rig.stop_high_rad, rig.stop_low_rad - angle
    if high > 0.0:
        total -= 60.0 * high / max(0.02, 1.0 - high / CUSHION_RAD)
    if low > 0.0:
        total += 60.0 * low / max(0.02, 1.0 - low / CUSHION_RAD)
    return total + rig.detent_nm * math.tanh((angle - rig.detent_rad) / DETENT_RAD)


@compiled
def step_joint(p1: float, p2: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One step of the joint under both muscles' gauge pressures; dry friction holds as long as it can."""
    angle, speed = s[ANGLE], s[SPEED]
    torque, load = muscles_torque(p1, p2, s, physics, rig, dt_s)
    torque += outer_torque(angle, physics, rig)
    inertia = physics.inertia_kgm2 + rig.arm_kgm2 * (1.0 + 0.25 * math.cos(2.0 * angle))
    torque += 0.25 * rig.arm_kgm2 * math.sin(2.0 * angle) * speed * speed
    drag = physics.viscous_nm_s + rig.damper_nm_s * (1.0 + abs(speed) / 1.5)
    dry = physics.bearing_nm + rig.dry_nm * (0.5 + 0.5 * load / 700.0)
    if angle > rig.rub_rad:
        dry += rig.rub_nm
    if speed == 0.0:
        dry *= STICK
    free = (speed + dt_s / inertia * torque) / (1.0 + dt_s / inertia * drag)
    left = abs(free) - dt_s / inertia * dry
    s[SPEED] = math.copysign(left, free) if left > 0.0 else 0.0
    s[ANGLE] = angle + dt_s * s[SPEED]
    s[HEAT] += dt_s / rig.heat_s * (min(2.0, abs(speed) / WARMING_RAD_S) - s[HEAT])
