"""What resists and what stops the joint of the eighth family. Compiled.

The bearing is Gonthier, McPhee, Lange and Piedboeuf's model (2004): a bristle that follows the motion as far as it
sticks, goes to the sliding force as far as it slides, and holds the firmer, the longer it has dwelt. The pin of a
Scotch yoke rubs in its slot by Coulomb's law, by what it carries. Oil of a damper passes another hole each way
(Reimpell and Stoll 1996). A stack of disc springs is soft until its first discs lie flat, and rubs on itself (Almen and
Laszlo 1936).
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.diaphragm.disturbance import RigLaw

BRISTLE_RAD, BRISTLE_DAMPING = 0.004, 0.3
SLIDES_RAD_S, STRAIGHT_RAD_S = 0.02, 0.002
"""Speed at which a bearing begins to slide, and within which the sliding force changes its sign."""
FIRMER, DWELL_S = 0.3, 0.2
SLOT_RAD_S = 0.06
"""Speed within which the slot's friction changes its sign."""
UNEVEN, TURNS_RAD_S = 0.35, 0.1
"""By which share a damper resists more one way, and the speed within which that changes."""
SOFT_NM_RAD, FLAT_RAD, HARD_NM_RAD, DISCS_RUB = 40.0, 0.05, 400.0, 0.2
"""Stiffness of a stack until its first discs lie flat, where that is, stiffness beyond, what it loses by rubbing."""


@compiled
def bearing_torque(level_nm: float, inertia: float, bristle: int, s: State, speed: float, dt_s: float) -> float:
    """Torque (N m) of the bearing, and one step of its bristle (rad) and of how long it has dwelt (0 to 1), which
    follows in the state."""
    if level_nm <= 0.0:
        return 0.0
    stiffness = level_nm / BRISTLE_RAD
    damping = 2.0 * BRISTLE_DAMPING * math.sqrt(stiffness * inertia)
    relaxes_s, sticks = damping / stiffness, math.exp(-min(40.0, (speed / SLIDES_RAD_S) ** 2))
    way = max(-1.0, min(1.0, speed / STRAIGHT_RAD_S))
    pace = dt_s * (1.0 - sticks) / relaxes_s
    bent = (s[bristle] + dt_s * sticks * speed + pace * BRISTLE_RAD * way) / (1.0 + pace)
    dwell_s = DWELL_S if sticks > s[bristle + 1] else relaxes_s
    s[bristle + 1] += dt_s / (dwell_s + dt_s) * (sticks - s[bristle + 1])
    most = BRISTLE_RAD * (1.0 + FIRMER * s[bristle + 1])
    bent = max(-most, min(most, bent))
    rate = (bent - s[bristle]) / dt_s
    s[bristle] = bent
    return -stiffness * bent - damping * rate


@compiled
def slot_torque(carried_nm: float, lever_rad: float, speed: float, slot: float) -> float:
    """Torque (N m) of the pin's friction: it slides along the slot the more, the further the lever is from the line's
    normal."""
    return -slot * abs(carried_nm * math.tan(lever_rad)) * math.tanh(speed / SLOT_RAD_S)


@compiled
def damper_drag(speed: float, rig: RigLaw) -> float:
    """Drag (N m s/rad) of a damper that resists more on the way up."""
    return rig.damper_nm_s * (1.0 + UNEVEN * math.tanh(speed / TURNS_RAD_S))


@compiled
def stack_torque(angle: float, speed: float, rig: RigLaw) -> float:
    """Torque (N m) of a stack of disc springs at an end of the travel; it only pushes."""
    over = angle - max(rig.stop_low_rad, min(rig.stop_high_rad, angle))
    if over == 0.0:
        return 0.0
    way, deep = math.copysign(1.0, over), abs(over)
    pushed = SOFT_NM_RAD * min(deep, FLAT_RAD) + HARD_NM_RAD * max(0.0, deep - FLAT_RAD)
    return -way * pushed * (1.0 + DISCS_RUB * math.tanh(way * speed / TURNS_RAD_S))
