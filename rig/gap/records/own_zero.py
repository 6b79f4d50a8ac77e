"""Whether records count the angle from where the joint rested before each of them, where nobody says so."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rig.columns import white_noise
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
    starts = [_start(record.angle_deg) for record in records if record.angle_deg is not None]
    if len(starts) < len(records) or not all(start.is_zero for start in starts):
        return False
    mean_deg, code_deg = (float(np.mean(part)) for part in list(zip(*starts, strict=True))[:2])
    tells = code_deg <= TELLS_A_START * max(start.moves_deg for start in starts)
    return tells and abs(mean_deg) <= 0.5 * code_deg


class _Start(NamedTuple):
    """Where a record begins, and what is seen of it; deg."""

    deg: float
    code_deg: float
    """Step of the encoder."""
    noise_deg: float
    """Standard deviation of the white noise of one row."""
    moves_deg: float
    """From the record's lowest angle to its highest."""

    @property
    def is_zero(self) -> bool:
        """As nearly as one record of an encoder shows it."""
        return abs(self.deg) <= self.code_deg and self.noise_deg <= self.code_deg


def _start(angle: Column) -> _Start:
    """Of a column (n,), deg; holes left out. A column without rows begins nowhere: not at zero."""
    known = angle[np.isfinite(angle)]
    if len(known) < FIRST_ROWS:
        return _Start(math.inf, 0.0, 0.0, 0.0)
    steps = np.diff(np.unique(known))
    code = float(np.median(steps)) if len(steps) else 0.0
    noise = float(np.nan_to_num(white_noise([known])))
    return _Start(float(np.median(known[:FIRST_ROWS])), code, noise, float(np.ptp(known)))
