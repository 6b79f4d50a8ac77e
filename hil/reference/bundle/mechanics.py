"""Bundles on toothed belts and the joint of the fifth family. Compiled.

Yarns and strands rub on each other by Masing's rule (1926): a hyperbola from where the joint first set out, twice its
size from every turning point, and each closed loop forgotten. Yarns creep as Struik's ageing polymers (1978): the
slower, the longer nothing changes. The bearing: Bliman and Sorine (1995), a quick and a slow Dahl element against each
other, with Palmgren's load.
"""

import math

from hil.reference.bundle.disturbance import RigLaw
from hil.reference.bundle.physics import Physics
from hil.reference.bundle.pneumatics import RIG_STATES, SLOW, VALVE_STATES
from hil.reference.bundle.strands import bundle_force
from hil.reference.compiling import State, compiled

ANGLE, SPEED, QUICK, LATE, GEL, WHEEL, BOB, BOB_SPEED = (RIG_STATES + k for k in range(8))
"""Both elements of the bearing, structure of the silicone (1 at rest), speed of the wheel, place of the bob against its
lever's length."""
PAD = RIG_STATES + 8
"""How deep (rad) the foam of the upper, then of the lower stop is pressed in."""
TAKEN, ARM, BELT, CREPT, AGE, TENSION, HEAT = (RIG_STATES + 10 + 2 * k for k in range(7))
"""Of bundle 1, then of bundle 2: stroke since angle zero and lever arm at the present angle (m), stretch of the belt
(m), strain of the yarns, time (s) since the force last changed, the force (N), heat."""
PRESSURE = RIG_STATES + 24
"""Gauge MPa in bundle 1, then in bundle 2."""
VOLUME_AT_ZERO = RIG_STATES + 26
RUB, HEADING, PLACE, ORIGIN, TURNS = (RIG_STATES + 27 + k for k in range(5))
"""Share of the largest friction, direction of motion, stroke in units of its scale, where it set out, number of open
turning points."""
MOST_TURNS = 16
TURN_PLACE = RIG_STATES + 32
TURN_RUB = TURN_PLACE + MOST_TURNS
STATES = TURN_RUB + MOST_TURNS

REST_N = 175.0
"""Force of a bundle at angle zero and 0.2 MPa, about."""
CREEP_STRAIN, CREEP_S, AGEING, RENEWED_N = 0.025, 0.4, 0.9, 60.0
"""Strain of one unit of creep, its time constant when the force has just changed, its growth per age, and the change of
force that renews it."""
WARMING_W, MOST_WARM, SHADOW = 0.08, 1.3, 1.4
"""Friction that heats by one unit, the most there is; bundle 2 hangs in the warm air of the other."""
QUICK_RAD, LATE_RAD, EXCESS = 0.0025, 0.010, 0.3
SEAL_SHARE = 0.4
"""Of a bearing's friction, which does not come from the load."""
GEL_S, SHEARED_RAD, THIN = 1.5, 1.2, 0.25
"""The silicone recovers within this time, is thinned by this turn, and to this share at most."""
WHEEL_S, GRIP_NM = 0.012, 2.0
STRING, SWING_HZ, SWING_DAMPING = 0.35, 1.3, 0.06
"""Length of the bob's lever against its string's, frequency and damping of its swing."""
FOAM_NM_RAD, FOAM_RAD, FOAM_GIVES = 80.0, 0.06, 0.7
PRESSED_S, RECOVERED_S = 0.15, 1.2


@compiled
def place(s: State, physics: Physics, rig: RigLaw) -> None:
    """Stroke and lever arm of both bundles at the present angle; a pulley off its centre also lifts both belts."""
    turn, radius = s[ANGLE] + rig.off_rad, physics.pulley_m
    lifted = radius * rig.off_centre * (math.sin(turn) - math.sin(rig.off_rad))
    aside = radius * rig.off_centre * math.cos(turn)
    s[TAKEN], s[TAKEN + 1] = radius * s[ANGLE] + lifted, lifted - radius * s[ANGLE]
    s[ARM], s[ARM + 1] = radius + aside, radius - aside


@compiled
def contraction_of(bundle: int, s: State, physics: Physics) -> float:
    """Contraction of a bundle's yarns as it hangs on its belt."""
    taken = (s[TAKEN + bundle] + s[BELT + bundle]) / physics.length_m
    return physics.contraction + physics.apart * bundle + taken + s[CREPT + bundle]


