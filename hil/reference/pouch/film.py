"""A heat-sealed pouch of a film that stretches: its shape, its volume, its pull; its delayed strain; its creases.
Compiled.

Between two welds both films of a pouch are arcs of one half angle, its opening (Niiyama and others 2015; Veale and
others 2016). Unlike there, the film stretches, and the side seams draw in by a share of the height, as the ends of a
cushion do, so that no formula gives the pull: the opening is where the pressure's work less the film's energy is
stationary, and the pull is what that loses per length. For a film that does not stretch and a pouch without ends it is
w l p cos(t) / t.

The film's strain goes on under its stress after Kohlrausch (1854; Williams and Watts 1970) by exp(-(t / T)^0.5), whose
spectrum of relaxation times is known in closed form (Lindsey and Patterson 1980).

As a pouch grows shorter, its side seams buckle into a zigzag, whose angle has the cosine length over film. Each bend is
a crease, an elastic-plastic hinge (Jules, Lechenault and Adda-Bedia 2020): elastic up to a moment that grows with the
pressure, beyond it plastic, hardening by Armstrong and Frederick's rule (1966), whose back moment fades with the
plastic path.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.pouch.physics import Physics

LEAST_RAD, MOST_RAD = 0.03, 1.45
"""Between which a pouch opens."""
LEAST_MPA = 1e-4
MOST_STEP_RAD, NEAR_RAD = 0.2, 1e-3
"""Longest step of Newton's rule, and the step up to which a tangent is taken on by a series."""
STRAINS = 6
STRAIN_FIRST, STRAIN_RATIO = 0.02, 4.0
"""Delayed strains: the shortest relaxation time against Kohlrausch's, and from one to the next."""
STRAIN_TIMES = tuple(STRAIN_FIRST * STRAIN_RATIO**k for k in range(STRAINS))
STRAIN_SHARES = tuple(
    math.log(STRAIN_RATIO) * math.sqrt(time) * math.exp(-0.25 * time) / (2.0 * math.sqrt(math.pi))
    for time in STRAIN_TIMES
)
STRAIN_RATES = tuple(1.0 / time for time in STRAIN_TIMES)
"""Kohlrausch's spectrum at the power 1/2: what of the delayed strain has each relaxation time."""
CREASE_GIVEN, CREASE_BACK = range(2)
CREASE_STATES = 2
"""Of a muscle's creases: the angle that they have given, the back moment against the moment at which they give."""
FLATTEST = 0.995
"""Length over film at which a seam is taken for flat."""


@compiled
def sector(opening: float, half: float) -> float:
    """Section of a pouch over the square of its length; `half`: tangent of half of its opening."""
    over = 1.0 + half * half
    return 0.125 * (opening * over - 2.0 * half * (1.0 - half * half) / over) * over / (half * half)


@compiled
def volume(opening: float, half: float, length_m: float, physics: Physics) -> float:
    """Volume (m^3) of a pouch: it is full in the middle and draws in at its ends."""
    return sector(opening, half) * length_m * length_m * (physics.width_m - physics.ends * length_m * half)


@compiled
def strain(opening: float, half: float, length_m: float, film_m: float) -> float:
    """Strain of the film of a pouch."""
    return length_m * opening * (1.0 + half * half) / (2.0 * half * film_m) - 1.0


@compiled
def gained(
    opening: float, half: float, length_m: float, pressure_pa: float, film_m: float, stiffness: float, physics: Physics
) -> tuple[float, float]:
    """(what the pressure's work less the film's energy gains per opening, over width and length, in N/m; the slope of
    that by the opening)."""
    half_1 = 0.5 * (1.0 + half * half)
    by_sin = half_1 / half
    cot = (1.0 - half * half) / (2.0 * half)
    drawn = physics.ends / physics.width_m * length_m
    area = sector(opening, half)
    area_1 = 1.0 - 2.0 * area * cot
    area_2 = 2.0 * (area * by_sin * by_sin - area_1 * cot)
    arc = opening * by_sin
    arc_1 = by_sin - arc * cot
    arc_2 = arc - 2.0 * arc_1 * cot
    work = area_1 - drawn * (area_1 * half + area * half_1)
    work_1 = area_2 - drawn * (area_2 * half + 2.0 * area_1 * half_1 + area * half * half_1)
    over = length_m * arc / film_m - 1.0
    gain = pressure_pa * length_m * work - 2.0 * stiffness * over * arc_1
    slope = length_m / film_m * arc_1 * arc_1 + over * arc_2
    return gain, pressure_pa * length_m * work_1 - 2.0 * stiffness * slope


