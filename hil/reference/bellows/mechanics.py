"""Muscles and joint of the fourth family: chains of flat pouches on eccentric cams, folds, elasto-plastic friction.
Compiled.

A pouch of half angle t is shorter by 1 - sin(t) / t, pulls with l w p cos(t) / t and holds l^2 w / 2 (t - sin t cos t)
/ t^2, of which one follows from the other (Niiyama and others 2015; Veale and others 2016 of such muscles in a row).
Its folds rub by a Prandtl-Ishlinskii operator of stops (Kuhnen 2003) whose thresholds have Weibull's density, over the
stroke of each muscle. The skin creeps under its own tension p / t by a chain of Kelvin elements that stands for a power
of time (Findley). The bearing: Dupont, Hayward, Armstrong and Altpeter (2002), stiff below break-away, with Stribeck's
rise. Stops: Lankarani and Nikravesh (1990).
"""

import math

from hil.reference.bellows.disturbance import RigLaw
from hil.reference.bellows.physics import Physics
from hil.reference.bellows.pneumatics import RIG_STATES
from hil.reference.compiling import State, compiled

STOPS, CREEPS = 6, 4
ANGLE, SPEED, BRISTLE, DAMPER, LOOSE_ANGLE, LOOSE_SPEED, IMPACT = (RIG_STATES + k for k in range(7))
HEAT, SLID = RIG_STATES + 7, RIG_STATES + 9
"""Of muscle 1, then of muscle 2, as all that follows; SLID: tendon that came out of its clamp (m)."""
TAKEN, ARM = RIG_STATES + 11, RIG_STATES + 13
"""By how much a muscle is shorter than at angle zero, and its lever arm (m), at the present angle."""
OPEN, BULGE_AT_ZERO = RIG_STATES + 15, RIG_STATES + 17
"""Half angle of the pouches (rad) as the muscle hangs; BULGE_AT_ZERO, one for both: their bulge at angle zero."""
STOP = RIG_STATES + 18
CREPT = STOP + 2 * STOPS
STATES = CREPT + 2 * CREEPS

MOST_T = 1.5707
"""Half angle of a round pouch."""
LEAST_CONTRACTION, MOST_CONTRACTION = 0.004, 0.3633
WEIBULL_SHAPE = 1.1
THRESHOLDS = tuple((-math.log(1.0 - (k + 0.5) / STOPS)) ** (1.0 / WEIBULL_SHAPE) for k in range(STOPS))
CREEP_S = (0.3, 1.5, 7.5, 37.0)
CREEP_POWER = 0.2
CREEP_SHARE = tuple(tau**CREEP_POWER / sum(other**CREEP_POWER for other in CREEP_S) for tau in CREEP_S)
CREEP_UNIT, TENSION_MPA = 0.025, 0.206
"""Strain of one unit of creep, at the tension of 0.2 MPa at angle zero."""
WARMING_MPA_S = 0.12
"""Inflow that heats by one unit."""
BRISTLE_RAD, BREAK_AWAY, BRISTLE_DAMPING_S = 0.004, 0.7, 0.0006
STRIBECK_RAD_S, STRIBECK = 0.2, 0.3
LINK_NM_RAD = 250.0
"""Of a damper's elastic link."""
LINK_OFF = 0.35
CORD = 0.45
"""Length of the lever against the distance of the cord's pulley."""
STOP_NM, RESTITUTION = 900.0, 0.4
LOOSE_NM_RAD, LOOSE_NM_S = 60.0, 0.06
LOOSE_DRAG_S = 0.5


@compiled
def half_angle(contraction: float) -> float:
    """Half angle t (rad) of a pouch whose contraction 1 - sin(t) / t is given: a series and one Newton step."""
    c = max(LEAST_CONTRACTION, min(MOST_CONTRACTION, contraction))
    t = math.sqrt(6.0 * c * (1.0 + c * (0.3 + 0.15 * c)))
    sine, cosine = math.sin(t), math.cos(t)
    return min(MOST_T, t - (1.0 - sine / t - c) * t * t / (sine - t * cosine))


@compiled
def pouch_force(pressure_mpa: float, contraction: float, physics: Physics) -> float:
    """Force (N) of a muscle under a gauge pressure, less what its folds push back; a muscle only pulls."""
    t = half_angle(contraction + physics.stretch_per_mpa * pressure_mpa)
    folds = physics.fold_n * contraction / max(0.02, physics.lock_contraction - contraction)
    return max(0.0, physics.pouch_n_mpa * pressure_mpa * math.cos(t) / t - folds)


