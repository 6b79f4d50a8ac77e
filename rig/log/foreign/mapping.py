"""Import by a mapping: a YAML file that says which column of a foreign table is which of ours, and in which unit.

Nothing is guessed: a column without a stated unit, or a name that fits two columns, is refused. A rig that is driven by
something else than a pressure, or answers with something else than an angle, has a channel map under `channels`.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rig.channels import BEYOND, FACT, PNEUMATIC, Channel, Channels, check_channels
from rig.config import read_yaml, structure, suggest
from rig.errors import ConfigError, RecordError
from rig.fields import bounded
from rig.further_channels import FACT as FURTHER_FACT
from rig.further_channels import Further, check_new, plain
from rig.log.foreign.delimited import Style, read_lines, text_table
from rig.log.foreign.kinds import FileKind, kind_of
from rig.log.foreign.mcap_channels import TIME_COLUMN, read_foreign
from rig.log.foreign.tables import RawTable, raw_delimited, read_tdms
from rig.log.foreign.units import conversion, converted, unit_in_name
from rig.log.mcap.columns import Array
from rig.log.mcap.schema import unsound
from rig.record import MAIN_COLUMNS
from rig.sample import WIRES

COLUMN_NAMES = (*MAIN_COLUMNS, "p1_raw", "p2_raw", "angle_raw", "excitation_raw")
"""What a mapping may fill."""
INPUT, OUTPUT = "input", "output"
"""The columns of a rig with a channel map."""
MOST_REST_MPA = 1.0
"""P0 above which a number is in another unit: regulators of such rigs end at 0.5 to 0.9 MPa."""
_PNEUMATIC_ONLY = frozenset(MAIN_COLUMNS) - {"t_s"}


@dataclass(frozen=True)
class ColumnSource:
    """Where one of our columns comes from: value = (source * scale + offset), which is then in `unit`."""

    source: str
    unit: str = ""
    """Of the scaled value; may be left out where the file states it, and for raw columns."""
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class FurtherSource(ColumnSource):
    """Where a further channel comes from; its unit is kept as it is stated."""

    same_within: float = bounded(0.0, 1e12, default=0.0)
    """See rig.further_channels.Further."""


@dataclass(frozen=True)
class Mapping:
    """The whole YAML file."""

    columns: dict[str, ColumnSource]
    channels: Channels | None = None
    """Input and output of a rig that is not driven by pressures."""
    further: dict[str, FurtherSource] = field(default_factory=dict)
    """Further channels: column name -> where it comes from."""
    separator: str = ","
    decimal: str = "."
    skip_rows: int = bounded(0, 10_000, default=0)
    """CSV: lines before the header."""
    units_row: bool = False
    """CSV: the line below the header says the units."""
    topic: str = ""
    """MCAP of another program: the channel to read."""
    period_s: float = bounded(0.0, 60.0, "s", default=0.0)
    """For a table without a time column: the time between rows."""
    facts: dict[str, Any] = field(default_factory=dict)
    """What is known of the run: session, p0_mpa, signal, ..."""


def load_mapping(path: Path) -> Mapping:
    """The mapping at `path`; ConfigError when it does not fit."""
    return mapping_of(read_yaml(path), path)


def mapping_of(raw: object, path: Path) -> Mapping:
    """The mapping that plain data from `path` say; ConfigError when they say none."""
    if not isinstance(raw, dict) or not isinstance(raw.get("columns"), dict) or not raw["columns"]:
        raise ConfigError(f"{path}: expected `columns:`, a mapping of our columns to their sources")
    _check_commas(raw.get("facts"), path)
    mapping = structure(raw, Mapping, str(path))
    _check_names(mapping, path)
    _check_facts(mapping.facts, path)
    if ("t_s" in mapping.columns) == bool(mapping.period_s):
        raise ConfigError(f"{path}: give either the column t_s or period_s, one of the two")
    if len(mapping.separator) != 1 or mapping.decimal not in (".", ",") or mapping.separator == mapping.decimal:
        raise ConfigError(f"{path}: separator must be one character and decimal '.' or ',', and they must differ")
    return mapping


def _check_names(mapping: Mapping, path: Path) -> None:
    """ConfigError for a column that there is not, and for a channel map without its input or its output."""
    allowed: tuple[str, ...] = COLUMN_NAMES
    if mapping.channels is not None:
        check_channels(mapping.channels, f"{path}: channels")
        allowed = (INPUT, OUTPUT, *(name for name in COLUMN_NAMES if name not in _PNEUMATIC_ONLY))
        lacking = next((name for name in (INPUT, OUTPUT) if name not in mapping.columns), None)
        if lacking is not None:
            raise ConfigError(f"{path}: columns: {lacking!r} is missing; a rig with `channels` needs input and output")
    unknown = next((name for name in mapping.columns if name not in allowed), None)
    if unknown is not None:
        raise ConfigError(f"{path}: columns: unknown column {unknown!r}; {suggest(unknown, list(allowed))}")
    check_new(_furthers(mapping), f"{path}: further", mapping.channels or PNEUMATIC, WIRES)


def _check_commas(facts: object, path: Path) -> None:
    """ConfigError for {p0_mpa: 0,15}, which YAML reads as p0_mpa: 0 and a fact that is called 15."""
    named = facts if isinstance(facts, dict) else {}
    wrong = next((name for name, value in named.items() if value is None and isinstance(name, (int, float))), None)
    if wrong is not None:
        raise ConfigError(f"{path}: facts: {wrong!r} is no name of a fact; is it behind a comma for a decimal point?")


def _check_facts(facts: dict[str, Any], path: Path) -> None:
    """ConfigError for a fact that others count on and that is of another kind; a reader would take it for not said."""
    name, allowed = next(iter(unsound(facts).items()), (None, ""))
    if name is not None:
        raise ConfigError(f"{path}: facts: {name} is {facts[name]!r}; allowed: {allowed}")
    rest = facts.get("p0_mpa", 0.0)
    if not 0.0 <= rest <= MOST_REST_MPA:
        raise ConfigError(
            f"{path}: facts: p0_mpa is {rest:g}; allowed: 0 to {MOST_REST_MPA:g} MPa (is it in bar, or in kPa?)"
        )


def _furthers(mapping: Mapping) -> tuple[Further, ...]:
    return tuple(Further(name, one.unit or "1", one.same_within) for name, one in mapping.further.items())


def left_out(raw: RawTable, mapping: Mapping) -> list[str]:
    """The columns of a table that its mapping has no use for, in their order; the time of an MCAP file's messages is
    none of them."""
    used = {_find(raw, source.source) for source in (*mapping.columns.values(), *mapping.further.values())}
    return [name for name in raw.columns if name not in used and name != TIME_COLUMN]


def mapped(raw: RawTable, mapping: Mapping) -> tuple[dict[str, Array], dict[str, Any]]:
    """Our columns and the facts of a table; RecordError when the mapping does not fit it."""
    own = {name: source for name, source in mapping.columns.items() if name in (INPUT, OUTPUT)}
    columns = {name: _column(raw, name, source) for name, source in mapping.columns.items() if name not in own}
    columns |= {name: _scaled(raw, source)[0] for name, source in mapping.further.items()}
    if mapping.channels is not None:
        columns["dp_cmd_mpa"] = mapping.channels.working_input(_own(raw, own[INPUT], mapping.channels.input))
        columns["angle_deg"] = mapping.channels.working_output(_own(raw, own[OUTPUT], mapping.channels.output))
    if mapping.period_s:
        columns["t_s"] = mapping.period_s * np.arange(len(next(iter(columns.values()))))
    return columns, dict(raw.facts) | mapping.facts | _own_facts(mapping)


def _own_facts(mapping: Mapping) -> dict[str, Any]:
    """The channel map and the further channels, as the record's facts hold them."""
    channels = {} if mapping.channels is None else {FACT: mapping.channels.plain()}
    return channels | ({FURTHER_FACT: plain(_furthers(mapping))} if mapping.further else {})


