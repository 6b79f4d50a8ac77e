"""The joint of the seventh family: two beams that unfold against each other, creep, a hinge and what it carries.
Compiled.

Creep by Krejci and Kuhnen's operators with a threshold (Kuhnen 2003): springs whose other ends give way in proportion
to what their stretch exceeds a threshold by. The bearing is Haessig and Friedland's reset integrator (1991), a spring
that is damped and firmer as long as it sticks; by how much firmer grows with the time of rest (Armstrong-Helouvry,
Dupont and Canudas de Wit 1994). A crank moves a carriage to and fro, so that the inertia depends on the angle
(Lagrange). Oil that its own shear warms thins exponentially (Reynolds 1886). Water before a paddle has an inertia and a
drag by the square of the speed (Morison and others 1950). A rubber block pushes by the neo-Hookean law.
"""

import math

from hil.reference.airbeam.beams import CREASE_STATES, beam_torque, beam_volume, fold_on, held, hoof_slope, shake_out
from hil.reference.airbeam.disturbance import RigLaw
from hil.reference.airbeam.physics import ATMOSPHERE_MPA, Physics
from hil.reference.airbeam.pneumatics import RIG_STATES
from hil.reference.airbeam.regulator import AIR, BEHIND, VALVE_STATES
from hil.reference.compiling import State, compiled

CREEPERS = 5
ANGLE, SPEED, BRISTLE, RESTED, OIL = (RIG_STATES + k for k in range(5))
"""BRISTLE: of 1 where the bearing slides; RESTED: how firm it has become, of 1; OIL: its excess temperature."""
CREPT = RIG_STATES + 5
CREASE = CREPT + CREEPERS
STATES = CREASE + CREASE_STATES

CREEP_S = (0.25, 1.1, 4.8, 21.0, 90.0)
CREEP_RAD = (0.02, 0.03, 0.04, 0.05, 0.06)
"""Within which a spring gives way, and the stretch that it holds for ever."""
BRISTLE_RAD, BRISTLE_DAMPING = 0.006, 0.25
FIRMER, RESTED_S, TORN_RAD = 0.35, 0.12, 0.004
"""The most by which a bearing holds firmer at rest, the time and the turn within which that comes and goes."""
THINNING, OIL_W, OIL_S = 1.4, 1.0, 6.0
"""Logarithm by which oil thins at one unit of heat, the shear that keeps it there, and within which it cools."""
PADDLE_PER_RAD = 0.8
"""Drag of the water by the square of the speed, against its inertia."""
LEAF = 0.30
"""By how much a leaf turns with its weight across it (rad)."""
BLOCK_NM, BLOCK_RAD, BLOCK_NM_S, LEAST_STRETCH = 6.0, 0.25, 0.15, 0.2
CATCH_RAD, CATCH_PEAK = 0.12, 16.0 / (3.0 * math.sqrt(3.0))
REST_MPA = 0.2
HALF_HEAT = 0.5
"""Of the heat, what beam 2 gets."""
WARM_SHARE = 0.15


@compiled
def fold_of(beam: int, angle: float, physics: Physics) -> float:
    """Fold (rad) of a beam at an angle of the joint: beam 1 unfolds as it rises."""
    return physics.fold_rad + physics.apart_rad * beam - (1.0 - 2.0 * beam) * angle


@compiled
def far_of(beam: int, rig: RigLaw) -> float:
    """Relative error of a beam's pivot."""
    return rig.far_1 if beam == 0 else rig.far_2


@compiled
def beam_air(beam: int, s: State, physics: Physics, rig: RigLaw) -> tuple[float, float]:
    """(a beam's volume against one of the build at angle zero, what it grows by at this pressure per second)."""
    gauge = s[beam * VALVE_STATES + AIR] - ATMOSPHERE_MPA
    volume, slope = beam_volume(gauge, fold_of(beam, s[ANGLE], physics), far_of(beam, rig), physics)
    growth = -(1.0 - 2.0 * beam) * slope * s[SPEED]
    return (1.0 + rig.stiff) * volume, (1.0 + rig.stiff) * growth