@compiled
def bulge(t: float) -> float:
    """Volume of a pouch of half angle t (rad), against half of its length squared times its width."""
    return (t - math.sin(t) * math.cos(t)) / (t * t)


@compiled
def pouch_volume(t: float, at_zero: float, physics: Physics) -> tuple[float, float]:
    """(a muscle's volume against that at angle zero, its slope by contraction) at half angle t; `at_zero`: the bulge
    there."""
    changing = (1.0 - physics.dead_share) / at_zero
    return physics.dead_share + changing * bulge(t), 2.0 * changing * math.cos(t) / t


@compiled
def stroke(angle: float, physics: Physics) -> tuple[float, float]:
    """(tendon that an eccentric cam has taken up since angle zero in m, its lever arm in m)."""
    turn = angle + physics.cam_rad
    taken = physics.cam_m * angle + physics.off_m * (math.cos(physics.cam_rad) - math.cos(turn))
    return taken, physics.cam_m + physics.off_m * math.sin(turn)


@compiled
def contraction_of(muscle: int, s: State, physics: Physics) -> float:
    """Contraction of a muscle as it hangs, without what its skin has crept."""
    return physics.contraction + physics.apart * muscle + (s[TAKEN + muscle] + s[SLID + muscle]) / physics.length_m


@compiled
def place(s: State, physics: Physics) -> None:
    """Stroke, lever arm and half angle of both muscles at the present angle."""
    for muscle in range(2):
        s[TAKEN + muscle], s[ARM + muscle] = stroke((1.0 - 2.0 * muscle) * s[ANGLE], physics)
        s[OPEN + muscle] = half_angle(contraction_of(muscle, s, physics))


@compiled
def fold_friction(shift: float, pressure: float, contraction: float, at: int, s: State, physics: Physics) -> float:
    """Friction of one muscle's folds (N) after its stroke has grown by `shift` (m): stops that let go one by one."""
    total = 0.0
    for k in range(STOPS):
        limit = THRESHOLDS[k] * physics.loop_m
        s[at + k] = max(-limit, min(limit, s[at + k] + shift))
        total += s[at + k] / limit
    folded = 0.6 + 0.4 * contraction / physics.contraction
    return total / STOPS * folded * (physics.loop_n + physics.loop_n_mpa * pressure)


@compiled
def crept(tension_mpa: float, physics: Physics, rig: RigLaw) -> float:
    """Where the strain of a skin goes under a tension (as p / t)."""
    return (physics.creep + rig.creep) * CREEP_UNIT * tension_mpa / TENSION_MPA


