"""The fingerprint of the rig that made some records: the response model fitted to them, what it misses, and what they
show.

It uses the measured pressures where every record has them, whatever drives the model's muscles; else virtual ones.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.columns import rms, white_noise
from rig.identify.records.data import Prepared, RecordOptions, best_input, prepare
from rig.identify.response.response_fit import (
    GRID_S,
    SMOOTHING_S,
    Drive,
    RegulatorRecord,
    bank_sums,
    corrected_misfit_mpa,
    fit_correction,
    fit_regulator,
    fit_response,
    shown_mean_exponent,
)
from rig.model.compiled.columns import drive
from rig.model.compiled.response import RESPONSE_TERMS, regulated
from rig.model.fingerprint import Fingerprint, PressureSource
from rig.model.parameters import Input, Model
from rig.model.resample import as_commanded, set_points
from rig.model.response.fingerprint_check import fingerprint_checksum
from rig.model.response.kept_day import packed
from rig.model.response.model import REGULATOR_TERMS, Regulator, regulators_of
from rig.record import Column, Record
from rig.smoothing import smoothed

LEAST_BANK_ROWS = 10.0 * RESPONSE_TERMS
"""Fewer rows of the grid than this, in all records together, do not determine the bank."""
MOST_HOLES = 0.4
"""Share of a monitor's rows; a logger that stores every fourth packet twice leaves a quarter."""
LEAST_RECORDS = 3
"""From so many on, each record is predicted by a fit to the others."""
FILE_DIGITS = 9
"""Significant digits of the numbers in the file."""


@dataclass(frozen=True, eq=False)
class _Gridded:
    """One record on the grid: each valve's command and pressure, and what drives the muscles."""

    lines: tuple[RegulatorRecord, RegulatorRecord]
    drive: Drive


def fingerprint_of(records: Sequence[Record], model: Model) -> Fingerprint | None:
    """The fingerprint of the rig that made these records, as a file of `model` would hold it; None where they are too
    short for one."""
    return make_fingerprint([prepare(record, model) for record in records], model)


def make_fingerprint(data: Sequence[Prepared], model: Model) -> Fingerprint | None:
    """The fingerprint that belongs into `model`, which was identified on `data`; None where the records are too short
    for one."""
    measured = best_input([each.grid for each in data], RecordOptions())[0] is Input.PRESSURE and not any(
        map(_full_of_holes, data)
    )
    given = None if measured else regulators_of(model)
    records = [record for each in data if _whole(record := _gridded(each, model.p0_mpa, given))]
    if sum(float(record.drive.used.sum()) for record in records) < LEAST_BANK_ROWS:
        return None
    made = _response_part(records, given, model)
    made = _misfit_part(made, records)
    made = _seen_part(made, records, data)
    made = replace(made, day=packed([as_commanded(each.grid, each.record) for each in data]))
    return replace(made, checksum=fingerprint_checksum(made, model))


def _full_of_holes(each: Prepared) -> bool:
    """Too much of a monitor is missing, or was a repeated packet, to interpolate it."""
    monitors = [column for column in (each.record.p1_mpa, each.record.p2_mpa) if column is not None]
    return any(float(np.mean(~np.isfinite(column))) > MOST_HOLES for column in monitors)


def _whole(record: _Gridded) -> bool:
    """Nothing of the record is missing, and some of it counts."""
    columns = [
        record.drive.angle_deg,
        *(column for line in record.lines for column in (line.command_mpa, line.pressure_mpa)),
    ]
    return all(bool(np.isfinite(column).all()) for column in columns) and bool(record.drive.used.any())


def _response_part(records: Sequence[_Gridded], given: tuple[Regulator, Regulator] | None, model: Model) -> Fingerprint:
    """The response model's numbers."""
    drives = [record.drive for record in records]
    lines = _lines(records, 0), _lines(records, 1)
    first, second = given or (fit_regulator(lines[0]), fit_regulator(lines[1]))
    corrections = (
        []
        if given
        else [proven_correction(own, valve, model.p0_mpa) for own, valve in zip(lines, (first, second), strict=True)]
    )
    exponent = _short(shown_mean_exponent(drives, model.p0_mpa))
    found = fit_response(drives, model.p0_mpa, (first, second), exponent)
    return Fingerprint(
        pressures=PressureSource.VIRTUAL if given else PressureSource.MEASURED,
        p0_mpa=model.p0_mpa,
        regulators_s=tuple((_short(dead), _short(fill), _short(exhaust)) for dead, fill, exhaust in (first, second)),
        corrections=tuple(_row(each) for each in corrections),
        weights=_row(found.weights),
        viscous_s=_short(found.balance.viscous_s),
        inertia_s=_short(found.balance.inertia_s),
        slip=_row(found.balance.slip),
        curve=_row(found.balance.curve),
        exponent=exponent,
        misfit_deg=_short(found.misfit_deg),
    )


