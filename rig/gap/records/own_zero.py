"""Whether records count the angle from where the joint rested before each of them, where nobody says so."""

from collections.abc import Sequence

import numpy as np

from rig.columns import white_noise
from rig.gap.records.settings import FIRST_ROWS, NOISE_OF_A_START, STARTS_AT_ZERO
from rig.record import ZERO_FACT, Column, Record

OWN_ZERO_NOTE = (
    "every record begins at 0 deg, nearer than a joint comes back to by itself: each is taken to count from where the "
    "joint rested, so what turns it there does not show"
)


def count_from_rest(records: Sequence[Record]) -> bool:
    """Whether every record's angle begins at zero, as nearly as its noise and its converter let one see.

    A joint with friction and muscles with hysteresis does not come back to an angle as exactly by itself, and its zero
    is a few tenths of a degree off from day to day; an encoder that counts from where it was switched on begins there,
    and so does a program that takes the first reading off. Records that say what was taken for zero are asked no
    further, nor are those of other rigs than a joint between two muscles, which a controller may hold there.
    """
    return not any(ZERO_FACT in record.facts for record in records) and all(map(_begins_at_zero, records))


def _begins_at_zero(record: Record) -> bool:
    angle = record.angle_deg
    if angle is None or not record.channels.has_valves:
        return False
    known = angle[np.isfinite(angle)]
    first = known[:FIRST_ROWS]
    return len(first) == FIRST_ROWS and abs(float(np.median(first))) <= _seen_of_a_start(known)


def _seen_of_a_start(angle: Column) -> float:
    """How near to zero a column (n,) without holes that begins there is seen to, in its unit."""
    noise = float(np.nan_to_num(white_noise([angle])))
    steps = np.diff(np.unique(angle))
    half_a_step = 0.5 * float(np.median(steps)) if len(steps) else 0.0
    return max(NOISE_OF_A_START * noise, half_a_step, STARTS_AT_ZERO * float(np.ptp(angle)))
