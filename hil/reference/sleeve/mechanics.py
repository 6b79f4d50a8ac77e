"""Muscles and joint of the sixth family: spiral sectors, hysteresis of fibres and rings, crossed flexures, a bushing.
Compiled.

The sectors' radius grows as their muscle contracts (a fusee). Fibres and rings rub by Krasnosel'skii and Pokrovskii's
operator (1983; Banks, Kurdila and Webb 1997), whose elements lie along the stroke, in proportion to the muscle's own
tension. Crossed flexures carry the joint: the tendons' load takes a part of their stiffness away (Haringx 1949), and
they stiffen towards their end. The bushing: generalised Maxwell slip (Al-Bender, Lampaert and Swevers 2005), whose
elements stick as springs and slide towards a Stribeck curve. An eddy-current brake after Wouterse (1991).
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.sleeve.disturbance import RigLaw
from hil.reference.sleeve.physics import Physics
from hil.reference.sleeve.pneumatics import RIG_STATES
from hil.reference.sleeve.sleeves import (
    arc_volume,
    flow_rate,
    flowing_force,
    length_slope,
    middle_bulge,
    opened,
    pull_area,
    rubber_force,
)

CENTRES, WIDTHS, SLIPS = 9, 4, 4
ANGLE, SPEED, COILS, WARMTH, GROOVE, VOLUME_AT_ZERO = (RIG_STATES + k for k in range(6))
"""COILS, WARMTH: temperature of the regulators' coils and of the frame, of 1; GROOVE: tendon that has been given (m);
VOLUME_AT_ZERO: of one muscle (m^3)."""
OPEN, TAKEN, RATE, ARM, FLOWED, FARTHEST = (RIG_STATES + 6 + 2 * k for k in range(6))
"""Of muscle 1, then of muscle 2: half angle of the arcs (rad), by how much it is shorter than at angle zero (m) and
faster (m/s), its lever arm (m), what of its hoop's strain has flowed, and the largest strain that it has had."""
ELEMENT = RIG_STATES + 18
SLIP = ELEMENT + 2 * CENTRES * WIDTHS
SLIDES = SLIP + SLIPS
STATES = SLIDES + SLIPS

SPACING_M, RIDGE_M = 0.004, 0.002
WIDTH = (0.1, 0.4, 1.0, 2.2)
"""Half widths of the elements, against their scale."""
MULLINS_STRAIN = 0.05
COILS_S, COILS_MPA = 4.0, 0.2
TENSE_NM_RAD = 3.0
"""Stiffness that flexures gain in a frame that has grown by one unit: about the muscles' at 0.2 MPa."""
FLEXURE_RAD = 1.15
"""Angle at which the flexures would end."""
LEAST_FLEXURE = 0.3
GROOVE_S, GROOVE_BACK_RAD = 0.01, 0.05
SLIP_SHARE = (0.15, 0.25, 0.3, 0.3)
SLIP_RAD = (0.0015, 0.004, 0.009, 0.018)
"""Share of the level that each element of the bushing holds, and the angle after which it slides."""
STRIBECK, STRIBECK_RAD_S, ATTRACTION_S = 0.25, 0.2, 0.02
BRAKE_RAD_S = 5.0
"""Speed at which the brake holds most."""
GEAR = 0.85
"""Efficiency of the flywheel's gear."""
SECOND_HARMONIC = 0.35
STOP_NM_RAD, STOP_RAD, STOP_LOSS = 60.0, 0.03, 0.4


@compiled
def sector(turn: float, physics: Physics) -> tuple[float, float]:
    """(tendon that a spiral sector has taken up since angle zero in m, its lever arm in m) at a turn (rad)."""
    grown = physics.spiral_per_rad * turn
    return physics.sector_m * turn * (1.0 + 0.5 * grown), physics.sector_m * (1.0 + grown)


@compiled
def radius_of(muscle: int, physics: Physics, rig: RigLaw) -> float:
    """Radius (m) of a flat sleeve."""
    return physics.radius_m * (1.0 + (rig.wide_1 if muscle == 0 else rig.wide_2))


@compiled
def contraction_of(muscle: int, s: State, physics: Physics) -> float:
    """Contraction of a muscle as it hangs."""
    return physics.contraction + physics.apart * muscle + s[TAKEN + muscle] / physics.length_m


@compiled
def step_groove(s: State, rig: RigLaw, dt_s: float) -> None:
    """One step of what tendon 1 has given (m): it jumps over above an angle, and back a little below it."""
    if rig.groove_mm <= 0.0:
        return
    there = rig.groove_rad - (GROOVE_BACK_RAD if s[GROOVE] > 0.5e-3 * rig.groove_mm else 0.0)
    goal = 1e-3 * rig.groove_mm if s[ANGLE] > there else 0.0
    s[GROOVE] += dt_s / GROOVE_S * (goal - s[GROOVE])