@compiled
def gauge_at_crease(beam: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Gauge pressure (MPa) that unfolds a beam: the mean of before and behind its crease, which may be pinched."""
    at = beam * VALVE_STATES
    gauge = s[at + AIR] - ATMOSPHERE_MPA
    if rig.pinch_s <= 0.0 or rig.pinch_beam != beam:
        return gauge
    corner = math.tan(0.5 * max(0.0, fold_of(beam, s[ANGLE], physics))) / math.tan(0.5 * physics.fold_rad)
    pace = dt_s / (rig.pinch_s * corner * corner + dt_s)
    s[at + BEHIND] += pace * (gauge - s[at + BEHIND])
    return 0.5 * (gauge + s[at + BEHIND])


@compiled
def soaked(time_s: float, warm: float, rig: RigLaw) -> float:
    """Torque that heat has taken: as the root of the time, as heat soaks into a thick wall (Carslaw and Jaeger
    1959)."""
    return rig.heat * math.sqrt(WARM_SHARE * warm + max(0.0, time_s) / rig.heat_s)


@compiled
def unfolding(time_s: float, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of both beams with their creases, without what creeps."""
    lost, total = soaked(time_s, warm, rig), 0.0
    for beam in range(2):
        way, gauge = 1.0 - 2.0 * beam, gauge_at_crease(beam, s, physics, rig, dt_s)
        torque = beam_torque(gauge, fold_of(beam, s[ANGLE], physics), far_of(beam, rig), physics)
        torque *= (1.0 - lost) if beam == 0 else physics.strength_2 * (1.0 - HALF_HEAT * lost)
        total += way * torque * (1.0 + rig.stiff)
        level = physics.crease_nm + physics.crease_nm_mpa * max(0.0, gauge)
        total -= level * held(s[ANGLE], beam, CREASE, s, physics)
    return total


@compiled
def beams_stiffness(physics: Physics) -> float:
    """Stiffness (N m/rad) of both beams at rest, about."""
    torque = 1e6 * REST_MPA * hoof_slope(physics.fold_rad, 0.0, physics)
    return 2.0 * torque * math.tan(0.5 * physics.fold_rad)


@compiled
def creep_torque(s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of what creeps, and one step of it."""
    stiffness, total = (physics.creep + rig.creep) * beams_stiffness(physics) / CREEPERS, 0.0
    for k in range(CREEPERS):
        stretch = s[ANGLE] - s[CREPT + k]
        beyond = stretch - max(-CREEP_RAD[k], min(CREEP_RAD[k], stretch))
        s[CREPT + k] += dt_s / CREEP_S[k] * beyond
        total -= stiffness * stretch
    return total


@compiled
def bearing_torque(level_nm: float, inertia: float, s: State, dt_s: float) -> float:
    """Torque (N m) of the bearing, and one step of its bristle and of how firm it has become."""
    if level_nm <= 0.0:
        return 0.0
    speed = s[SPEED]
    moved = s[BRISTLE] + dt_s * speed / BRISTLE_RAD
    if abs(moved) >= 1.0:
        s[BRISTLE] = math.copysign(1.0, moved)
        s[RESTED] /= 1.0 + dt_s * abs(speed) / TORN_RAD
        return -level_nm * s[BRISTLE] * (1.0 + FIRMER * s[RESTED])
    s[BRISTLE] = moved
    s[RESTED] += dt_s / RESTED_S * (1.0 - s[RESTED])
    damping = 2.0 * BRISTLE_DAMPING * math.sqrt(level_nm / BRISTLE_RAD * inertia)
    return -level_nm * moved * (1.0 + FIRMER * s[RESTED]) - damping * speed


@compiled
def oil_drag(s: State, rig: RigLaw, dt_s: float) -> float:
    """Drag (N m s/rad) of oil that its shear warms, and one step of its temperature."""
    drag = rig.oil_nm_s * math.exp(-THINNING * s[OIL])
    s[OIL] += dt_s / OIL_S * (min(1.5, drag * s[SPEED] * s[SPEED] / OIL_W) - s[OIL])
    return drag


@compiled
def load_torque(angle: float, rig: RigLaw) -> float:
    """Torque (N m) of a weight at the end of a leaf, which bends the more, the more the weight lies across it."""
    turn = angle + rig.load_rad
    return -rig.load_nm * math.sin(turn + LEAF * math.sin(turn))


@compiled
def block_torque(angle: float, speed: float, rig: RigLaw) -> float:
    """Torque (N m) of a rubber block at an end of the travel: neo-Hookean and viscous; it only pushes."""
    over = angle - max(rig.stop_low_rad, min(rig.stop_high_rad, angle))
    if over == 0.0:
        return 0.0
    way, stretch = math.copysign(1.0, over), max(LEAST_STRETCH, 1.0 - abs(over) / BLOCK_RAD)
    return -way * max(0.0, BLOCK_NM * (1.0 / (stretch * stretch) - stretch) + BLOCK_NM_S / stretch * way * speed)


@compiled
def catch_torque(angle: float, rig: RigLaw) -> float:
    """Torque (N m) of a magnet that draws the joint towards an angle."""
    off = (angle - rig.catch_rad) / CATCH_RAD
    return -rig.catch_nm * CATCH_PEAK * off / (1.0 + off * off) ** 2


@compiled
def step_joint(time_s: float, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One semi-implicit step of the joint."""
    angle, speed = s[ANGLE], s[SPEED]
    bush = -physics.bush_nm_rad * angle * (1.0 + physics.bush_cube * angle * angle)
    inertia = physics.inertia_kgm2 + rig.paddle_kgm2 + physics.carriage_kgm2 * math.cos(angle) ** 2
    torque = unfolding(time_s, warm, s, physics, rig, dt_s) + (1.0 + rig.stiff) * bush
    torque += creep_torque(s, physics, rig, dt_s) + load_torque(angle, rig) + block_torque(angle, speed, rig)
    torque += catch_torque(angle, rig) + bearing_torque(physics.bearing_nm + rig.dry_nm, inertia, s, dt_s)
    torque += 0.5 * physics.carriage_kgm2 * math.sin(2.0 * angle) * speed * speed
    drag = physics.drag_nm_s + oil_drag(s, rig, dt_s) + PADDLE_PER_RAD * rig.paddle_kgm2 * abs(speed)
    s[SPEED] = (speed + dt_s / inertia * torque) / (1.0 + dt_s / inertia * drag)
    s[ANGLE] = angle + dt_s * s[SPEED]
    fold_on(angle, s[ANGLE], CREASE, s, physics)


@compiled
def hung(s: State, physics: Physics) -> None:
    """The joint at angle zero, its creases shaken out."""
    shake_out(s[ANGLE], CREASE, s, physics)
