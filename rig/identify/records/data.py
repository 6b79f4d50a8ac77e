"""From records to what identification works on: checked, on the model's clock, its inputs ready.

Whatever cannot be used is refused in one line that says what is wrong and what would help; what is only doubtful
becomes a warning. Reading files is `rig.log.reader`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.channels import common
from rig.errors import RecordError
from rig.identify.records.causality import before_command, subject_of
from rig.identify.records.mix_ups import mix_ups, strange_clock
from rig.identify.records.monitors import dead_monitor
from rig.log.foreign.units import PRESSURE_SIZES, unit_by_size
from rig.model.driving import driving_pressures
from rig.model.external.simulator import KIND as EXTERNAL
from rig.model.parameters import Input, Model
from rig.model.resample import commanded, is_regular, on_grid
from rig.number_text import counted
from rig.record import MEASURED_COLUMNS, Column, Record

SHORTEST_LOOP_S = 1.0
"""A record shorter than this shows no loop at any frequency of the sweep range."""
LARGEST_GAP = 20
"""Rows missing in one place up to which a record is interpolated; beyond, the state of the muscles is lost."""
MOST_MISSING = 0.05
"""Share of NaN in a measured column up to which it is interpolated."""
LEAST_INPUT_MPA = 0.005
LEAST_OUTPUT_DEG = 0.05
"""Peak to peak below which a record excites nothing."""
MOST_PRESSURE_MPA = PRESSURE_SIZES[0][0]
"""More than any regulator of the rig can set: another unit."""
TEN_TURNS_DEG = 3600.0
"""More than a potentiometer of ten turns shows: counts, or a broken value."""
LEAST_REPEATS = 0.02
"""Share of rows from which equal measurements mean repeated packets, and not a chance of the converters."""
RADIANS = 1.6
RADIANS_MOVED_MPA = 0.1
"""An angle that stays below RADIANS while the pressure moves by this much is probably in radians: a rig of 150 deg/MPa
turns by 15 deg then. Less pressure, and a stiff joint that is measured in degrees is refused until --trust-units says
so."""
SAME_PERIOD = 0.02
"""Share by which a record's period may differ from the model's: times that a log rounds to 0.1 ms put a period of 5 ms
off by 2 %. As much as is let through is missing in every time constant afterwards."""


@dataclass(frozen=True)
class RecordOptions:
    """What the caller allows."""

    resample: bool = False
    """Put a record of another sampling period onto the model's."""
    trust_units: bool = False
    """Do not refuse numbers that look like another unit."""
    skip_s: float = 0.0
    """Start of each record that is simulated but does not count in the error: a start-up transient."""
    until_s: float | None = None
    """Nothing after this time of each record is looked at: the rest is kept for validation."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """A record on the model's grid with what drives the muscles; columns of shape (n,)."""

    record: Record
    """As it was read, up to where it may be looked at, and without what a logger stored twice."""
    grid: Record
    """On the model's clock, nothing missing."""
    p1_mpa: Column
    p2_mpa: Column
    angle_deg: Column
    skip: int
    """Rows at the start that do not count."""
    warnings: list[str] = field(default_factory=list)

    @property
    def amplitude_mpa(self) -> float:
        """Largest |p1 - p2|."""
        return float(np.max(np.abs(self.p1_mpa - self.p2_mpa)))


def prepare(record: Record, model: Model, options: RecordOptions | None = None) -> Prepared:
    """`record` ready to be fitted by, or compared with, `model`; RecordError in one line when it cannot be."""
    allowed = options or RecordOptions()
    record = cut(record, allowed)
    if model.muscle.kind != EXTERNAL:  # one of another kind is told what stands in the records
        common([("the model", model.own_channels), (record.name, record.channels)])
    if not allowed.trust_units:
        _check_clock(record)
    _check_times(record, model.sample_time_s, allowed.resample)
    _check_columns(record, model.muscle.input)
    if not allowed.trust_units:
        _check_units(record)
    _check_excitation(record, model.muscle.input)
    warnings = _missing(record) + mix_ups(record)
    repeated = repeated_packets(record)
    if np.mean(repeated) > LEAST_REPEATS:
        warnings.append(
            f"{record.name}: {counted(int(repeated.sum()), 'row repeats', 'rows repeat')} the packet before; the "
            "measurements there were interpolated"
        )
        record = _without(record, repeated)
    regular = is_regular(record, model.sample_time_s)
    grid = on_grid(record, model.sample_time_s)
    if not regular:
        rate = f"sampled every {record.period_s * 1e3:.3g} ms, irregular or with rows missing"
        warnings.append(f"{record.name}: {rate}; resampled to {model.sample_time_s * 1e3:g} ms")
    p1, p2 = driving_pressures(grid, model.muscle.input, model.p0_mpa)
    angle = grid.angle_deg if grid.angle_deg is not None else np.zeros(len(grid))
    skip = round(allowed.skip_s / model.sample_time_s)
    if skip >= len(grid) - 2:
        raise RecordError(
            f"{record.name}: nothing is left of its {grid.t_s[-1] - grid.t_s[0]:.3g} s after the first "
            f"{allowed.skip_s:g} s"
        )
    return Prepared(record, grid, p1, p2, angle, skip, warnings)


