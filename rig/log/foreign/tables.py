"""Foreign tables (LabVIEW's TDMS, channels of other programs' MCAP, CSV) as named columns with the units they state.

Only what is there; which column means what is decided in rig.log.foreign.mapping, or here when the names are ours.
"""

import struct
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from rig.errors import RecordError
from rig.log.foreign.delimited import TextTable
from rig.log.foreign.units import conversion, spelt, unit_in_name
from rig.log.mcap.columns import Array
from rig.log.mcap.contents import map_file
from rig.record import MAIN_COLUMNS

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsFile

_UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription", "Unit", "unit")
"""Where LabVIEW and DIAdem write a channel's unit."""
TIME_NAME = "t_s"
TDMS_MAGIC: Final = b"TDSm"
_SAME_START: Final = 0.2
"""Share of a period by which channels may start apart and still count as read at once."""
_LEAD_IN = struct.Struct("<4sIIQQ")
"""Tag, contents, version, distance to the next segment, distance to the raw data (NI's "TDMS File Format Internal
Structure")."""


@dataclass(frozen=True)
class RawColumn:
    """Values as they stand in the file, shape (n,), and the unit that the file states for them, or None."""

    values: Array
    unit: str | None = None


@dataclass(frozen=True)
class RawTable:
    """Columns of equal length by their own names."""

    path: Path
    columns: Mapping[str, RawColumn]
    facts: Mapping[str, Any] = field(default_factory=dict)


def own_columns(raw: RawTable) -> dict[str, Array]:
    """The columns whose names are ours (p1_mpa), or ours without the unit (p1) where the file states one; converted.

    RecordError when name and stated unit contradict each other, or one quantity stands twice.
    """
    return {name: _converted(raw, key, name) for name, key in _own_keys(raw).items()}


def foreign_columns(raw: RawTable) -> list[str]:
    """The columns that `own_columns` has no use for, in their order."""
    used = set(_own_keys(raw).values())
    return [key for key in raw.columns if key not in used]


def _own_keys(raw: RawTable) -> dict[str, str]:
    """Our name -> that of the file."""
    out: dict[str, str] = {}
    for name in MAIN_COLUMNS:
        short = name.rpartition("_")[0]
        allowed = {key: (name, short) if column.unit else (name,) for key, column in raw.columns.items()}
        found = [key for key, names in allowed.items() if key.rpartition("/")[2] in names]
        if len(found) > 1:
            raise RecordError(
                f"{raw.path}: {name} is ambiguous: {' and '.join(found)}; `pamrig log import` takes a mapping"
            )
        if found:
            out[name] = found[0]
    return out


def _converted(raw: RawTable, key: str, name: str) -> Array:
    column, ours = raw.columns[key], unit_in_name(name)
    if column.unit is None or column.unit == ours:
        return column.values
    if key.rpartition("/")[2] == name:
        raise RecordError(
            f"{raw.path}: {key} is named in {ours} and its unit property says {column.unit!r}; a mapping must say which"
        )
    times, by = conversion(name, column.unit, f"{raw.path}: {key}")[1:]
    return column.values * times / by


def raw_delimited(text: TextTable, wanted: Collection[str]) -> RawTable:
    """A text table, of which the columns `wanted` are numbers, or time stamps in seconds since their first. What the
    first of one column says is the fact `first_time`, and `started_ns` where it says its zone.

    RecordError as for `TextTable.columns`.
    """
    table = text.columns(wanted)
    stamps = {name: found for name, found in text.first_stamps().items() if name in wanted}
    units = {name: spelt(unit) for name, unit in text.units().items()} | dict.fromkeys(stamps, "s")
    facts: dict[str, Any] = {}
    if len(stamps) == 1:
        (first,) = stamps.values()
        facts = {"first_time": first.text} | ({"started_ns": first.ns} if first.dated and first.zoned else {})
    return RawTable(text.path, {name: RawColumn(values, units.get(name)) for name, values in table.items()}, facts)


def read_tdms(path: Path) -> RawTable:
    """The numeric channels of a TDMS file as group/channel, and those of time stamps in seconds since their first;
    waveforms without a time channel get one named t_s. When the first row was measured is the fact `started_ns`, where
    the file says it.

    RecordError when the file is broken, or its channels differ in length, rate or start.
    """
    try:
        from nptdms import TdmsFile
    except ImportError:
        raise RecordError(f"{path}: reading TDMS needs the package npTDMS: pip install 'pamrig[tables]'") from None
    _require_whole_tdms(path)
    try:
        with TdmsFile.open(path) as file:
            _require_possible(path, file)
            channels = _of_kind(file, "iuf")
            columns = {_name(c): RawColumn(c[:].astype(np.float64), _unit(c)) for c in channels}
            grid = _waveform_grid(path, channels)
            stamps = {_name(c): c[:] for c in _of_kind(file, "M") if channels and 0 < len(c) == len(channels[0])}
            facts: dict[str, Any] = {"tdms": {str(key): _plain(value) for key, value in file.properties.items()}}
    except RecordError:
        raise
    except Exception as error:  # noqa: BLE001 - npTDMS raises whatever its parser stumbles over
        raise RecordError(f"{path}: not a whole TDMS file ({type(error).__name__})") from None
    if not columns:
        raise RecordError(f"{path}: holds no channel of numbers")
    columns |= {name: RawColumn((times - times[0]) / np.timedelta64(1, "s"), "s") for name, times in stamps.items()}
    if grid is not None and not any(key.rpartition("/")[2] in (TIME_NAME, "t") for key in columns):
        columns[TIME_NAME] = RawColumn(grid.offset_s + grid.step_s * np.arange(len(channels[0])), "s")
    starts = {_unix_ns(times[0]) for times in stamps.values()}
    if grid is not None and grid.start is not None:
        starts = {grid.first_ns}
    if len(starts) == 1 and (start_ns := starts.pop()) > 0:  # where nobody set the clock, LabVIEW writes 1904
        facts["started_ns"] = start_ns
    return RawTable(path, columns, facts)