@compiled
def place(s: State, physics: Physics, rig: RigLaw, turns: int, dt_s: float) -> None:
    """Stroke, its rate, lever arm and half angle of both muscles at the present angle."""
    step_groove(s, rig, dt_s)
    for muscle in range(2):
        taken, s[ARM + muscle] = sector((1.0 - 2.0 * muscle) * s[ANGLE], physics)
        if muscle == 0:
            taken += s[GROOVE]
        s[RATE + muscle] = (taken - s[TAKEN + muscle]) / dt_s
        s[TAKEN + muscle] = taken
        s[OPEN + muscle] = opened(contraction_of(muscle, s, physics), s[OPEN + muscle], turns)


@compiled
def volume_at_zero(physics: Physics) -> float:
    """Volume (m^3) of a muscle at angle zero, with its fittings."""
    t = opened(physics.contraction, 1.0, 12)
    arcs = physics.length_m / physics.ring_m * arc_volume(t, physics.radius_m, physics.ring_m)
    return arcs / (1.0 - physics.dead_share)


@compiled
def muscle_air(muscle: int, s: State, physics: Physics, rig: RigLaw) -> tuple[float, float]:
    """(a muscle's volume against that at angle zero, its rate per second)."""
    t, radius_m = s[OPEN + muscle], radius_of(muscle, physics, rig)
    arcs = physics.length_m / physics.ring_m * arc_volume(t, radius_m, physics.ring_m) / s[VOLUME_AT_ZERO]
    growth = pull_area(t, radius_m, physics.ring_m) * s[RATE + muscle] / s[VOLUME_AT_ZERO]
    return (1.0 + rig.stiff) * (physics.dead_share + arcs), (1.0 + rig.stiff) * growth


@compiled
def strain_of(muscle: int, s: State, physics: Physics, rig: RigLaw) -> float:
    """Strain of a sleeve's hoop in the middle between rings."""
    return middle_bulge(s[OPEN + muscle], physics.ring_m)[0] / radius_of(muscle, physics, rig)