def doubts(data: Sequence[Prepared]) -> list[str]:
    """What is doubtful in each of these records, and in all of them together."""
    records = [each.record for each in data]
    early = before_command(records)
    found = [text for each in data for text in each.warnings]
    return [*([f"{subject_of(records)}: {early}"] if early else []), *found]


def best_input(records: Sequence[Record], options: RecordOptions) -> tuple[Input, str]:
    """What can drive the muscles: the measured pressures where every record has them, else the command; and why, in one
    line."""
    try:
        for record in records:
            shown = cut(record, options)
            _check_columns(shown, Input.PRESSURE)
            _check_excitation(shown, Input.PRESSURE)
    except RecordError as error:
        reason = str(error).removesuffix("; use --input command")
        return Input.COMMAND, f"driven by the command, not by measured pressures: {reason}"
    return (
        Input.PRESSURE,
        "driven by the measured pressures, which every record has; --input command takes the set-points",
    )


def cut(record: Record, options: RecordOptions) -> Record:
    """The part of the record that may be looked at."""
    return record if options.until_s is None else record.rows(record.t_s - record.t_s[0] <= options.until_s)


def check_length(record: Record) -> None:
    """RecordError for a record too short for anything to be asked of it."""
    length = float(record.t_s[-1] - record.t_s[0]) if len(record) else 0.0
    if len(record) < 3 or length < SHORTEST_LOOP_S:
        raise RecordError(
            f"{record.name}: too short, {counted(len(record), 'row')} in {length:.3g} s; "
            f"needed: at least {SHORTEST_LOOP_S:g} s"
        )


def _check_times(record: Record, dt_s: float, resample: bool) -> None:
    name = record.name
    check_length(record)
    steps = np.diff(record.t_s)
    if not np.all(np.isfinite(record.t_s)) or np.any(steps <= 0):
        where = int(np.argmin(np.where(np.isfinite(steps), steps, -1.0)))
        raise RecordError(f"{name}: time does not rise after {record.t_s[where]:g} s")
    if abs(record.period_s / dt_s - 1.0) > SAME_PERIOD and not resample:
        own = f"{record.period_s * 1e3:.4g} ms"
        raise RecordError(
            f"{name}: sampled every {own}, the model works at {dt_s * 1e3:g} ms; "
            "--resample puts it onto the model's clock, --sample-time identifies at another one"
        )
    widest = int(np.argmax(steps))
    if steps[widest] > LARGEST_GAP * max(dt_s, record.period_s):
        raise RecordError(f"{name}: a gap of {steps[widest]:.3g} s at {record.t_s[widest]:.3f} s; cut the record there")


def _check_columns(record: Record, drive: Input) -> None:
    if record.angle_deg is None:
        raise RecordError(f"{record.name}: it has no angle; needed: a column angle_deg with numbers")
    if drive is Input.PRESSURE and not record.has_pressures:
        raise RecordError(f"{record.name}: {_unmeasured(record.unmeasured)}; use --input command")
    if drive is Input.PRESSURE and (dead := dead_monitor(record)):
        raise RecordError(f"{record.name}: {dead} (a broken wire?); use --input command")
    if drive is Input.COMMAND:
        for name, known in commanded(record).items():
            if np.isnan(known).any():
                first = float(record.t_s[int(np.argmax(np.isnan(known)))])
                raise RecordError(
                    f"{record.name}: {name} is not a number at {first:.3f} s; a command is known or there is none"
                )
    for column in _measured(drive):
        values = getattr(record, column)
        share = float(np.mean(~np.isfinite(values)))
        if share > MOST_MISSING:
            raise RecordError(f"{record.name}: {share:.0%} of {column} is missing; allowed: {MOST_MISSING:.0%}")


def _unmeasured(lacking: list[str]) -> str:
    return f"{lacking[0]} was not measured" if len(lacking) == 1 else "the pressures were not measured"


def commands_known(record: Record) -> bool:
    """Whether the set-points are known in every row."""
    return not any(np.isnan(column).any() for column in commanded(record).values())


