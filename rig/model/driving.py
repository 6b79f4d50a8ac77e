"""The pressures that drive a model over a record: the set-points in force, or what was measured."""

from rig.columns import filled_in
from rig.errors import RecordError
from rig.model.parameters import Input
from rig.model.resample import held_commands
from rig.record import Column, Record
from rig.smoothing import through_parabolas

SMOOTH_S = 0.05
"""Window of the quadratic (Savitzky-Golay) through measured pressures; a regulator with a lag of 40 ms has nothing
above it. Shorter: a monitor's noise shakes a model's hysteresis loose."""


def driving_pressures(grid: Record, drive: Input, p0_mpa: float) -> tuple[Column, Column]:
    """p1 and p2 (MPa) that drive the muscles, (n,) columns of their own: the measured ones without their monitors'
    noise, missing values on straight lines between their neighbours; or the set-points in force. RecordError where they
    were not measured."""
    if drive is Input.COMMAND:
        return held_commands(grid, p0_mpa)
    if grid.p1_mpa is None or grid.p2_mpa is None:
        raise RecordError(f"{grid.name}: the pressures were not measured; drive the model by the command instead")
    return _quiet(filled_in(grid.p1_mpa), grid.period_s), _quiet(filled_in(grid.p2_mpa), grid.period_s)


def _quiet(pressure: Column, dt_s: float) -> Column:
    """The monitor's noise taken off, without delay: no muscle feels it, and a model does. Theta of (11) differentiates
    its input and would carry it into the angle; a hysteresis that is shaken creeps to the middle of its loop."""
    rows = round(SMOOTH_S / dt_s) // 2 * 2 + 1
    return through_parabolas(pressure, rows) if 5 <= rows <= len(pressure) else pressure