@compiled
def torn_share(bundle: int, time_s: float, rig: RigLaw) -> float:
    """Share of a bundle's strands that pull no more."""
    if bundle == 1:
        return rig.torn_2
    return min(0.95, rig.torn_1 + (rig.burst if time_s > rig.burst_s else 0.0))


@compiled
def backbone(stroke: float) -> float:
    """Share of the largest friction after a stroke from rest, in units of the stroke at which it is half."""
    return stroke / (1.0 + abs(stroke))


@compiled
def turn_back(s: State) -> None:
    """Remember where the stroke turns; the smallest open loop is forgotten when there are too many."""
    if s[TURNS] >= MOST_TURNS:
        s[TURNS] -= 2.0
    at = int(s[TURNS])
    s[TURN_PLACE + at], s[TURN_RUB + at] = s[PLACE], s[RUB]
    s[TURNS] += 1.0


@compiled
def set_out(s: State) -> None:
    """Forget all friction: what comes sets out from here."""
    s[ORIGIN], s[RUB], s[TURNS] = s[PLACE], 0.0, 0.0


@compiled
def rubbed(now: float, s: State) -> float:
    """Share of the largest friction at a stroke `now` (in units of its scale), by Masing's rule."""
    shift = now - s[PLACE]
    if shift * s[HEADING] < 0.0:
        turn_back(s)
    if shift != 0.0:
        s[HEADING] = math.copysign(1.0, shift)
    s[PLACE] = now
    while s[TURNS] > 1.5 and (now - s[TURN_PLACE + int(s[TURNS]) - 2]) * s[HEADING] >= 0.0:
        s[TURNS] -= 2.0
    if 0.5 < s[TURNS] < 1.5 and (now + s[TURN_PLACE] - 2.0 * s[ORIGIN]) * s[HEADING] >= 0.0:
        s[TURNS] = 0.0
    if s[TURNS] < 0.5:
        s[RUB] = backbone(now - s[ORIGIN])
    else:
        last = int(s[TURNS]) - 1
        s[RUB] = s[TURN_RUB + last] + 2.0 * backbone(0.5 * (now - s[TURN_PLACE + last]))
    return s[RUB]


@compiled
def crept_goal(force: float, physics: Physics, rig: RigLaw) -> float:
    """Where the strain of the yarns goes under a force (N)."""
    return (physics.creep + rig.creep) * CREEP_STRAIN * force / REST_N


