"""The law of the mean pressure, `mean_exponent` of the muscles: whether records show it, and where its search begins.

The compiled search takes one drive for all its points, so the exponent is held there, at the value with which the
response model leaves least; a last polish frees it with everything else (`rig.identify.fit`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.identify.records.data import Prepared
from rig.identify.response.response_fit import Drive, mean_pressure_moves, shown_mean_exponent
from rig.model.parameters import Input, Model, Parameter
from rig.record import Column, Record

NAME = "mean_exponent"
PROPORTIONAL = 1.0
"""Of antagonistic muscles whose stiffness rises in proportion with their pressure."""


def mean_law(records: Sequence[Record], drive: Input, p0_mpa: float) -> tuple[float | None, str]:
    """What to do with the exponent: None to identify it, or the value to hold it at; and why, in one line."""
    means = [mean for record in records if (mean := _mean_mpa(record, drive)) is not None]
    shown = f"the mean pressure stays near {p0_mpa:g} MPa"
    if means and mean_pressure_moves(means, p0_mpa):
        low, high = min(float(mean.min()) for mean in means), max(float(mean.max()) for mean in means)
        return None, f"law of the mean pressure: identified, the mean moves from {low:.3g} to {high:.3g} MPa"
    if drive is Input.COMMAND:
        return 0.0, f"law of the mean pressure: none, {shown}"
    return (
        PROPORTIONAL,
        f"law of the mean pressure: mean_exponent held at {PROPORTIONAL:g}, {shown} and shows nothing of it",
    )


def _mean_mpa(record: Record, drive: Input) -> Column | None:
    """Mean pressure of both muscles, rows without a value left out; None where the record does not have it."""
    commands = (record.p1_cmd_mpa, record.p2_cmd_mpa)
    first, second = (record.p1_mpa, record.p2_mpa) if drive is Input.PRESSURE else commands
    if first is None or second is None:
        return None
    mean: Column = 0.5 * (first + second)
    known = mean[np.isfinite(mean)]
    return known if len(known) else None


def is_free(model: Model) -> bool:
    """Whether the exponent is to be identified beside other parameters."""
    free = [
        (slot, name) for slot, stage in model.stages().items() for name, each in stage.parameters.items() if each.free
    ]
    return ("muscle", NAME) in free and len(free) > 1


def hold(start: Model, data: Sequence[Prepared]) -> Model:
    """`start` with its exponent fixed where the response model leaves least of the angles; as it is where it is not
    free."""
    if not is_free(start):
        return start
    drives = [Drive(start.sample_time_s, each.p1_mpa, each.p2_mpa, each.angle_deg, _counted(each)) for each in data]
    parameter = start.muscle.parameters[NAME]
    found = shown_mean_exponent(drives, start.p0_mpa, otherwise=parameter.value)
    return _with(start, replace(parameter, value=float(np.clip(found, parameter.low, parameter.high)), free=False))


def _counted(each: Prepared) -> Column:
    used = np.ones(len(each.angle_deg))
    used[: each.skip] = 0.0
    return used


def _with(model: Model, exponent: Parameter) -> Model:
    return replace(model, muscle=replace(model.muscle, parameters=model.muscle.parameters | {NAME: exponent}))
