"""Import by a mapping: a YAML file that says which column of a foreign table is which of ours, and in which unit.

Nothing is guessed: a column without a stated unit, or a name that fits two columns, is refused.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rig.config import read_yaml, structure, suggest
from rig.errors import ConfigError, RecordError
from rig.fields import bounded
from rig.log.foreign.delimited import Style, read_table
from rig.log.foreign.kinds import Kind, kind_of
from rig.log.foreign.mcap_channels import read_foreign
from rig.log.foreign.tables import RawColumn, RawTable, read_tdms
from rig.log.foreign.units import conversion, unit_in_name
from rig.log.mcap.columns import Array
from rig.record import MAIN_COLUMNS

COLUMN_NAMES = (*MAIN_COLUMNS, "p1_raw", "p2_raw", "angle_raw", "excitation_raw")
"""What a mapping may fill."""


@dataclass(frozen=True)
class Source:
    """Where one of our columns comes from: value = (source * scale + offset), which is then in `unit`."""

    source: str
    unit: str = ""
    """Of the scaled value; may be left out where the file states it, and for raw columns."""
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Mapping:
    """The whole YAML file."""

    columns: dict[str, Source]
    separator: str = ","
    decimal: str = "."
    skip_rows: int = bounded(0, 10_000, default=0)
    """CSV: lines before the header."""
    topic: str = ""
    """MCAP of another program: the channel to read."""
    period_s: float = bounded(0.0, 60.0, "s", default=0.0)
    """For a table without a time column: the time between rows."""
    facts: dict[str, Any] = field(default_factory=dict)
    """What is known of the run: session, p0_mpa, signal, ..."""


def load_mapping(path: Path) -> Mapping:
    """The mapping at `path`; ConfigError when it does not fit."""
    raw = read_yaml(path)
    if not isinstance(raw, dict) or not isinstance(raw.get("columns"), dict):
        raise ConfigError(f"{path}: expected `columns:`, a mapping of our columns to their sources")
    mapping = structure(raw, Mapping, str(path))
    unknown = next((name for name in mapping.columns if name not in COLUMN_NAMES), None)
    if unknown is not None:
        raise ConfigError(f"{path}: columns: unknown column {unknown!r}; {suggest(unknown, list(COLUMN_NAMES))}")
    if ("t_s" in mapping.columns) == bool(mapping.period_s):
        raise ConfigError(f"{path}: give either the column t_s or period_s, one of the two")
    if len(mapping.separator) != 1 or mapping.decimal not in (".", ",") or mapping.separator == mapping.decimal:
        raise ConfigError(f"{path}: separator must be one character and decimal '.' or ',', and they must differ")
    return mapping


def read_mapped(path: Path, mapping: Mapping) -> tuple[dict[str, Array], dict[str, Any]]:
    """Our columns and the facts of the file at `path`; RecordError when the mapping does not fit it."""
    raw = _raw_table(path, mapping)
    columns = {name: _column(raw, name, source) for name, source in mapping.columns.items()}
    if mapping.period_s:
        columns["t_s"] = mapping.period_s * np.arange(len(next(iter(columns.values()))))
    return columns, dict(raw.facts) | mapping.facts


def _raw_table(path: Path, mapping: Mapping) -> RawTable:
    match kind_of(path):
        case Kind.TDMS:
            return read_tdms(path)
        case Kind.MCAP:
            return read_foreign(path, mapping.topic)
    table = read_table(path, Style(mapping.separator, mapping.decimal, mapping.skip_rows))
    return RawTable(path, {name: RawColumn(values) for name, values in table.items()})


def _column(raw: RawTable, name: str, source: Source) -> Array:
    key = _find(raw, source.source)
    column, where = raw.columns[key], f"{raw.path}: {key}"
    values = column.values * source.scale + source.offset
    if unit_in_name(name) is None:
        return values
    if source.unit and column.unit and source.unit != column.unit and (source.scale, source.offset) == (1.0, 0.0):
        raise RecordError(f"{where}: the mapping says {source.unit!r} and the file {column.unit!r}")
    unit = source.unit or column.unit or unit_in_name(key)
    if unit is None:
        raise RecordError(f"{where}: no unit is stated for {name}, neither by the file nor by the mapping (`unit:`)")
    times, by = conversion(name, unit, where)[1:]
    return values * times / by


def _find(raw: RawTable, wanted: str) -> str:
    """The one column of that name, the group left out or not."""
    if wanted in raw.columns:
        return wanted
    found = [key for key in raw.columns if key.rpartition("/")[2] == wanted]
    if len(found) == 1:
        return found[0]
    if found:
        raise RecordError(f"{raw.path}: {wanted!r} is ambiguous: {', '.join(found)}")
    raise RecordError(f"{raw.path}: no column {wanted!r}; {suggest(wanted, list(raw.columns))}")