@compiled
def step_tension(force: float, bundle: int, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One step of the belt and of the yarns under a bundle's force (N)."""
    change = abs(force - s[TENSION + bundle])
    s[TENSION + bundle] = force
    s[BELT + bundle] += dt_s / physics.belt_s * (force / physics.belt_n_m - s[BELT + bundle])
    s[AGE + bundle] = (s[AGE + bundle] + dt_s) / (1.0 + change / RENEWED_N)
    off = crept_goal(force, physics, rig) - s[CREPT + bundle]
    s[CREPT + bundle] += dt_s / (CREEP_S + AGEING * s[AGE + bundle]) * off


@compiled
def pull(bundle: int, time_s: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of one bundle on the joint, in its own direction."""
    contraction, torn, p = contraction_of(bundle, s, physics), torn_share(bundle, time_s, rig), s[PRESSURE + bundle]
    force = bundle_force(p, contraction, torn, physics)
    if rig.clogged > 0.0 and bundle == 0:
        slow = bundle_force(s[bundle * VALVE_STATES + SLOW], contraction, torn, physics)
        force += rig.clogged * (slow - force)
    force *= (1.0 if bundle == 0 else physics.strength_2) * (1.0 - rig.heat * s[HEAT + bundle])
    step_tension(force, bundle, s, physics, rig, dt_s)
    return s[ARM + bundle] * force * (1.0 + rig.stiff)


@compiled
def thread_torque(s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of the friction in both bundles, which heats them."""
    share = rubbed(physics.pulley_m * s[ANGLE] / physics.thread_m, s)
    total, speed = 0.0, physics.pulley_m * abs(s[SPEED])
    for bundle in range(2):
        level = physics.thread_n + physics.thread_n_mpa * s[PRESSURE + bundle]
        total += level
        warming = min(MOST_WARM, level * abs(share) * speed / WARMING_W) * (1.0 if bundle == 0 else SHADOW)
        s[HEAT + bundle] += dt_s / rig.heat_s * (warming - s[HEAT + bundle])
    return -physics.pulley_m * share * total * (1.0 + rig.stiff)


@compiled
def dry_torque(level_nm: float, shift: float, s: State) -> float:
    """Torque (N m) of a bearing after a turn by `shift` (rad): more when it sets out than later."""
    s[QUICK] = (s[QUICK] + shift / QUICK_RAD) / (1.0 + abs(shift) / QUICK_RAD)
    s[LATE] = (s[LATE] + shift / LATE_RAD) / (1.0 + abs(shift) / LATE_RAD)
    return -level_nm * ((1.0 + EXCESS) * s[QUICK] - EXCESS * s[LATE])


@compiled
def loaded(level_nm: float, s: State) -> float:
    """Friction (N m) of a bearing under the pull of both belts, by the two thirds power of it."""
    load = max(0.0, s[TENSION] + s[TENSION + 1]) / (2.0 * REST_N)
    return level_nm * (SEAL_SHARE + (1.0 - SEAL_SHARE) * math.pow(load, 2.0 / 3.0))


@compiled
def silicone_drag(s: State, rig: RigLaw, dt_s: float) -> float:
    """Drag (N m s/rad) of a silicone that thins when it is sheared, and one step of its structure."""
    s[GEL] = (s[GEL] + dt_s / GEL_S) / (1.0 + dt_s / GEL_S + dt_s * abs(s[SPEED]) / SHEARED_RAD)
    return rig.silicone_nm_s * (THIN + (1.0 - THIN) * s[GEL])


@compiled
def wheel_torque(s: State, physics: Physics, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of a wheel that friction carries along, and one step of its speed; implicit in how much both speeds
    differ."""
    if rig.wheel_kgm2 <= 0.0:
        return 0.0
    slope = rig.wheel_kgm2 / WHEEL_S
    slope /= 1.0 + dt_s * slope * (1.0 / rig.wheel_kgm2 + 1.0 / physics.inertia_kgm2)
    torque = max(-GRIP_NM, min(GRIP_NM, slope * (s[SPEED] - s[WHEEL])))
    s[WHEEL] += dt_s * torque / rig.wheel_kgm2
    return -torque


@compiled
def bob_torque(s: State, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of a weight on a string at the end of a lever, and one step of its swing."""
    if rig.bob_nm == 0.0:
        return 0.0
    turn, w = s[ANGLE] + rig.bob_rad, 2.0 * math.pi * SWING_HZ
    aside = s[BOB] - math.sin(turn)
    s[BOB_SPEED] -= dt_s * (w * w * aside + 2.0 * SWING_DAMPING * w * s[BOB_SPEED])
    s[BOB] += dt_s * s[BOB_SPEED]
    return rig.bob_nm * (STRING * math.cos(turn) * aside - math.sin(turn))


@compiled
def foam_torque(depth: float, at: int, s: State, dt_s: float) -> float:
    """Torque (N m) of a foam that is passed by `depth` (rad), and one step of how far it is pressed in."""
    goal, beyond = FOAM_GIVES * max(0.0, depth), max(0.0, depth - s[at])
    s[at] += dt_s / (PRESSED_S if goal > s[at] else RECOVERED_S) * (goal - s[at])
    return FOAM_NM_RAD * beyond * (1.0 + beyond / FOAM_RAD)


@compiled
def step_joint(time_s: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One semi-implicit step of the joint under both bundles' pressures."""
    angle, speed = s[ANGLE], s[SPEED]
    torque = pull(0, time_s, s, physics, rig, dt_s) - pull(1, time_s, s, physics, rig, dt_s)
    torque += thread_torque(s, physics, rig, dt_s) - physics.cable_nm_rad * angle
    torque += wheel_torque(s, physics, rig, dt_s) + bob_torque(s, rig, dt_s)
    torque -= foam_torque(angle - rig.stop_high_rad, PAD, s, dt_s)
    torque += foam_torque(rig.stop_low_rad - angle, PAD + 1, s, dt_s)
    torque += dry_torque(loaded(physics.bearing_nm + rig.dry_nm, s), dt_s * speed, s)
    drag, inertia = physics.drag_nm_s + silicone_drag(s, rig, dt_s), physics.inertia_kgm2
    s[SPEED] = (speed + dt_s / inertia * torque) / (1.0 + dt_s / inertia * drag)
    s[ANGLE] = angle + dt_s * s[SPEED]
