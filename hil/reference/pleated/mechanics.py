"""Muscles and joint of the third family: pleated membranes on cranks, folds, rate-and-state friction, an elastic shaft.
Compiled.

Force of a pleated muscle falls as one over the contraction (Daerden 1999), here k p (end / contraction - 1). Friction
of the folds after Coleman and Hodgdon (1986), its loop lens-shaped and stronger at speed; the bearing after Dieterich
and Ruina, regularised (Rice and others 2001), solved for the torque in every step.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.pleated.disturbance import RigLaw
from hil.reference.pleated.physics import Physics
from hil.reference.pleated.pneumatics import RIG_STATES

ANGLE, SPEED, HEAT, AGE = RIG_STATES, RIG_STATES + 1, RIG_STATES + 2, RIG_STATES + 3
FOLD, STRAIN = RIG_STATES + 4, RIG_STATES + 6
"""Friction state and crept strain of muscle 1, then of muscle 2."""
LOAD_ANGLE, LOAD_SPEED, MASS_ANGLE, MASS_SPEED = RIG_STATES + 8, RIG_STATES + 9, RIG_STATES + 10, RIG_STATES + 11
TAKEN, ARM = RIG_STATES + 12, RIG_STATES + 14
"""By how much a muscle is shorter than at angle zero, and its lever arm (m), at the present angle."""
STATES = RIG_STATES + 16

LENS_M = 0.02
"""Stroke at which the folds' loop is half as wide."""
FOLD_SPEED_M_S = 0.001
CREEP_S, CREEP_STRAIN = 4.0, 0.004
"""Time constant of small creep, and the strain from which on it is faster (Eyring)."""
CREEP_AT_N, CREEP_UNIT = 350.0, 0.05
FILM_RAD_S = 2.0
DIRECT, EVOLVED = 0.04, 0.05
SLIDE_RAD_S, SLIDE_RAD = 0.01, 0.01
"""Rate-and-state friction: direct and evolved effect, and the speed and length they refer to."""
OLDEST_S = 30.0
NEWTON, CLOSE = 8, 1e-4
SHAFT_NM_RAD, SHAFT_NM_S = 800.0, 0.4
WIRE_NM, WIRE_RAD = 3.0, 0.03
WARMING_MPA_S = 0.5
"""Rate of pressure that heats by one unit."""


@compiled
def muscle_force(pressure_mpa: float, contraction: float, short: float, physics: Physics) -> float:
    """Force in newtons; a muscle only pulls."""
    end = physics.end_contraction * (1.0 - 0.3 * short)
    strength = (1.0 - short) * physics.strength_n_mpa
    return max(0.0, strength * pressure_mpa * (end / max(0.02, contraction) - 1.0))


@compiled
def reach(angle: float, side: float, physics: Physics) -> tuple[float, float]:
    """(distance of a muscle's ends in m, lever arm in m); side 1 or -1."""
    turn = side * angle + physics.crank_rad
    span = math.sqrt(physics.base_m**2 + physics.crank_m**2 - 2.0 * physics.base_m * physics.crank_m * math.sin(turn))
    return span, physics.base_m * physics.crank_m * math.cos(turn) / span


@compiled
def place(span_at_zero: float, s: State, physics: Physics) -> None:
    """Stroke and lever arm of both muscles at the present angle."""
    for muscle in range(2):
        span, arm = reach(s[ANGLE], 1.0 - 2.0 * muscle, physics)
        s[TAKEN + muscle], s[ARM + muscle] = span_at_zero - span, arm


@compiled
def fold_force(shift: float, speed: float, taken: float, pressure: float, at: int, s: State, physics: Physics) -> float:
    """Friction of one muscle's folds (N) after its stroke `taken` has grown by `shift` (m) at `speed` (m/s)."""
    lens = 1.0 / (1.0 + (taken / LENS_M) ** 2)
    s[at] = max(-1.0, min(1.0, s[at] + (shift * lens - abs(shift) * s[at]) / physics.fold_m))
    quick = 1.0 + physics.fold_rate * math.asinh(abs(speed) / FOLD_SPEED_M_S)
    return s[at] * quick * (physics.fold_n + physics.fold_n_mpa * pressure)


@compiled
def crept(force: float, physics: Physics, rig: RigLaw) -> float:
    """Where the strain of a membrane goes under a force (N)."""
    return (physics.creep + rig.creep) * CREEP_UNIT * force / CREEP_AT_N


