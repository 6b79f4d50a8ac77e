"""The joint of the ninth family: two rows of pouches against each other over two rolls, and what they carry. Compiled.

A row's pouches are all alike and carry one force, so that each has its share of the row's length; those that are welded
shut are as long as their film. The film softens in the sun as that comes round (a logistic curve). A weld peels as far
as the film's tension is beyond the peel strength; the pouches grow by what it gives.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.pouch.bank import AIR, ANCHOR, HALF, OPENING, PEELED, VALVE_STATES
from hil.reference.pouch.disturbance import RigLaw
from hil.reference.pouch.film import (
    CREASE_BACK,
    CREASE_GIVEN,
    CREASE_STATES,
    STRAINS,
    crease_force,
    crease_on,
    opened,
    pull,
    strain,
    strain_on,
    volume,
    zigzag,
)
from hil.reference.pouch.physics import ATMOSPHERE_MPA, Physics
from hil.reference.pouch.pneumatics import BUILT, RIG_STATES
from hil.reference.pouch.rolling import (
    centre_torque,
    cord_torque,
    cork_torque,
    drawn_in,
    guide_drag,
    half_of,
    inertias,
    load_torque,
    moment_arm,
    squeeze_drag,
)

ANGLE, SINE, COSINE, SPEED, LATE, CORK = (RIG_STATES + k for k in range(6))
"""SINE and COSINE: of half of the angle."""
STRAINED = RIG_STATES + 6
CREASED = STRAINED + 2 * STRAINS
STATES = CREASED + 2 * CREASE_STATES

PEELS_N_M = 1500.0
"""Tension of the film (N/m) beyond which a weld peels."""
ANCHOR_S = 0.25
"""Within which an anchor gives."""
SECOND_HEAT, WARM_SHARE, STEEP = 0.35, 0.15, 5.0
"""Of the sun, what muscle 2 gets; what a warm rig begins with; how steeply it comes, over the time to its half."""
LEAST_FILM = 0.1
MOST_ROUNDS = 40


@compiled
def film_length(muscle: int, s: State, physics: Physics) -> float:
    """Length (m) of a pouch's film that is not stretched: of the build, what was peeled, what it has crept by."""
    late, at = 0.0, STRAINED + muscle * STRAINS
    for k in range(STRAINS):
        late += s[at + k]
    return (physics.pouch_m + s[muscle * VALVE_STATES + PEELED]) * (1.0 + late)


@compiled
def pouch_length(muscle: int, s: State, physics: Physics, rig: RigLaw) -> float:
    """Length (m) of a pouch of a muscle, weld to weld, as the joint and the anchor have it."""
    way = 1.0 - 2.0 * muscle
    row = physics.pouches * physics.pouch_m * (1.0 - physics.short) + physics.apart_m * muscle
    row -= drawn_in((s[SINE], s[COSINE]), way, physics.arm_m, physics.eyelet_m) + s[muscle * VALVE_STATES + ANCHOR]
    shut = physics.pouches * (rig.shut_1 if muscle == 0 else rig.shut_2)
    return max(0.3 * physics.pouch_m, (row - shut * physics.pouch_m) / (physics.pouches - shut))


@compiled
def sun(time_s: float, warm: float, muscle: int, rig: RigLaw) -> float:
    """Stiffness of a film in the sun, against one that is not."""
    if rig.heat == 0.0:
        return 1.0
    begun = 1.0 / (1.0 + math.exp(STEEP))
    come = 1.0 / (1.0 + math.exp(-STEEP * (max(0.0, time_s) / rig.heat_s - 1.0))) - begun
    share = 1.0 if muscle == 0 else SECOND_HEAT
    return max(LEAST_FILM, 1.0 / (1.0 + max(-0.9, share * rig.heat * (WARM_SHARE * warm + come))))


@compiled
def film_stiffness(time_s: float, warm: float, muscle: int, physics: Physics, rig: RigLaw) -> float:
    """Force per width and strain (N/m) of a muscle's film."""
    return physics.film_n_m * sun(time_s, warm, muscle, rig)


@compiled
def gauge(muscle: int, s: State) -> float:
    """A muscle's gauge pressure (MPa)."""
    return s[muscle * VALVE_STATES + AIR] - ATMOSPHERE_MPA


@compiled
def open_pouches(
    time_s: float, warm: float, muscle: int, rounds: int, s: State, physics: Physics, rig: RigLaw
) -> float:
    """The pouches of a muscle open as their length and pressure have it; returns the film's tension (N/m)."""
    length, film = pouch_length(muscle, s, physics, rig), film_length(muscle, s, physics)
    stiffness, at = film_stiffness(time_s, warm, muscle, physics, rig), muscle * VALVE_STATES + OPENING
    s[at], half = opened(s[at], length, gauge(muscle, s), film, stiffness, rounds, physics)
    s[muscle * VALVE_STATES + HALF] = half
    return stiffness * max(0.0, strain(s[at], half, length, film))