@compiled
def hoop_force(muscle: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Force (N) by which a muscle's rubber pushes back, and one step of what flows in it and of what it remembers."""
    t, radius_m, strain = s[OPEN + muscle], radius_of(muscle, physics, rig), strain_of(muscle, s, physics, rig)
    force = rubber_force(t, radius_m, physics.ring_m, physics.rubber_n_m)
    if rig.virgin > 0.0:
        s[FARTHEST + muscle] = max(s[FARTHEST + muscle], strain)
        force *= 1.0 + rig.virgin * math.exp((strain - s[FARTHEST + muscle]) / MULLINS_STRAIN)
    modulus_n_m = (physics.flow + 0.1 * rig.creep) * physics.rubber_n_m
    force += flowing_force(t, s[FLOWED + muscle], radius_m, physics.ring_m, modulus_n_m)
    s[FLOWED + muscle] += dt_s * flow_rate(strain - s[FLOWED + muscle])
    return force


@compiled
def guard_force(muscle: int, s: State, physics: Physics, rig: RigLaw) -> float:
    """Force (N) by which a guard plate pushes a sleeve longer that bulges against it."""
    if rig.guard_n_mm <= 0.0 or rig.guard_muscle != muscle:
        return 0.0
    out, slope = middle_bulge(s[OPEN + muscle], physics.ring_m)
    over_mm = max(0.0, 1e3 * out - rig.guard_mm)
    return rig.guard_n_mm * over_mm * slope / (physics.ring_m * length_slope(s[OPEN + muscle]))


@compiled
def tension(p_mpa: float, muscle: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Force (N) of a muscle under a gauge pressure, without its hysteresis; a muscle only pulls."""
    pull = 1e6 * p_mpa * pull_area(s[OPEN + muscle], radius_of(muscle, physics, rig), physics.ring_m)
    pull *= 1.0 if muscle == 0 else physics.strength_2
    back = hoop_force(muscle, s, physics, rig, dt_s)
    return (1.0 + rig.stiff) * max(0.0, pull - back - guard_force(muscle, s, physics, rig))


@compiled
def turned_over(stroke_m: float, at: int, s: State, scale_m: float) -> float:
    """What the elements along the stroke hold of their level, about 1 off the middle of a wide loop. An element follows
    late, and what it is behind of the line between its ridges is held."""
    total, loop = 0.0, 0.0
    for k in range(WIDTHS):
        half_m = WIDTH[k] * scale_m
        loop += 2.0 * half_m / SPACING_M
        for i in range(CENTRES):
            off, j = stroke_m - SPACING_M * (i - CENTRES // 2), at + k * CENTRES + i
            rising = max(-1.0, min(1.0, (off - half_m) / RIDGE_M))
            falling = max(-1.0, min(1.0, (off + half_m) / RIDGE_M))
            s[j] = min(falling, max(rising, s[j]))
            total += rising + falling - s[j]
    return total / loop


@compiled
def pull(p_mpa: float, muscle: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> tuple[float, float]:
    """(torque in N m of one muscle in its own direction, its force in N)."""
    force = tension(p_mpa, muscle, s, physics, rig, dt_s)
    level = physics.rub_n + physics.rub_share * force / (1.0 + rig.stiff)
    held = level * turned_over(s[TAKEN + muscle], ELEMENT + muscle * CENTRES * WIDTHS, s, physics.rub_m)
    return s[ARM + muscle] * (force - held), force


@compiled
def flexure_torque(angle: float, load_n: float, grown: float, physics: Physics) -> float:
    """Torque (N m) of the crossed flexures under the tendons' load, in a frame that has grown."""
    left = max(LEAST_FLEXURE, 1.0 - load_n / physics.buckle_n)
    stiffness_nm_rad = physics.flexure_nm_rad * left + TENSE_NM_RAD * grown
    return -stiffness_nm_rad * FLEXURE_RAD * math.tan(angle / FLEXURE_RAD)


@compiled
def stop_torque(angle: float, speed: float, rig: RigLaw) -> float:
    """Torque (N m) of both stops: a leaf that gets shorter as it lays itself along a block, and rubs on it."""
    over = angle - max(rig.stop_low_rad, min(rig.stop_high_rad, angle))
    loss = 1.0 + STOP_LOSS * math.tanh(speed * math.copysign(20.0, over))
    return -STOP_NM_RAD * over * (1.0 + abs(over) / STOP_RAD) * loss


@compiled
def load_torque(angle: float, rig: RigLaw) -> float:
    """Torque (N m) of a half-filled vessel."""
    turn = angle + rig.load_rad
    return -rig.load_nm * (math.sin(turn) + SECOND_HARMONIC * math.sin(2.0 * turn))


@compiled
def dry_torque(level_nm: float, s: State, dt_s: float) -> float:
    """Torque (N m) of the bushing, and one step of its elements: of 1, as springs or sliding."""
    speed, total = s[SPEED], 0.0
    fall = 1.0 + STRIBECK * math.exp(-abs(speed) / STRIBECK_RAD_S)
    for k in range(SLIPS):
        most, way = SLIP_SHARE[k] * fall, math.copysign(1.0, speed)
        if s[SLIDES + k] * way <= 0.0:
            s[SLIDES + k] = 0.0
            s[SLIP + k] += dt_s * speed * SLIP_SHARE[k] / SLIP_RAD[k]
            if abs(s[SLIP + k]) >= most:
                s[SLIP + k], s[SLIDES + k] = math.copysign(most, s[SLIP + k]), math.copysign(1.0, s[SLIP + k])
        else:
            s[SLIP + k] += dt_s / ATTRACTION_S * (way * most - s[SLIP + k])
        total += s[SLIP + k]
    return -level_nm * total


@compiled
def step_warmth(p1_mpa: float, p2_mpa: float, s: State, rig: RigLaw, dt_s: float) -> None:
    """One step of the coils' heat, which goes with the square of their currents, and of the frame behind them."""
    driven = 0.5 * (p1_mpa * p1_mpa + p2_mpa * p2_mpa) / (COILS_MPA * COILS_MPA)
    s[COILS] += dt_s / COILS_S * (min(2.0, driven) - s[COILS])
    s[WARMTH] += dt_s / rig.heat_s * (s[COILS] - s[WARMTH])


@compiled
def step_joint(p1_mpa: float, p2_mpa: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One semi-implicit step of the joint under both muscles' gauge pressures (MPa)."""
    angle, speed = s[ANGLE], s[SPEED]
    torque_1, force_1 = pull(p1_mpa, 0, s, physics, rig, dt_s)
    torque_2, force_2 = pull(p2_mpa, 1, s, physics, rig, dt_s)
    torque = torque_1 - torque_2
    load_n = (force_1 + force_2) / (1.0 + rig.stiff)
    torque += (1.0 + rig.stiff) * flexure_torque(angle, load_n, rig.heat * s[WARMTH], physics)
    torque += stop_torque(angle, speed, rig) + load_torque(angle, rig)
    torque += dry_torque(physics.bearing_nm + rig.dry_nm, s, dt_s)
    drag_nm_s = physics.oil_nm_s + rig.brake_nm_s / (1.0 + (speed / BRAKE_RAD_S) ** 2)
    geared = (1.0 / GEAR) if (torque - drag_nm_s * speed) * speed > 0.0 else GEAR
    inertia = physics.inertia_kgm2 + geared * rig.wheel_kgm2
    s[SPEED] = (speed + dt_s / inertia * torque) / (1.0 + dt_s / inertia * drag_nm_s)
    s[ANGLE] = angle + dt_s * s[SPEED]
    step_warmth(p1_mpa, p2_mpa, s, rig, dt_s)


@compiled
def hung(warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """Muscles and joint after a long time at angle zero, but for friction."""
    s[VOLUME_AT_ZERO] = volume_at_zero(physics)
    s[OPEN] = s[OPEN + 1] = 1.0
    place(s, physics, rig, 12, dt_s)
    s[COILS] = s[WARMTH] = 0.3 * warm
    for muscle in range(2):
        s[FLOWED + muscle] = s[FARTHEST + muscle] = strain_of(muscle, s, physics, rig)