@compiled
def step_creep(force: float, at: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """Strain of a membrane under its force; large steps go faster than small ones."""
    off = crept(force, physics, rig) - s[at]
    pace = max(-4.0, min(4.0, off / CREEP_STRAIN))
    s[at] += dt_s / CREEP_S * CREEP_STRAIN * math.sinh(pace)


@compiled
def pull(p: float, side: float, muscle: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of one muscle on the joint, in its own direction."""
    arm, taken = s[ARM + muscle], s[TAKEN + muscle]
    contraction = physics.contraction + taken / physics.length_m + s[STRAIN + muscle]
    force = muscle_force(p, contraction, rig.short_1 if muscle == 0 else rig.short_2, physics)
    force *= (1.0 if muscle == 0 else physics.strength_2) * (1.0 - rig.heat * s[HEAT]) * (1.0 + rig.stiff)
    step_creep(force, STRAIN + muscle, s, physics, rig, dt_s)
    speed = side * arm * s[SPEED]
    return arm * (force - fold_force(dt_s * speed, speed, taken, p, FOLD + muscle, s, physics))


@compiled
def outer_torque(s: State, physics: Physics, rig: RigLaw) -> float:
    """Springs, weight, wires and freewheel."""
    angle, speed = s[ANGLE], s[SPEED]
    total = -(1.0 + rig.stiff) * (physics.passive_nm_rad * angle + physics.passive_square_nm * angle * angle)
    total -= rig.weight_nm * math.sin(1.3 * angle + rig.weight_rad)
    high, low = angle - rig.stop_high_rad, rig.stop_low_rad - angle
    if high > 0.0:
        total -= WIRE_NM * (math.exp(min(6.0, high / WIRE_RAD)) - 1.0)
    if low > 0.0:
        total += WIRE_NM * (math.exp(min(6.0, low / WIRE_RAD)) - 1.0)
    return total - rig.one_way_nm_s * max(0.0, speed)


@compiled
def step_masses(s: State, rig: RigLaw, dt_s: float) -> float:
    """One step of the load on its shaft and of the absorber on its spring; returns the torque (N m) they take."""
    taken = 0.0
    if rig.load_kgm2 > 0.0:
        taken = SHAFT_NM_RAD * (s[ANGLE] - s[LOAD_ANGLE]) + SHAFT_NM_S * (s[SPEED] - s[LOAD_SPEED])
        s[LOAD_SPEED] += dt_s * taken / rig.load_kgm2
        s[LOAD_ANGLE] += dt_s * s[LOAD_SPEED]
    if rig.absorber_kgm2 > 0.0:
        w = 2.0 * math.pi * rig.absorber_hz
        pace = w * w * (s[ANGLE] - s[MASS_ANGLE]) + 0.1 * w * (s[SPEED] - s[MASS_SPEED])
        s[MASS_SPEED] += dt_s * pace
        s[MASS_ANGLE] += dt_s * s[MASS_SPEED]
        taken += rig.absorber_kgm2 * pace
    return taken


@compiled
def dry_torque(free: float, level: float, inertia: float, s: State, dt_s: float) -> float:
    """Torque (N m) of the bearing that a joint of speed `free` without it has at the end of the step, 0 or more.

    Solved by Newton's method from above: the residual is convex in the torque.
    """
    scale = DIRECT * level
    state = (1.0 + EVOLVED * math.log(s[AGE] * SLIDE_RAD_S / SLIDE_RAD)) / DIRECT
    speed_0 = 2.0 * SLIDE_RAD_S * math.exp(-state)
    torque = min(inertia * free / dt_s, scale * math.asinh(free / speed_0))
    for _ in range(NEWTON):
        up = math.exp(min(700.0, torque / scale))
        off = 0.5 * speed_0 * (up - 1.0 / up) - free + dt_s / inertia * torque
        less = off / (0.5 * speed_0 * (up + 1.0 / up) / scale + dt_s / inertia)
        torque -= less
        if less < CLOSE * scale:
            break
    return max(0.0, torque)


@compiled
def aged(age_s: float, speed: float, dt_s: float) -> float:
    """How long the contacts have been at rest, in effect (s)."""
    if speed < 1e-6:
        return min(OLDEST_S, age_s + dt_s)
    at_speed = SLIDE_RAD / speed
    return min(OLDEST_S, at_speed + (age_s - at_speed) * math.exp(-speed * dt_s / SLIDE_RAD))


@compiled
def step_joint(p1: float, p2: float, worked: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One step of the joint under both membranes' gauge pressures; `worked`: how fast the air was worked (MPa/s)."""
    torque = pull(p1, 1.0, 0, s, physics, rig, dt_s) - pull(p2, -1.0, 1, s, physics, rig, dt_s)
    torque += outer_torque(s, physics, rig) - step_masses(s, rig, dt_s)
    inertia, speed = physics.inertia_kgm2, s[SPEED]
    film = physics.film_nm_s
    if rig.film_nm_s > 0.0 and speed != 0.0:
        film += rig.film_nm_s * FILM_RAD_S * math.asinh(abs(speed) / FILM_RAD_S) / abs(speed)
    free = (speed + dt_s / inertia * torque) / (1.0 + dt_s / inertia * film)
    dry = dry_torque(abs(free), physics.bearing_nm + rig.dry_nm, inertia, s, dt_s)
    s[SPEED] = math.copysign(max(0.0, abs(free) - dt_s / inertia * dry), free)
    s[AGE] = aged(s[AGE], abs(s[SPEED]), dt_s)
    s[ANGLE] += dt_s * s[SPEED]
    s[HEAT] += dt_s / rig.heat_s * (min(2.0, worked / WARMING_MPA_S) - s[HEAT])