def _of_kind(file: "TdmsFile", kinds: str) -> "list[TdmsChannel]":
    """The channels whose numpy type is of one of these kinds, in the order of the file."""
    return [channel for group in file.groups() for channel in group.channels() if channel.dtype.kind in kinds]


def _name(channel: "TdmsChannel") -> str:
    return f"{channel.group_name}/{channel.name}"


def _require_whole_tdms(path: Path) -> None:
    """RecordError when the segments do not end with the file: npTDMS would leave out what is cut without a word."""
    data, start = map_file(path), 0
    while start < len(data):
        if len(data) - start < _LEAD_IN.size or bytes(data[start : start + 4]) != TDMS_MAGIC:
            raise RecordError(
                f"{path}: byte {start}: no TDMS segment begins where one should; the file is cut or damaged"
            )
        length = _LEAD_IN.unpack_from(data, start)[3]
        if length > len(data) - start - _LEAD_IN.size:
            raise RecordError(f"{path}: byte {start}: the last TDMS segment is cut")
        start += _LEAD_IN.size + length


def _require_possible(path: Path, file: "TdmsFile") -> None:
    """RecordError when the channels claim more bytes than the file has, or are of different length."""
    lengths = {_name(channel): len(channel) for channel in _of_kind(file, "iuf")}
    sizes = sum(len(c) * c.dtype.itemsize for group in file.groups() for c in group.channels())
    if sizes > path.stat().st_size:
        raise RecordError(f"{path}: its channels claim {sizes} bytes, more than the file has")
    if len(set(lengths.values())) > 1:
        raise RecordError(
            f"{path}: channels of different length: {', '.join(f'{name} {count}' for name, count in lengths.items())}"
        )


class _Grid(NamedTuple):
    """When the rows of LabVIEW's waveforms were measured."""

    start: np.datetime64 | None
    offset_s: float
    """Of the first row behind the start."""
    step_s: float

    @property
    def first_ns(self) -> int:
        """Of the first row, since the Unix epoch; 0 where no start is said."""
        return 0 if self.start is None else _unix_ns(self.start) + round(self.offset_s * 1e9)


def _waveform_grid(path: Path, channels: "list[TdmsChannel]") -> _Grid | None:
    """The one grid that the waveform properties of all channels say; None when no channel has them."""
    grids = {_name(c): _grid(c) for c in channels if "wf_increment" in c.properties}
    if not grids:
        return None
    first = next(iter(grids.values()))
    if any(grid.step_s != first.step_s for grid in grids.values()):
        steps = sorted({grid.step_s for grid in grids.values()})
        raise RecordError(f"{path}: channels of different rate: {', '.join(f'{step:g} s' for step in steps)}")
    late = {name: _late_s(grid, first) for name, grid in grids.items()}
    farthest = max(late, key=lambda name: abs(late[name]))
    if abs(late[farthest]) > _SAME_START * abs(first.step_s):
        raise RecordError(
            f"{path}: channels of different start: {farthest} begins {late[farthest]:g} s after {next(iter(grids))}"
        )
    return first


def _late_s(grid: _Grid, other: _Grid) -> float:
    """By how much later a grid begins than another, as far as both say it."""
    known = grid.start is not None and other.start is not None
    return 1e-9 * (grid.first_ns - other.first_ns) if known else grid.offset_s - other.offset_s


def _grid(channel: "TdmsChannel") -> _Grid:
    start = channel.properties.get("wf_start_time")
    return _Grid(
        start if isinstance(start, np.datetime64) else None,
        float(channel.properties.get("wf_start_offset", 0.0)),
        float(channel.properties["wf_increment"]),
    )


def _unix_ns(time: np.datetime64) -> int:
    return int(time.astype("datetime64[us]").astype(np.int64)) * 1000


def _unit(channel: "TdmsChannel") -> str | None:
    stated = (str(channel.properties[key]).strip() for key in _UNIT_PROPERTIES if key in channel.properties)
    return next((spelt(unit) for unit in stated if unit), None)


def _plain(value: Any) -> Any:
    """A TDMS property as JSON can hold it."""
    if isinstance(value, str | bool | int | float):
        return value
    return value.tolist() if isinstance(value, np.generic) and value.dtype.kind in "iufb" else str(value)
