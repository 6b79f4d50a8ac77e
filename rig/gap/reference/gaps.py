"""The gap of the angle: what was measured less what the rig without a gap would have read under the commands."""

from collections.abc import Sequence

import numpy as np

from rig.columns import rms
from rig.gap.records.pairs import Pair
from rig.gap.reference.expected import Expected
from rig.gap.response.causes import Applied, ready
from rig.gap.response.propagate import Course, response_with
from rig.record import Column


def commanded_gaps(expected: Expected, causes: Sequence[Applied] = ()) -> list[Column]:
    """For each record (n,): the case's angle less what the healthy rig would have read under its commands with these
    causes, holes 0."""
    course = Course(tuple(expected.contexts))
    angles = response_with(ready(causes, expected.response), course, expected.response)
    gaps = [
        context.pair.case.angle_deg - angle
        for context, angle in zip(expected.contexts, course.split(angles), strict=True)
    ]
    return from_own_zeros(gaps, expected)


def from_own_zeros(gaps: Sequence[Column], expected: Expected) -> list[Column]:
    """Gaps of the angle (n,) for each record, holes 0; without its mean where each record took its own zero."""
    used = [pair.used for pair in expected.pairs]
    if not expected.zeroed:
        return [gap * rows for gap, rows in zip(gaps, used, strict=True)]
    return [without_mean(gap, rows) for gap, rows in zip(gaps, used, strict=True)]


def without_mean(column: Column, used: Column) -> Column:
    """A column (n,) less its mean over the rows that were measured (n,), and 0 in the others."""
    out: Column = (column - float(column @ used) / max(float(used.sum()), 1.0)) * used
    return out


def rms_of(columns: Sequence[Column], pairs: Sequence[Pair]) -> float:
    """Rms of columns (n,), one a pair, in their unit, over the rows that were measured."""
    return rms(np.concatenate(columns), np.concatenate([pair.used for pair in pairs]))