def _own(raw: RawTable, source: ColumnSource, channel: Channel) -> Array:
    """A channel's values in its unit; RecordError when they lie so far out that they must be in another."""
    values, where, stated = _scaled(raw, source)
    values = converted(values, stated or channel.unit, channel.unit, where)
    known = values[np.isfinite(values)]
    farthest = float(known[np.argmax(np.abs(known - channel.middle))]) if len(known) else channel.middle
    if abs(farthest - channel.middle) > BEYOND * channel.half:
        low, high = channel.range
        raise RecordError(
            f"{where}: {channel.name} reaches {farthest:.4g} {channel.unit}, its range is {low:g} to {high:g}; "
            "is it in another unit (`unit:`), or the range too small?"
        )
    return values


def raw_table(path: Path, mapping: Mapping) -> RawTable:
    """The file at `path` by its own names; RecordError when it is none that the mapping can be of."""
    match kind_of(path):
        case FileKind.TDMS:
            return read_tdms(path)
        case FileKind.MCAP:
            return read_foreign(path, mapping.topic)
    sources = {one.source for one in (*mapping.columns.values(), *mapping.further.values())}
    style = Style(mapping.separator, mapping.decimal, mapping.skip_rows, mapping.units_row)
    return raw_delimited(text_table(path, read_lines(path), style), wanted=sources)


def _column(raw: RawTable, name: str, source: ColumnSource) -> Array:
    values, where, stated = _scaled(raw, source)
    if unit_in_name(name) is None:
        return values
    unit = stated or unit_in_name(_find(raw, source.source))
    if unit is None:
        raise RecordError(f"{where}: no unit is stated for {name}, neither by the file nor by the mapping (`unit:`)")
    times, by = conversion(name, unit, where)[1:]
    return values * times / by


def _scaled(raw: RawTable, source: ColumnSource) -> tuple[Array, str, str | None]:
    """The source's values by its scale and offset, its place for messages, and the unit that mapping or file state."""
    key = _find(raw, source.source)
    column, where = raw.columns[key], f"{raw.path}: {key}"
    if source.unit and column.unit and source.unit != column.unit and (source.scale, source.offset) == (1.0, 0.0):
        raise RecordError(f"{where}: the mapping says {source.unit!r} and the file {column.unit!r}")
    return column.values * source.scale + source.offset, where, source.unit or column.unit


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