def _misfit_part(made: Fingerprint, records: Sequence[_Gridded]) -> Fingerprint:
    """What it leaves of these records, and of each when it is fitted to the others."""
    valves = list(zip((_lines(records, 0), _lines(records, 1)), made.regulators_s, made.corrections, strict=False))
    made = replace(
        made,
        misfit_mpa=_row(
            corrected_misfit_mpa(lines, regulator, np.array(correction), made.p0_mpa)
            for lines, regulator, correction in valves
        ),
    )
    if len(records) < LEAST_RECORDS:
        return made
    return replace(
        made,
        left_out_deg=_short(left_out_deg([record.drive for record in records], made.p0_mpa, made.exponent)),
        left_out_mpa=_row(
            left_out_mpa(lines, regulator, made.p0_mpa, corrected=any(correction))
            for lines, regulator, correction in valves
        ),
    )


def _seen_part(made: Fingerprint, records: Sequence[_Gridded], data: Sequence[Prepared]) -> Fingerprint:
    """What the records are, their noise, and the range that they showed."""
    drives = [record.drive for record in records]
    measured = made.pressures is PressureSource.MEASURED
    return replace(
        made,
        records=len(records),
        seconds=_short(sum(float(each.used.sum()) * each.dt_s for each in drives)),
        grid_s=_short(drives[0].dt_s),
        noise_deg=_short(_noise(data, "angle_deg")),
        noise_mpa=_row(_noise(data, name) for name in ("p1_mpa", "p2_mpa")) if measured else (),
        drive_mpa=_range([drive(each.p1_mpa, each.p2_mpa, made.p0_mpa, made.exponent) for each in drives]),
        mean_mpa=_range(_means(records)),
    )


def _lines(records: Sequence[_Gridded], valve: int) -> list[RegulatorRecord]:
    return [record.lines[valve] for record in records]


def _means(records: Sequence[_Gridded]) -> list[Column]:
    return [0.5 * (record.drive.p1_mpa + record.drive.p2_mpa) for record in records]


def left_out_deg(records: Sequence[Drive], p0_mpa: float, exponent: float) -> float:
    """Rms (deg) of the bank on each record when it is fitted to the others."""
    sums = [bank_sums(record, p0_mpa, exponent) for record in records]
    missed, rows = 0.0, 0.0
    for k, own in enumerate(sums):
        first, *others = sums[:k] + sums[k + 1 :]
        missed += own.rows * own.misfit_deg(sum(others, first).weights()) ** 2
        rows += own.rows
    return float(np.sqrt(missed / max(rows, 1.0)))


def proven_correction(lines: Sequence[RegulatorRecord], regulator: Regulator, p0_mpa: float) -> Column:
    """(REGULATOR_TERMS,) weights (MPa) of what the monitor shows beside the regulator where that predicts records that
    the fit has not seen; nought where it does not, or where there are too few records to know."""
    if len(lines) < LEAST_RECORDS:
        return np.zeros(REGULATOR_TERMS)
    proven = left_out_mpa(lines, regulator, p0_mpa, True) < left_out_mpa(lines, regulator, p0_mpa, False)
    return fit_correction(lines, regulator, p0_mpa) if proven else np.zeros(REGULATOR_TERMS)


def left_out_mpa(lines: Sequence[RegulatorRecord], regulator: Regulator, p0_mpa: float, corrected: bool) -> float:
    """Rms (MPa) of a regulator, with its correction or without, on each record when it is fitted to the others, from
    what all of them gave."""
    missed = []
    for k, own in enumerate(lines):
        others = [*lines[:k], *lines[k + 1 :]]
        fitted = fit_regulator(others, (regulator,), steps=2)
        beside = fit_correction(others, fitted, p0_mpa) if corrected else np.zeros(REGULATOR_TERMS)
        missed.append(corrected_misfit_mpa([own], fitted, beside, p0_mpa))
    return rms(np.array(missed))


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
        pressures = [
            _smooth(column, dt_s)[::stride].copy() for column in (record.p1_mpa, record.p2_mpa) if column is not None
        ]
    else:
        pressures = [regulated(command, *valve, grid_s) for command, valve in zip(commands, given, strict=True)]
    first, second = (RegulatorRecord(grid_s, u, p, used) for u, p in zip(commands, pressures, strict=True))
    angle = _smooth(each.angle_deg, dt_s)[::stride].copy()
    return _Gridded((first, second), Drive(grid_s, pressures[0], pressures[1], angle, used))


def _smooth(column: Column, dt_s: float) -> Column:
    smooth: Column = smoothed(column, SMOOTHING_S / dt_s) if dt_s < SMOOTHING_S else column
    return smooth


def _noise(data: Sequence[Prepared], name: str) -> float:
    """Of a column as it was recorded, by stretches without missing rows; 0 where none is long enough."""
    return float(np.nan_to_num(white_noise([getattr(each.record, name) for each in data])))


def _range(columns: Sequence[Column]) -> tuple[float, float]:
    return _short(min(float(column.min()) for column in columns)), _short(
        max(float(column.max()) for column in columns)
    )


def _short(number: float) -> float:
    return float(f"{number:.{FILE_DIGITS}g}")


def _row(numbers: Iterable[float]) -> tuple[float, ...]:
    return tuple(_short(float(number)) for number in numbers)
