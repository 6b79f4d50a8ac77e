"""Whether records count the angle from where the joint rested before each of them, where nobody says so."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rig.columns import usual_step, white_noise
from rig.gap.records.settings import FIRST_ROWS, TELLS_A_START
from rig.record import ZERO_FACT, Column, Record

OWN_ZERO_NOTE = (
    "every record begins at 0 deg, nearer than a joint comes back to by itself: each is taken to count from where the "
    "joint rested, so what turns it there does not show"
)


def count_from_rest(records: Sequence[Record]) -> bool:
    """Whether the angle of all records begins at zero, each and in the mean, as exactly as an encoder's codes show it.

    A joint with friction and muscles with hysteresis does not come back to an angle as exactly by itself, and its zero
    is a few tenths of a degree off from day to day; an encoder that counts from where it was switched on begins there.
    A sensor with more noise than codes is as near to zero by itself, and tells nothing. Records that say what was taken
    for zero are asked no further, nor are those of other rigs than a joint between two muscles, which a controller may
    hold there.
    """
    if any(ZERO_FACT in record.facts or not record.channels.has_valves for record in records):
        return False
    starts = list[_Start]()
    for record in records:  # most rigs are done at the first
        start = None if record.angle_deg is None else _start_at_zero(record.angle_deg)
        if start is None:
            return False
        starts.append(start)
    off_deg, code_deg, moves_deg = np.array(starts).T
    code = float(np.mean(code_deg))
    return bool(code <= TELLS_A_START * np.max(moves_deg) and abs(np.mean(off_deg)) <= 0.5 * code)


class _Start(NamedTuple):
    """Where a record begins, and what is seen of it; deg."""

    off_deg: float
    code_deg: float
    """Step of the encoder."""
    moves_deg: float
    """From the record's lowest angle to its highest."""


def _start_at_zero(angle: Column) -> _Start | None:
    """Of a column (n,), deg, holes left out, whose codes are wider than its noise and which begins within one of them
    of zero; None for any other."""
    known = angle[np.isfinite(angle)]
    if len(known) < FIRST_ROWS:
        return None
    off, code = float(np.median(known[:FIRST_ROWS])), usual_step(known)
    if abs(off) > code or np.nan_to_num(white_noise([known])) > code:
        return None
    return _Start(off, code, float(np.ptp(known)))
