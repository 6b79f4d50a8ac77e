"""A rolling diaphragm in a conical bore: its area, its volume, its force, how it resists rolling, its rubber. Compiled.

The effective diameter of a rolling diaphragm lies in the middle of its convolution, between bore and piston (Bellofram
design manual; Whitney and others 2014); in a bore and on a piston that taper it falls with the stroke, as it does on
the contoured pistons of rolling-lobe air springs (Quaglia and Sorli 2001). The push is what the volume, integrated
over the pressure, gains per stroke. Coated fabric lets the convolution widen in proportion to the pressure.

Rolling bends and unbends coated fabric: endochronic theory without a yield surface (Valanis 1971), whose memory fades
with the path that was rolled and not with time, by three lengths. The level grows with the pressure, as with air
springs (Berg 1999). Rubber: a spring-pot, the fractional derivative that rubber and air springs are described by
(Koeller 1984; Sjoberg and Kari 2002), by a geometric series of relaxing springs.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.diaphragm.physics import Physics

ROLLS = 3
ROLL_LENGTHS, ROLL_SHARES = (0.25, 1.0, 5.0), (0.4, 0.35, 0.25)
"""Lengths over which what was rolled is forgotten, against the middle one, and what each holds of the level."""
POTS = 8
POT_FIRST_S, POT_RATIO = 0.015, 4.0
"""Relaxation times of the rubber: the shortest, and from one to the next."""
RUBBER_STATES = POTS + 1
LEAST_DIAMETER_M = 0.012


@compiled
def diameter(stroke_m: float, wide: float, physics: Physics) -> float:
    """Effective diameter (m) at a stroke out from the middle; `wide`: relative error of a diaphragm's size."""
    return max(LEAST_DIAMETER_M, physics.diameter_m * (1.0 + wide) - physics.taper * stroke_m)


@compiled
def area(stroke_m: float, wide: float, physics: Physics) -> float:
    """Effective area (m^2) without pressure."""
    across = diameter(stroke_m, wide, physics)
    return 0.25 * math.pi * across * across


@compiled
def push(p_mpa: float, stroke_m: float, wide: float, physics: Physics) -> float:
    """Force (N) by which a cylinder pushes at a gauge pressure."""
    p = max(0.0, p_mpa)
    return 1e6 * area(stroke_m, wide, physics) * p * (1.0 + 0.5 * physics.swell_per_mpa * p)


@compiled
def volume(p_mpa: float, stroke_m: float, wide: float, physics: Physics) -> float:
    """A cylinder's volume against one of the build in the middle without pressure."""
    there = 0.25 * math.pi * physics.diameter_m**2 * physics.middle_m
    across, middle = diameter(stroke_m, wide, physics), physics.diameter_m * (1.0 + wide)
    swept = 0.25 * math.pi * (middle**3 - across**3) / (3.0 * physics.taper)
    air = 0.25 * math.pi * middle**2 * physics.middle_m + swept
    return physics.dead_share + (1.0 - physics.dead_share) * air / there * (1.0 + physics.swell_per_mpa * p_mpa)


@compiled
def roll_on(rolled_m: float, at: int, s: State, physics: Physics) -> None:
    """A diaphragm is rolled on by a stroke: each memory (-1 to 1) fades with the path and takes its direction."""
    way, path = math.copysign(1.0, rolled_m), abs(rolled_m)
    for k in range(ROLLS):
        left = math.exp(-path / (ROLL_LENGTHS[k] * physics.lobe_m))
        s[at + k] = way + (s[at + k] - way) * left


@compiled
def roll_force(p_mpa: float, at: int, s: State, physics: Physics) -> float:
    """Force (N) by which a diaphragm resists, against its last strokes."""
    held = 0.0
    for k in range(ROLLS):
        held += ROLL_SHARES[k] * s[at + k]
    return -(physics.lobe_n + physics.lobe_n_mpa * max(0.0, p_mpa)) * held


@compiled
def rig_stiffness(physics: Physics) -> float:
    """Stiffness (N/m) of both cylinders at 0.2 MPa and of the spring, as the yoke has it at angle zero."""
    per_stroke = 0.5 * math.pi * physics.diameter_m * physics.taper
    return 2.0 * 0.2e6 * per_stroke + physics.spring_nm_rad / (physics.arm_m * physics.arm_m)


@compiled
def first_pot(order: float) -> float:
    """Stiffness of the quickest relaxing spring, so that all together hold t^-order at a time t (s) after a stroke of
    1: that power as a sum over relaxation times."""
    return math.log(POT_RATIO) * math.pow(POT_FIRST_S, -order) / math.gamma(order)


@compiled
def rubber_force(more: float, stroke_m: float, at: int, s: State, physics: Physics, dt_s: float) -> float:
    """Force (N) of the rubber of both diaphragms, and one step of its relaxing springs, of which `s` holds the other
    ends (m); all those slower than POTS of them are one that stays."""
    order, total, time_s = physics.rubber_order, 0.0, POT_FIRST_S
    stiffness, less = (physics.rubber + more) * rig_stiffness(physics) * first_pot(order), math.pow(POT_RATIO, -order)
    for k in range(POTS):
        stretch = stroke_m - s[at + k]
        s[at + k] += dt_s / (time_s + dt_s) * stretch
        total -= stiffness * stretch
        stiffness *= less
        time_s *= POT_RATIO
    return total - stiffness / (1.0 - less) * (stroke_m - s[at + POTS])
