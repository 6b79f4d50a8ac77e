"""The fingerprint of the rig that made some records: the response model fitted to them, what it misses, and what they show.

It uses the measured pressures where every record has them, whatever drives the model's muscles; else virtual ones.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from rig.columns import white_noise
from rig.identify.data import Prepared
from rig.identify.response import (
    Drive,
    Line,
    bank_sums,
    fit_mean_exponent,
    fit_regulator,
    fit_response,
    mean_pressure_moves,
    regulator_misfit_mpa,
)
from rig.model.fingerprint import Fingerprint, PressureSource, fingerprint_checksum
from rig.model.kernels import drive
from rig.model.parameters import Model
from rig.model.resample import set_points
from rig.model.response import Regulator, regulators_of
from rig.model.response_kernels import regulated
from rig.record import Column

GRID_S = 0.01
"""Finest grid of the fits: no regulator and no joint of this kind has anything above it."""
SMOOTHING_S = 0.012
"""Standard deviation of the symmetric smoothing, as the diagnosis smooths: noise must not rattle in the bank's plays."""
LEAST_RECORDS = 3
"""From so many on, each record is predicted by a fit to the others."""
DIGITS = 9
"""Significant digits of the numbers in the file."""


@dataclass(frozen=True, eq=False)
class _Gridded:
    """One record on the grid: each valve's command and pressure, and what drives the muscles."""

    lines: tuple[Line, Line]
    drive: Drive


def make_fingerprint(data: Sequence[Prepared], model: Model) -> Fingerprint:
    """The fingerprint that belongs into `model`, which was identified on `data`."""
    measured = all(each.grid.has_pressures for each in data)
    given = None if measured else regulators_of(model)
    records = [_gridded(each, model.p0_mpa, given) for each in data]
    lines = tuple([record.lines[k] for record in records] for k in (0, 1))
    regulators = given or (fit_regulator(lines[0]), fit_regulator(lines[1]))
    drives = [record.drive for record in records]
    means = [0.5 * (each.p1_mpa + each.p2_mpa) for each in drives]
    exponent = fit_mean_exponent(drives, model.p0_mpa) if mean_pressure_moves(means, model.p0_mpa) else 1.0
    found = fit_response(drives, model.p0_mpa, regulators, exponent)
    enough = len(records) >= LEAST_RECORDS
    by_valve = list(zip(lines, regulators, strict=True)) if measured else []
    made = Fingerprint(
        pressures=PressureSource.MEASURED if measured else PressureSource.VIRTUAL,
        records=len(records),
        seconds=_short(sum(float(each.used.sum()) * each.dt_s for each in drives)),
        grid_s=_short(drives[0].dt_s),
        p0_mpa=model.p0_mpa,
        regulators_s=tuple((_short(dead), _short(fill), _short(exhaust)) for dead, fill, exhaust in regulators),
        weights=_row(found.weights),
        viscous_s=_short(found.balance.viscous_s),
        inertia_s=_short(found.balance.inertia_s),
        slip=_row(found.balance.slip),
        curve=_row(found.balance.curve),
        exponent=_short(exponent),
        misfit_deg=_short(found.misfit_deg),
        misfit_mpa=_row(regulator_misfit_mpa(line, regulator) for line, regulator in by_valve),
        left_out_deg=_short(left_out_deg(drives, model.p0_mpa, exponent)) if enough else None,
        left_out_mpa=_row(left_out_mpa(line, regulator) for line, regulator in by_valve) if enough else (),
        noise_deg=_short(_noise(data, "angle_deg")),
        noise_mpa=_row(_noise(data, name) for name in ("p1_mpa", "p2_mpa")) if measured else (),
        drive_mpa=_range([drive(each.p1_mpa, each.p2_mpa, model.p0_mpa, exponent) for each in drives]),
        mean_mpa=_range(means),
    )
    return replace(made, checksum=fingerprint_checksum(made, model))


def left_out_deg(records: Sequence[Drive], p0_mpa: float, exponent: float) -> float:
    """Rms (deg) of the bank on each record when it is fitted to the others."""
    sums = [bank_sums(record, p0_mpa, exponent) for record in records]
    missed, rows = 0.0, 0.0
    for k, own in enumerate(sums):
        first, *others = sums[:k] + sums[k + 1 :]
        missed += own.rows * own.misfit_deg(sum(others, first).weights()) ** 2
        rows += own.rows
    return float(np.sqrt(missed / max(rows, 1.0)))


def left_out_mpa(lines: Sequence[Line], regulator: Regulator) -> float:
    """Rms (MPa) of a regulator on each record when it is fitted to the others, from what all of them gave."""
    missed = []
    for k, own in enumerate(lines):
        others = fit_regulator([*lines[:k], *lines[k + 1 :]], (regulator,), steps=2)
        missed.append(regulator_misfit_mpa([own], others))
    return float(np.sqrt(np.mean(np.square(missed))))


def _gridded(each: Prepared, p0_mpa: float, given: tuple[Regulator, Regulator] | None) -> _Gridded:
    """The record on the grid; its pressures are the measured ones, or those of the `given` regulators."""
    record, dt_s = each.grid, each.grid.period_s
    stride = max(1, round(GRID_S / dt_s))
    commands = [column[::stride].copy() for column in set_points(record, p0_mpa)]
    grid_s = dt_s * stride
    used = np.ones(len(commands[0]))
    used[: -(-each.skip // stride)] = 0.0
    used[-max(1, round(2 * SMOOTHING_S / grid_s)) :] = 0.0
    if given is None:
        pressures = [_smooth(column, dt_s)[::stride].copy() for column in (record.p1_mpa, record.p2_mpa) if column is not None]
    else:
        pressures = [regulated(command, *valve, grid_s) for command, valve in zip(commands, given, strict=True)]
    first, second = (Line(grid_s, u, p, used) for u, p in zip(commands, pressures, strict=True))
    angle = _smooth(each.angle_deg, dt_s)[::stride].copy()
    return _Gridded((first, second), Drive(grid_s, pressures[0], pressures[1], angle, used))


def _smooth(column: Column, dt_s: float) -> Column:
    smooth: Column = gaussian_filter1d(column, SMOOTHING_S / dt_s, mode="nearest") if dt_s < SMOOTHING_S else column
    return smooth


def _noise(data: Sequence[Prepared], name: str) -> float:
    """Of a column as it was recorded."""
    columns = [getattr(each.record, name) for each in data]
    return white_noise([column[np.isfinite(column)] for column in columns])


def _range(columns: Sequence[Column]) -> tuple[float, float]:
    return _short(min(float(column.min()) for column in columns)), _short(max(float(column.max()) for column in columns))


def _short(number: float) -> float:
    return float(f"{number:.{DIGITS}g}")


def _row(numbers: Iterable[float]) -> tuple[float, ...]:
    return tuple(_short(float(number)) for number in numbers)
