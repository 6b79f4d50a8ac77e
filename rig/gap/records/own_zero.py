"""Whether records count the angle from where the joint rested before each of them, where nobody says so."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rig.columns import white_noise
from rig.gap.records.settings import FIRST_ROWS, MOVED_AT_FIRST, NOISE_OF_A_START, NOISE_OF_STARTS, TELLS_A_START
from rig.record import ZERO_FACT, Column, Record

OWN_ZERO_NOTE = (
    "every record begins at 0 deg, nearer than a joint comes back to by itself: each is taken to count from where the "
    "joint rested, so what turns it there does not show"
)


def count_from_rest(records: Sequence[Record]) -> bool:
    """Whether the angle of all records begins at zero, each and in the mean, as nearly as noise and converter let one
    see; never where they let one see little.

    A joint with friction and muscles with hysteresis does not come back to an angle as exactly by itself, and its zero
    is a few tenths of a degree off from day to day; an encoder that counts from where it was switched on begins there,
    and so does a program that takes the first reading off. Records that say what was taken for zero are asked no
    further, nor are those of other rigs than a joint between two muscles, which a controller may hold there.
    """
    if any(ZERO_FACT in record.facts or not record.channels.has_valves for record in records):
        return False
    starts = [_start(record.angle_deg) for record in records if record.angle_deg is not None]
    if len(starts) < len(records) or not all(start.tells and start.is_zero for start in starts):
        return False
    mean_deg, noise_deg, step_deg = (float(np.mean(part)) for part in list(zip(*starts, strict=True))[:3])
    return abs(mean_deg) <= max(NOISE_OF_STARTS * noise_deg / math.sqrt(len(starts)), step_deg)


class _Start(NamedTuple):
    """Where a record begins, and what is seen of it; deg."""

    deg: float
    noise_deg: float
    """Standard deviation of the white noise of one row."""
    step_deg: float
    """What neither the converter, by half a step, nor the joint's first motion tells from zero."""
    tells: bool
    """It is seen well enough to tell a zero of its own from a sensor that happens to be near it."""

    @property
    def is_zero(self) -> bool:
        """As nearly as one record shows it."""
        return abs(self.deg) <= max(NOISE_OF_A_START * self.noise_deg, 2.0 * self.step_deg)


def _start(angle: Column) -> _Start:
    """Of a column (n,), deg; holes left out."""
    known = angle[np.isfinite(angle)]
    if len(known) < FIRST_ROWS:
        return _Start(0.0, 0.0, 0.0, False)
    steps, moves = np.diff(np.unique(known)), float(np.ptp(known))
    noise = float(np.nan_to_num(white_noise([known])))
    step = max(0.5 * float(np.median(steps)) if len(steps) else 0.0, MOVED_AT_FIRST * moves)
    tells = max(NOISE_OF_STARTS * noise, step) <= TELLS_A_START * moves
    return _Start(float(np.median(known[:FIRST_ROWS])), noise, step, tells)