@compiled
def step_creep(tension_mpa: float, at: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """One step of the strain of a skin under its tension; returns it."""
    goal, total = crept(tension_mpa, physics, rig), 0.0
    for k in range(CREEPS):
        s[at + k] += dt_s / CREEP_S[k] * (CREEP_SHARE[k] * goal - s[at + k])
        total += s[at + k]
    return total


@compiled
def pull(pressure: float, inflow: float, muscle: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of one muscle on the joint, in its own direction."""
    arm, tension = s[ARM + muscle], pressure / s[OPEN + muscle]
    strain = step_creep(tension, CREPT + CREEPS * muscle, s, physics, rig, dt_s)
    contraction = contraction_of(muscle, s, physics) + strain
    force = pouch_force(pressure, contraction, physics) * (1.0 if muscle == 0 else physics.strength_2)
    force *= (1.0 + (rig.wide_1 if muscle == 0 else rig.wide_2)) * (1.0 - rig.heat * s[HEAT + muscle])
    s[HEAT + muscle] += dt_s / rig.heat_s * (min(2.0, inflow / WARMING_MPA_S) - s[HEAT + muscle])
    if rig.slip_muscle == muscle:
        s[SLID + muscle] += dt_s * 1e-5 * rig.slip_mm_s * max(0.0, force - rig.slip_n)
    shift = dt_s * (1.0 - 2.0 * muscle) * arm * s[SPEED]
    rub = fold_friction(shift, pressure, contraction, STOP + STOPS * muscle, s, physics)
    return arm * (force * (1.0 + rig.stiff) - rub)


@compiled
def contact_torque(depth: float, speed: float, impact: float) -> float:
    """Torque (N m) of a stop that is pressed in by `depth` (rad) and was hit at the speed `impact`; it only pushes."""
    loss = 0.75 * (1.0 - RESTITUTION * RESTITUTION) * speed / max(0.05, impact)
    return max(0.0, STOP_NM * depth * math.sqrt(depth) * (1.0 + loss))


@compiled
def stop_torque(s: State, rig: RigLaw) -> float:
    """Torque (N m) of both stops; the speed at which one is met is kept until it is left."""
    high, low = s[ANGLE] - rig.stop_high_rad, rig.stop_low_rad - s[ANGLE]
    if high <= 0.0 and low <= 0.0:
        s[IMPACT] = 0.0
        return 0.0
    if s[IMPACT] == 0.0:
        s[IMPACT] = abs(s[SPEED])
    if high > 0.0:
        return -contact_torque(high, s[SPEED], s[IMPACT])
    return contact_torque(low, -s[SPEED], s[IMPACT])


@compiled
def weight_torque(angle: float, rig: RigLaw) -> float:
    """Torque (N m) of a weight on a cord from a lever's end over a fixed pulley."""
    turn = angle + rig.weight_rad
    return -rig.weight_nm * math.sin(turn) / math.sqrt(1.0 + CORD * CORD - 2.0 * CORD * math.cos(turn))


@compiled
def damper_torque(s: State, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of a damper behind an elastic link, one implicit step."""
    if rig.damper_nm_s <= 0.0:
        return 0.0
    pace = dt_s * LINK_NM_RAD / rig.damper_nm_s
    s[DAMPER] = (s[DAMPER] + pace * s[ANGLE]) / (1.0 + pace)
    return LINK_NM_RAD * (s[DAMPER] - s[ANGLE])


@compiled
def loose_torque(s: State, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of a mass that rattles on the joint within its clearance, and one step of it."""
    if rig.loose_kgm2 <= 0.0:
        return 0.0
    gap, torque = s[ANGLE] - s[LOOSE_ANGLE], 0.0
    beyond = gap - max(-rig.loose_rad, min(rig.loose_rad, gap))
    if beyond != 0.0:
        push = LOOSE_NM_RAD * beyond + LOOSE_NM_S * (s[SPEED] - s[LOOSE_SPEED])
        torque = push if push * beyond > 0.0 else 0.0
    s[LOOSE_SPEED] += dt_s * (torque / rig.loose_kgm2 - s[LOOSE_SPEED] / LOOSE_DRAG_S)
    s[LOOSE_ANGLE] += dt_s * s[LOOSE_SPEED]
    return -torque


@compiled
def sliding(deflection: float, speed: float, steady: float) -> float:
    """Which share of a movement slides: none below break-away, all at the steady deflection (Dupont's alpha)."""
    if deflection * speed <= 0.0:
        return 0.0
    size, begin = abs(deflection), BREAK_AWAY * steady
    if size <= begin:
        return 0.0
    if size >= steady:
        return 1.0
    return 0.5 + 0.5 * math.sin(math.pi * (size - 0.5 * (steady + begin)) / (steady - begin))


@compiled
def dry_torque(level_nm: float, s: State, dt_s: float) -> float:
    """Torque (N m) of the bearing, elasto-plastic, and one step of its bristles' deflection (rad)."""
    speed, z = s[SPEED], s[BRISTLE]
    steady = BRISTLE_RAD * (1.0 + STRIBECK * math.exp(-((speed / STRIBECK_RAD_S) ** 2)))
    pace = sliding(z, speed, steady) * abs(speed) / steady
    s[BRISTLE] = (z + dt_s * speed) / (1.0 + dt_s * pace)
    return -level_nm / BRISTLE_RAD * (s[BRISTLE] + BRISTLE_DAMPING_S * (s[BRISTLE] - z) / dt_s)


@compiled
def step_joint(p1: float, p2: float, inflow_1: float, inflow_2: float, s: State, physics: Physics, rig: RigLaw,
               dt_s: float) -> None:  # fmt: skip
    """One semi-implicit step of the joint under both muscles' gauge pressures and what flows into them (MPa/s)."""
    angle, speed = s[ANGLE], s[SPEED]
    torque = pull(p1, inflow_1, 0, s, physics, rig, dt_s) - pull(p2, inflow_2, 1, s, physics, rig, dt_s)
    torque -= (1.0 + rig.stiff) * physics.passive_nm_rad * angle
    torque += weight_torque(angle, rig) + stop_torque(s, rig) + damper_torque(s, rig, dt_s) + loose_torque(s, rig, dt_s)
    torque += dry_torque(physics.bearing_nm + rig.dry_nm, s, dt_s)
    reach = 1.0 + LINK_OFF * math.sin(angle)
    inertia = physics.inertia_kgm2 + rig.link_kgm2 * reach * reach
    torque -= rig.link_kgm2 * reach * LINK_OFF * math.cos(angle) * speed * speed
    s[SPEED] = (speed + dt_s / inertia * torque) / (1.0 + dt_s / inertia * physics.oil_nm_s)
    s[ANGLE] = angle + dt_s * s[SPEED]
