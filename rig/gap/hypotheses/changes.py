"""What causes change in a factor's columns, through the frozen response of the healthy rig: both monitors under the
commands, or the angle under the pressures."""

from collections.abc import Callable, Sequence

import numpy as np

from rig.gap.response.propagate import Course, Ready, RecordContext, angle_with, pressures_with, response_with
from rig.model.response.model import ResponseModel
from rig.record import Column

Change = Callable[[Sequence[Ready]], Column]
"""(n,) what causes change in a factor's columns."""


def pressure_change(contexts: Sequence[RecordContext], response: ResponseModel) -> Change:
    """Both monitors, valve 1 of every record and then valve 2."""
    course = Course(tuple(contexts))
    reference = course.reference

    def change(causes: Sequence[Ready]) -> Column:
        p1, p2 = pressures_with(causes, course, response)
        return np.concatenate([p1 - reference.p1_mpa, p2 - reference.p2_mpa])

    return change


def angle_change(
    contexts: Sequence[RecordContext], base: Sequence[Column], response: ResponseModel, driven: bool
) -> Change:
    """The angle, under the measured pressures when `driven`, else under the commands."""
    course, expected = Course(tuple(contexts)), np.concatenate(list(base))
    pressures = course.measured if driven else None

    def change(causes: Sequence[Ready]) -> Column:
        if pressures is None:
            moved, unmoved = response_with(causes, course, response)[2], course.reference.angle_deg
        else:
            moved, unmoved = angle_with(causes, *pressures, expected, course, response), expected
        out: Column = moved - unmoved
        return out

    return change