def strange_units(record: Record) -> str | None:
    """What no rig of this kind can show, and the unit it may be in: pressures beyond any regulator, angles beyond any
    potentiometer. A channel map has its own range, which the import looks at."""
    if not record.channels.has_valves:
        return None
    for name in ("dp_cmd_mpa", "p1_mpa", "p2_mpa"):
        largest = _largest(getattr(record, name))
        if largest > MOST_PRESSURE_MPA:
            unit = unit_by_size(largest, PRESSURE_SIZES)
            unit = "kPa or psi" if unit == "kPa" else unit
            return (
                f"{name} reaches {largest:.4g}, more than any regulator gives ({MOST_PRESSURE_MPA:g} MPa); is "
                f"it in {unit}?"
            )
    if (largest := _largest(record.angle_deg)) > TEN_TURNS_DEG:
        return (
            f"angle_deg reaches {largest:.4g}, more than any potentiometer shows ({TEN_TURNS_DEG:g} deg); is "
            "it in counts?"
        )
    return None


def _largest(column: Column | None) -> float:
    known = np.empty(0) if column is None else column[np.isfinite(column)]
    return float(np.max(np.abs(known), initial=0.0))


def _check_clock(record: Record) -> None:
    if strange := strange_clock(record):
        raise RecordError(
            f"{record.name}: {strange} `pamrig log import` converts units, --trust-units takes it as it stands"
        )


def _check_units(record: Record) -> None:
    """Numbers that no rig of this kind can show are in another unit."""
    if strange := strange_units(record):
        raise RecordError(
            f"{record.name}: {strange} `pamrig log import` converts units, --trust-units takes it as it stands"
        )
    angle = record.angle_deg
    if (
        angle is not None
        and record.channels.has_valves
        and np.ptp(record.dp_cmd_mpa) >= RADIANS_MOVED_MPA
        and LEAST_OUTPUT_DEG < np.nanmax(np.abs(angle)) <= RADIANS
    ):
        raise RecordError(
            f"{record.name}: angle_deg stays within {np.nanmax(np.abs(angle)):.3g} while the pressure moves by "
            f"{np.ptp(record.dp_cmd_mpa):.2g} MPa; is it in radians? `pamrig log import` converts, --trust-units "
            "takes it as it stands"
        )


def _check_excitation(record: Record, drive: Input) -> None:
    moved = record.dp_cmd_mpa if drive is Input.COMMAND else record.dp_mpa
    if not np.ptp(moved[np.isfinite(moved)]) >= LEAST_INPUT_MPA:
        raise RecordError(
            f"{record.name}: the {drive.value} is constant; needed: it moves by {LEAST_INPUT_MPA:g} MPa and more"
        )
    if record.angle_deg is not None and not np.ptp(record.angle_deg[np.isfinite(record.angle_deg)]) >= LEAST_OUTPUT_DEG:
        raise RecordError(
            f"{record.name}: the angle is constant; needed: it moves by {LEAST_OUTPUT_DEG:g} deg and more"
        )


def _missing(record: Record) -> list[str]:
    """A warning for each measured column in which values are missing."""
    found = []
    for name in ("angle_deg", "p1_mpa", "p2_mpa"):
        column = getattr(record, name)
        missing = 0 if column is None else int(np.sum(~np.isfinite(column)))
        if missing:
            values = counted(missing, f"value of {name} is missing and was", f"values of {name} are missing and were")
            found.append(f"{record.name}: {values} interpolated")
    return found


def repeated_packets(record: Record) -> NDArray[np.bool_]:
    """Rows in which a logger stored the previous packet again, shape (n,): both pressures and the angle are exactly the
    same.

    One column alone may stand still on a step of its converter; all three only when nothing moves, and then a repeat
    does no harm.
    """
    columns = [record.p1_mpa, record.p2_mpa, record.angle_deg]
    if any(column is None for column in columns):
        return np.zeros(len(record), dtype=bool)
    same = np.all([np.diff(column, prepend=np.nan) == 0.0 for column in columns if column is not None], axis=0)
    return np.asarray(same & (np.diff(record.dp_cmd_mpa, prepend=np.nan) != 0.0))


def _without(record: Record, rows: NDArray[np.bool_]) -> Record:
    """The record with those rows' measurements missing; their commands stay."""
    measured: dict[str, Any] = {}
    for name in MEASURED_COLUMNS:
        if (column := getattr(record, name)) is not None:
            measured[name] = np.where(rows, np.nan, column)
    return replace(record, **measured)


def _measured(drive: Input) -> tuple[str, ...]:
    return ("angle_deg", "p1_mpa", "p2_mpa") if drive is Input.PRESSURE else ("angle_deg",)
