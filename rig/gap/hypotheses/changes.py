"""What causes change in a factor's columns, through the frozen response of the healthy rig: both monitors under the
commands, or the angle under the pressures."""

from collections.abc import Callable, Sequence

import numpy as np

from rig.gap.response.causes import Ready
from rig.gap.response.propagate import Course, HealthyJoint, RecordContext, angle_with, pressures_with, response_with
from rig.model.response.model import ResponseModel
from rig.record import Column

Change = Callable[[Sequence[Ready]], Column]
"""(n,) what causes change in a factor's columns."""


def pressure_change(contexts: Sequence[RecordContext], response: ResponseModel) -> Change:
    """Change of both monitors (MPa), valve 1 of every record and then valve 2."""
    course = Course(tuple(contexts))
    reference = course.reference

    def change(causes: Sequence[Ready]) -> Column:
        p1, p2 = pressures_with(causes, course, response)
        return np.concatenate([p1 - reference.p1_mpa, p2 - reference.p2_mpa])

    return change


def angle_change(
    contexts: Sequence[RecordContext], base: Sequence[Column], response: ResponseModel, driven: bool
) -> Change:
    """Change of the angle (deg), under the measured pressures when `driven`, else under the commands; `base`: for each
    record (n,) the healthy rig's angle under them."""
    course = Course(tuple(contexts))
    pressures = course.measured if driven else None
    if pressures is None:
        return lambda causes: response_with(causes, course, response) - course.reference.angle_deg
    joint = HealthyJoint(*pressures, np.concatenate(list(base)), course, response)
    return lambda causes: angle_with(causes, joint) - joint.angle
