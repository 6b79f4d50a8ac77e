"""A fabric air beam that is folded over a hinge: its volume, its torque, and the crease in its fabric. Compiled.

A beam whose pivot lies beside its axis is mitred where it folds (pneumatic interference actuator: Nesler, Swift and
Rouse 2018): two hoofs of a cylinder are missing, each with the volume pi r^2 d tan(fold / 2) for a pivot d off the
axis. The torque is what the volume, integrated over the pressure, gains per fold given up; with the pivot on the skin
(d = r) and hardly any fold it is pi p r^3, the moment at which an inflated beam collapses (Comer and Levy 1963). Before
a beam kinks it bends all along, which rounds the corner at no fold; the fabric's hoop stretches in proportion to the
pressure.

Creases: Preisach's relays (Preisach 1935; Mayergoyz 1986), as crumpled sheets have them (Shohat, Hexner and Lahini
2022). Both thresholds of a relay are distributed alike and apart from each other, logistically, so that a branch is the
square of what the distribution gains since the last turning point. A relay that turns over gives a part of the fold
back: what is held is the distribution less what has turned over.
"""

import math

from hil.reference.airbeam.physics import Physics
from hil.reference.compiling import State, compiled

MOST_TURNS = 24
TURNS, TURN_PLACE = 0, 1
TURN_OUT = 1 + MOST_TURNS
"""Of a crease: number of open turning points; where they lie (rad); and what had turned over there, of beam 1, then of
beam 2."""
CREASE_STATES = 1 + 3 * MOST_TURNS
FLAT_RAD = -1e3
SHAKEN_RAD = 2.5
SHAKEN_BY = 0.75
"""Where a crease was shaken out from, and by which share each way to and fro is shorter."""


@compiled
def hoofs(fold: float, far: float, physics: Physics) -> float:
    """Volume (m^3) that a beam of its first radius is short of at a fold (rad); `far`: relative error of its pivot."""
    bent, corner = math.tan(0.5 * fold), math.tan(0.5 * physics.round_rad)
    area = 2.0 * math.pi * physics.radius_m**2 * physics.pivot_m * (1.0 + far)
    return area * (math.sqrt(bent * bent + corner * corner) - corner)


@compiled
def hoof_slope(fold: float, far: float, physics: Physics) -> float:
    """By how much that grows per fold (m^3/rad)."""
    bent, corner = math.tan(0.5 * fold), math.tan(0.5 * physics.round_rad)
    area = math.pi * physics.radius_m**2 * physics.pivot_m * (1.0 + far)
    return area * bent * (1.0 + bent * bent) / math.sqrt(bent * bent + corner * corner)


@compiled
def cylinder(physics: Physics) -> float:
    """Volume (m^3) of a straight beam of its first radius."""
    return math.pi * physics.radius_m**2 * physics.length_m


@compiled
def swollen(p_mpa: float, physics: Physics) -> float:
    """Cross-section against the first one, at a gauge pressure."""
    return (1.0 + physics.stretch_per_mpa * p_mpa) ** 2


@compiled
def pressure_work(p_mpa: float, physics: Physics) -> float:
    """The cross-section's growth, integrated over the pressure (MPa)."""
    return ((1.0 + physics.stretch_per_mpa * p_mpa) ** 3 - 1.0) / (3.0 * physics.stretch_per_mpa)


@compiled
def beam_torque(p_mpa: float, fold: float, far: float, physics: Physics) -> float:
    """Torque (N m) by which a beam unfolds under a gauge pressure."""
    return 1e6 * pressure_work(max(0.0, p_mpa), physics) * hoof_slope(fold, far, physics)


@compiled
def beam_volume(p_mpa: float, fold: float, far: float, physics: Physics) -> tuple[float, float]:
    """(a beam's volume against one of the build at angle zero without pressure, its slope by the fold per rad)."""
    there = cylinder(physics) - hoofs(physics.fold_rad, 0.0, physics)
    share = (1.0 - physics.dead_share) * swollen(p_mpa, physics) / there
    now = cylinder(physics) - hoofs(fold, far, physics)
    return physics.dead_share + share * now, -share * hoof_slope(fold, far, physics)


@compiled
def turned(place: float, middle: float, physics: Physics) -> float:
    """Share of the thresholds that lie below a place (rad)."""
    return 1.0 / (1.0 + math.exp(-max(-40.0, min(40.0, (place - middle) / physics.crease_rad))))


@compiled
def turned_over(now: float, beam: int, at: int, s: State, physics: Physics) -> float:
    """What of a beam's relays has turned over at a place (rad), from -1/2 to 1/2, on the branch that is open."""
    last = int(s[at + TURNS]) - 1
    middle = physics.crease_at_rad * (1.0 - 2.0 * beam)
    gained = turned(now, middle, physics) - turned(s[at + TURN_PLACE + last], middle, physics)
    begun = s[at + TURN_OUT + beam * MOST_TURNS + last]
    return begun + gained * gained if last % 2 == 0 else begun - gained * gained


@compiled
def turn_back(place: float, at: int, s: State, physics: Physics) -> None:
    """Remember a turning point; the smallest open loop is forgotten when there are too many."""
    if s[at + TURNS] >= MOST_TURNS:
        s[at + TURNS] -= 2.0
    outs = turned_over(place, 0, at, s, physics), turned_over(place, 1, at, s, physics)
    last = int(s[at + TURNS])
    s[at + TURN_PLACE + last] = place
    s[at + TURN_OUT + last], s[at + TURN_OUT + MOST_TURNS + last] = outs
    s[at + TURNS] += 1.0


@compiled
def fold_on(before: float, now: float, at: int, s: State, physics: Physics) -> None:
    """A crease is folded on: it turned back before, or wipes out turning points that it passes."""
    rising = int(s[at + TURNS]) % 2 == 1
    if (now < before and rising) or (now > before and not rising):
        turn_back(before, at, s, physics)
        rising = not rising
    while s[at + TURNS] > 2.5:
        outer = s[at + TURN_PLACE + int(s[at + TURNS]) - 2]
        if (now < outer) if rising else (now > outer):
            break
        s[at + TURNS] -= 2.0


@compiled
def shake_out(place: float, at: int, s: State, physics: Physics) -> None:
    """A crease that was flat, and folded to and fro about a place, ever less."""
    s[at + TURNS] = 1.0
    s[at + TURN_PLACE], s[at + TURN_OUT], s[at + TURN_OUT + MOST_TURNS] = FLAT_RAD, -0.5, -0.5
    off = SHAKEN_RAD
    for _ in range(MOST_TURNS - 6):
        turn_back(place + off, at, s, physics)
        off *= -SHAKEN_BY


@compiled
def held(now: float, beam: int, at: int, s: State, physics: Physics) -> float:
    """By which share of its level a crease resists at a place (rad), 1/4 in the middle of the widest loop."""
    middle = physics.crease_at_rad * (1.0 - 2.0 * beam)
    return turned(now, middle, physics) - 0.5 - turned_over(now, beam, at, s, physics)
