"""Muscles and joint: McKibben forces, Maxwell slip, relaxing springs, dry friction, inertia, contact. Compiled.

Force law of Chou and Hannaford (1996): F = pi r^2 p (a (1 - e)^2 - b), a = 3/tan^2(alpha), b = 1/sin^2(alpha),
contraction e.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.mckibben.disturbance import RigLaw
from hil.reference.mckibben.physics import Physics
from hil.reference.mckibben.pneumatics import TANK

ANGLE, SPEED, LUGRE = TANK + 1, TANK + 2, TANK + 3
SLIP = TANK + 4
RELAX = SLIP + 4
STATES = RELAX + 4

SLIP_YIELD_RAD = (0.004, 0.010, 0.025, 0.060)
SLIP_SHARE = (0.35, 0.30, 0.20, 0.15)
RELAX_S = (0.3, 1.4, 6.5, 30.0)
ACTIVE_STIFFNESS_NM_RAD = 27.0
STRIBECK_RAD_S = 0.15


@compiled
def muscle_force(pressure_mpa: float, contraction: float, braid_rad: float, radius_m: float) -> float:
    """Force in newtons; a muscle only pulls."""
    a, b = 3.0 / math.tan(braid_rad) ** 2, 1.0 / math.sin(braid_rad) ** 2
    return max(0.0, 1e6 * pressure_mpa * math.pi * radius_m**2 * (a * (1.0 - contraction) ** 2 - b))


@compiled
def muscle_torque(p1: float, p2: float, angle: float, strength: float, physics: Physics, rig: RigLaw) -> float:
    """Torque (N m) of both muscles on the pulley."""
    stroke = physics.pulley_m * angle / physics.length_m
    f1 = muscle_force(p1, physics.contraction + stroke, physics.braid_rad * (1.0 + rig.braid_1), physics.radius_m)
    f2 = muscle_force(p2, physics.contraction - stroke, physics.braid_rad * (1.0 + rig.braid_2), physics.radius_m)
    if rig.notch != 0.0:
        f1 *= 1.0 - rig.notch * math.exp(-0.5 * ((angle - rig.notch_rad) / rig.notch_width_rad) ** 2)
    return strength * physics.pulley_m * (f1 - physics.strength_2 * f2)


@compiled
def slip_torque(angle: float, mean_mpa: float, s: State, physics: Physics) -> float:
    """Hysteresis of the braid: four springs that let go at their yield angles; stronger under pressure."""
    total = 0.0
    for i in range(4):
        limit = SLIP_YIELD_RAD[i] * physics.slip_width
        stretch = angle - s[SLIP + i]
        if stretch > limit:
            s[SLIP + i] = angle - limit
        elif stretch < -limit:
            s[SLIP + i] = angle + limit
        total += SLIP_SHARE[i] * (angle - s[SLIP + i]) / limit
    return total * physics.slip_nm * (0.3 + 0.7 * mean_mpa / 0.2)


@compiled
def relaxing_torque(angle: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Four springs in series with dampers, log-spaced: a power-law creep rather than one time constant."""
    stiffness = 0.25 * (physics.relaxing_nm_rad + rig.relaxing * ACTIVE_STIFFNESS_NM_RAD)
    total = 0.0
    for i in range(4):
        s[RELAX + i] += dt_s / RELAX_S[i] * (angle - s[RELAX + i])
        total += stiffness * (angle - s[RELAX + i])
    return total


@compiled
def dry_torque(speed: float, level_nm: float, s: State, dt_s: float) -> float:
    """LuGre: bristles of 0.006 rad, Stribeck rise of 25 % below 0.15 rad/s. Bristle state integrated implicitly."""
    if level_nm <= 0.0:
        return 0.0
    stiffness = level_nm / 0.006
    level = level_nm * (1.0 + 0.25 * math.exp(-((speed / STRIBECK_RAD_S) ** 2)))
    s[LUGRE] = (s[LUGRE] + dt_s * speed) / (1.0 + dt_s * stiffness * abs(speed) / level)
    return stiffness * s[LUGRE]


@compiled
def contact_torque(angle: float, speed: float, rig: RigLaw) -> float:
    """Rubber buffers at the ends of travel: k d^1.3 (1 + c v), pushing only."""
    if angle > rig.stop_high_rad:
        depth = angle - rig.stop_high_rad
        return -max(0.0, 600.0 * math.pow(depth, 1.3) * (1.0 + 0.5 * speed))
    if angle < rig.stop_low_rad:
        depth = rig.stop_low_rad - angle
        return max(0.0, 600.0 * math.pow(depth, 1.3) * (1.0 - 0.5 * speed))
    return 0.0


@compiled
def foreign_torque(angle: float, time_s: float, rig: RigLaw) -> float:
    """Gravity of a load, cogging, and pushes from outside."""
    total = -rig.gravity_nm * math.sin(angle + rig.gravity_rad)
    if rig.cog_nm != 0.0:
        total -= rig.cog_nm * math.sin(rig.cog_per_rad * angle)
    if rig.push_nm != 0.0:
        total += rig.push_nm * math.sin(2.0 * math.pi * rig.push_hz * time_s + 0.7)
    return total


@compiled
def step_joint(
    p1: float, p2: float, time_s: float, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float
) -> None:
    """One semi-implicit step of the joint under both muscles' gauge pressures."""
    angle, speed = s[ANGLE], s[SPEED]
    heat = rig.warm_up * (1.0 - (1.0 - warm) * math.exp(-max(time_s, 0.0) / rig.warm_up_s))
    torque = muscle_torque(p1, p2, angle, (1.0 - heat) * (1.0 + rig.stiff), physics, rig)
    torque -= (
        (1.0 + rig.stiff)
        * (1.0 + 3.0 * heat)
        * (physics.passive_nm_rad * angle + physics.passive_cube_nm_rad3 * angle**3)
    )
    torque -= slip_torque(angle, 0.5 * (p1 + p2), s, physics) + relaxing_torque(angle, s, physics, rig, dt_s)
    level = physics.bearing_nm + rig.lugre_nm
    if (
        rig.jam_nm > 0.0
        and time_s > rig.jam_start_s
        and (time_s - rig.jam_start_s) % rig.jam_every_s < rig.jam_length_s
    ):
        level += rig.jam_nm
    torque -= dry_torque(speed, level, s, dt_s)
    torque += contact_torque(angle, speed, rig) + foreign_torque(angle, time_s, rig)
    drag = physics.viscous_nm_s
    if rig.grease_nm_s > 0.0:
        drag += rig.grease_nm_s * (speed * speed + 1e-4) ** -0.1
    inertia = physics.inertia_kgm2 + rig.inertia_kgm2
    s[SPEED] = (speed + dt_s / inertia * torque) / (1.0 + dt_s / inertia * drag)
    s[ANGLE] = angle + dt_s * s[SPEED]
