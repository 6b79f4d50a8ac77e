"""Two rolls on one another in place of a hinge: their geometry, what they carry, what resists and stops. Compiled.

A rolling-contact joint (Hillberry and Hall 1976): two equal rolls, held on one another by crossed bands, so that the
link is at each angle the mirror image of the base about their common tangent. A tendon from an eyelet of the base to
the same place of the link is therefore twice as long as the eyelet is far from that tangent: 2 (r - d sin(a / 2) + e
cos(a / 2)). The link's centre goes round by half of the angle and turns by the whole, which makes the inertia depend on
the angle (Lagrange) and gives a weight two terms.

Rolls that rub on their guides: the continuous friction of Makkar and others (2005), whose Stribeck part is late (Hess
and Soom 1990). Cords of rubber by the neo-Hookean law (Treloar 1943). Cork by an exponential and a Maxwell element.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.pouch.disturbance import RigLaw
from hil.reference.pouch.physics import Physics

REVERSES_RAD_S, BREAKS, STRIBECK_RAD_S, LATE_S = 0.004, 0.35, 0.05, 0.04
"""Speed within which friction changes its sign; by which share it is more at rest, up to which speed, and how late."""
CORD_M, CORD_ARM_M = 0.05, 0.022
"""Length of a cord that is not stretched, and how far it is off the middle line."""
NARROWER = 2.5
"""By how much more grease drags at one radian off the middle."""
OUTER = 2.0
"""Distance of a mass far out from its roll's centre, in radii."""
HALF_LOAD = 0.35
"""Of a weight's torque, what goes by half of the angle."""
CORK_NM, CORK_RAD, CORK_MAXWELL, CORK_S = 2.0, 0.05, 25.0, 0.15
"""Torque and angle of cork's exponential; stiffness (N m/rad) and time of its Maxwell element."""
CENTRE_FAR, CENTRE_FREE, CENTRE_PEAK = 1.35, 0.9, 0.33066
"""Distance from the middle to the far end of a spring over the centre, its length without a force, and its largest
torque against stiffness and lever; in levers."""


@compiled
def half_of(angle: float) -> tuple[float, float]:
    """(sine, cosine) of half of an angle: of the place of one roll on the other."""
    return math.sin(0.5 * angle), math.cos(0.5 * angle)


@compiled
def drawn_in(half: tuple[float, float], way: float, off_m: float, below_m: float) -> float:
    """By how much (m) the tendon between two eyelets is shorter than at angle zero, on the side that shortens as the
    angle rises (way 1) or on the other (-1)."""
    return 2.0 * (way * off_m * half[0] + below_m * (1.0 - half[1]))


@compiled
def moment_arm(half: tuple[float, float], way: float, off_m: float, below_m: float) -> float:
    """That per angle (m/rad)."""
    return way * off_m * half[1] + below_m * half[0]


@compiled
def inertias(half: tuple[float, float], physics: Physics, rig: RigLaw) -> tuple[float, float]:
    """(inertia in kg m^2, half of its slope by the angle): of the link, and of a mass far out on it."""
    r, c = physics.roll_m, physics.link_m
    per_outer = 1.0 + OUTER * OUTER + 2.0 * OUTER
    crossed = physics.link_kg * r * c + rig.outer_kgm2 * OUTER / per_outer
    steady = physics.inertia_kgm2 + physics.link_kg * (r * r + c * c)
    steady += rig.outer_kgm2 * (1.0 + OUTER * OUTER) / per_outer
    return steady + 2.0 * crossed * half[1], -0.5 * crossed * half[0]


@compiled
def cord_torque(half: tuple[float, float], physics: Physics) -> float:
    """Torque (N m) of both rubber cords, which pull to the middle; a slack one does not."""
    total = 0.0
    for side in range(2):
        way = 1.0 - 2.0 * side
        stretch = physics.cord_stretch - drawn_in(half, way, CORD_ARM_M, 0.0) / CORD_M
        force = physics.cord_n * (stretch - 1.0 / (stretch * stretch)) if stretch > 1.0 else 0.0
        total += force * moment_arm(half, way, CORD_ARM_M, 0.0)
    return total


@compiled
def guide_drag(level_nm: float, speed: float, late: int, s: State, dt_s: float) -> float:
    """Drag (N m s/rad) of rolls that rub on their guides, and one step of the speed that their film knows."""
    if level_nm <= 0.0:
        return 0.0
    s[late] += dt_s / (LATE_S + dt_s) * (speed - s[late])
    level = level_nm * (1.0 + BREAKS * math.exp(-abs(s[late]) / STRIBECK_RAD_S))
    over = abs(speed) / REVERSES_RAD_S
    return level / REVERSES_RAD_S * (math.tanh(over) / over if over > 1e-6 else 1.0)


@compiled
def squeeze_drag(angle: float, rig: RigLaw) -> float:
    """Drag (N m s/rad) of grease between the rolls."""
    return rig.squeeze_nm_s * (1.0 + NARROWER * angle * angle)


@compiled
def load_torque(angle: float, rig: RigLaw) -> float:
    """Torque (N m) of a weight on the link, whose frame stands askew."""
    half = HALF_LOAD * math.sin(0.5 * angle + rig.load_rad)
    return -rig.load_nm * (half + (1.0 - HALF_LOAD) * math.sin(angle + rig.load_rad))


@compiled
def cork_torque(angle: float, at: int, s: State, rig: RigLaw, dt_s: float) -> float:
    """Torque (N m) of a block of cork at an end of the travel, and one step of its Maxwell element; it only pushes."""
    over = angle - max(rig.stop_low_rad, min(rig.stop_high_rad, angle))
    s[at] += dt_s / (CORK_S + dt_s) * (over - s[at])
    if over == 0.0:
        return 0.0
    way, deep = math.copysign(1.0, over), abs(over)
    pushed = CORK_NM * (math.exp(min(6.0, deep / CORK_RAD)) - 1.0) + CORK_MAXWELL * way * (over - s[at])
    return -way * max(0.0, pushed)


@compiled
def centre_torque(angle: float, rig: RigLaw) -> float:
    """Torque (N m) of a spring over the centre, which pushes the joint away from its middle: a compressed one between a
    lever and a point beyond its end."""
    if rig.centre_nm == 0.0:
        return 0.0
    long = math.sqrt(1.0 + CENTRE_FAR * CENTRE_FAR - 2.0 * CENTRE_FAR * math.cos(angle))
    pushed = max(0.0, CENTRE_FREE - long) / CENTRE_PEAK
    return rig.centre_nm * pushed * CENTRE_FAR * math.sin(angle) / long