@compiled
def opened(
    opening: float, length_m: float, p_mpa: float, film_m: float, stiffness: float, rounds: int, physics: Physics
) -> tuple[float, float]:
    """(half angle (rad) to which a pouch opens, from near there, by so many rounds of Newton's rule; the tangent of
    half of it)."""
    pressure, half = 1e6 * max(LEAST_MPA, p_mpa), math.tan(0.5 * opening)
    for _ in range(rounds):
        gain, slope = gained(opening, half, length_m, pressure, film_m, stiffness, physics)
        way = -gain / slope if slope < 0.0 else math.copysign(MOST_STEP_RAD, gain)
        way = max(-MOST_STEP_RAD, min(MOST_STEP_RAD, way))
        way = max(LEAST_RAD, min(MOST_RAD, opening + way)) - opening
        opening += way
        if abs(way) > NEAR_RAD:
            half = math.tan(0.5 * opening)
        else:
            half += 0.5 * (1.0 + half * half) * way * (1.0 + 0.5 * half * way)
    return opening, half


@compiled
def pull(
    opening: float, half: float, length_m: float, p_mpa: float, film_m: float, stiffness: float, physics: Physics
) -> float:
    """Force (N) by which a pouch pulls its ends together."""
    arc = opening * (1.0 + half * half) / (2.0 * half)
    wide = 2.0 * physics.width_m - 3.0 * physics.ends * length_m * half
    by_air = -1e6 * max(LEAST_MPA, p_mpa) * sector(opening, half) * length_m * wide
    return by_air + 2.0 * stiffness * physics.width_m * arc * strain(opening, half, length_m, film_m)


@compiled
def strain_on(at_once: float, more: float, at: int, s: State, physics: Physics, dt_s: float) -> float:
    """One step of a film's delayed strain under the strain that its stress brings at once; returns all of it."""
    goal, pace, total = (physics.delayed + more) * at_once, dt_s / physics.delayed_s, 0.0
    for k in range(STRAINS):
        s[at + k] += min(1.0, STRAIN_RATES[k] * pace) * (STRAIN_SHARES[k] * goal - s[at + k])
        total += s[at + k]
    return total


@compiled
def zigzag(length_m: float, film_m: float) -> tuple[float, float]:
    """(angle (rad) of the zigzag of a pouch's side seams, its sine)."""
    cos = min(FLATTEST, length_m / film_m)
    return math.acos(cos), math.sqrt(1.0 - cos * cos)


@compiled
def crease_on(angle: float, at: int, s: State, physics: Physics) -> float:
    """A pouch's creases are bent to an angle: returns their moment against the one at which they begin to give."""
    bent = (angle - s[at + CREASE_GIVEN]) / physics.crease_rad
    back = s[at + CREASE_BACK]
    way = math.copysign(1.0, bent - back)
    over = way * (bent - back) - 1.0
    if over <= 0.0:
        return bent
    elastic, fades = 1.0 / physics.crease_rad, 1.0 / physics.crease_fades_rad
    hardening = physics.crease_more * fades
    half = elastic + hardening - fades * (way * bent - 1.0)
    # over - path half - path^2 elastic fades = 0: on the limit again after that plastic path
    path = 2.0 * over / (half + math.sqrt(half * half + 4.0 * elastic * fades * over))
    s[at + CREASE_BACK] = (back + hardening * path * way) / (1.0 + fades * path)
    s[at + CREASE_GIVEN] += path * way
    return bent - path * way * elastic


@compiled
def crease_force(moment: float, p_mpa: float, sine: float, film_m: float, physics: Physics) -> float:
    """Force (N) that a row's creases take of its pull, at a sine of their zigzag."""
    begins = physics.crease_nm + physics.crease_nm_mpa * max(0.0, p_mpa)
    return begins * moment / (film_m * sine)