@compiled
def built_volume(physics: Physics) -> float:
    """Volume (m^3) of a pouch of the build at angle zero whose film is not stretched."""
    x = 6.0 * physics.short
    opening = math.sqrt(x * (1.0 + x * (0.05 + x * (2.0 / 525.0))))  # sin(t) / t = 1 - short, as a series
    return volume(opening, math.tan(0.5 * opening), physics.pouch_m * (1.0 - physics.short), physics)


@compiled
def muscle_air(muscle: int, s: State, physics: Physics, rig: RigLaw) -> float:
    """A muscle's volume against one of the build at angle zero whose film is not stretched."""
    at, shut = muscle * VALVE_STATES, rig.shut_1 if muscle == 0 else rig.shut_2
    now = volume(s[at + OPENING], s[at + HALF], pouch_length(muscle, s, physics, rig), physics)
    return (1.0 + rig.stiff) * (physics.dead_share + (1.0 - physics.dead_share) * (1.0 - shut) * now / s[BUILT])


@compiled
def muscle_force(time_s: float, warm: float, muscle: int, s: State, physics: Physics, rig: RigLaw) -> float:
    """Pull (N) of a row, with what its creases take."""
    length, film = pouch_length(muscle, s, physics, rig), film_length(muscle, s, physics)
    p, at = gauge(muscle, s), muscle * VALVE_STATES
    stiffness = film_stiffness(time_s, warm, muscle, physics, rig)
    force = pull(s[at + OPENING], s[at + HALF], length, p, film, stiffness, physics)
    force *= (1.0 + rig.stiff) * (1.0 if muscle == 0 else physics.strength_2)
    angle, sine = zigzag(length, film)
    moment = crease_on(angle, CREASED + muscle * CREASE_STATES, s, physics)
    return force - crease_force(moment, p, sine, film, physics)


@compiled
def step_film(muscle: int, tension: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One step of what a film creeps under its tension (N/m), and of what its welds peel."""
    strain_on(tension / physics.film_n_m, rig.creep, STRAINED + muscle * STRAINS, s, physics, dt_s)
    if rig.peel_mm_s > 0.0 and rig.peel_muscle == muscle:
        beyond = max(0.0, tension / PEELS_N_M - 1.0)
        s[muscle * VALVE_STATES + PEELED] += dt_s * 1e-3 * rig.peel_mm_s * beyond / physics.pouches


@compiled
def step_anchor(muscle: int, force: float, s: State, rig: RigLaw, dt_s: float) -> None:
    """One step of a muscle's anchor."""
    if rig.give_mm_n > 0.0 and rig.give_muscle == muscle:
        at = muscle * VALVE_STATES + ANCHOR
        s[at] += dt_s / (ANCHOR_S + dt_s) * (-1e-3 * rig.give_mm_n * force - s[at])


@compiled
def turn_to(angle: float, s: State) -> None:
    """The joint is at an angle."""
    s[ANGLE] = angle
    s[SINE], s[COSINE] = half_of(angle)


@compiled
def step_joint(time_s: float, warm: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One semi-implicit step of the joint and of both rows."""
    angle, half, speed, torque = s[ANGLE], (s[SINE], s[COSINE]), s[SPEED], 0.0
    inertia, slope = inertias(half, physics, rig)
    for muscle in range(2):
        force = muscle_force(time_s, warm, muscle, s, physics, rig)
        torque += force * moment_arm(half, 1.0 - 2.0 * muscle, physics.arm_m, physics.eyelet_m)
        step_anchor(muscle, force, s, rig, dt_s)
    torque += (1.0 + rig.stiff) * cord_torque(half, physics) + load_torque(angle, rig) + centre_torque(angle, rig)
    torque += cork_torque(angle, CORK, s, rig, dt_s) - slope * speed * speed
    drag = physics.drag_nm_s + squeeze_drag(angle, rig)
    drag += guide_drag(physics.bearing_nm + rig.dry_nm, speed, LATE, s, dt_s)
    s[SPEED] = (speed + dt_s / inertia * torque) / (1.0 + dt_s / inertia * drag)
    turn_to(angle + dt_s * s[SPEED], s)


@compiled
def rested(time_s: float, warm: float, s: State, physics: Physics, rig: RigLaw) -> None:
    """The joint where it is, its film and creases as after a long rest there."""
    s[BUILT] = built_volume(physics)
    turn_to(s[ANGLE], s)
    for muscle in range(2):
        at, creased = STRAINED + muscle * STRAINS, CREASED + muscle * CREASE_STATES
        for _ in range(MOST_ROUNDS):
            tension = open_pouches(time_s, warm, muscle, 4, s, physics, rig)
            for _ in range(4):
                strain_on(tension / physics.film_n_m, rig.creep, at, s, physics, 1e9)
        angle, _ = zigzag(pouch_length(muscle, s, physics, rig), film_length(muscle, s, physics))
        s[creased + CREASE_GIVEN] = angle
        s[creased + CREASE_BACK] = 0.0
