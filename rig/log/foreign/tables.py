"""Foreign tables (LabVIEW's TDMS, channels of other programs' MCAP, CSV) as named columns with the units they state.

Only what is there; which column means what is decided in rig.log.foreign.mapping, or here when the names are ours.
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rig.errors import RecordError
from rig.log.foreign.units import conversion, unit_in_name
from rig.log.mcap.columns import Array
from rig.log.mcap.contents import map_file
from rig.record import MAIN_COLUMNS

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsFile

_UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription", "Unit", "unit")
"""Where LabVIEW and DIAdem write a channel's unit."""
TIME_NAME = "t_s"
TDMS_MAGIC: Final = b"TDSm"
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


def read_tdms(path: Path) -> RawTable:
    """The numeric channels of a TDMS file as group/channel; waveforms without a time channel get one named t_s.

    RecordError when the file is broken, or its channels differ in length or rate.
    """
    try:
        from nptdms import TdmsFile
    except ImportError:
        raise RecordError(f"{path}: reading TDMS needs the package npTDMS: pip install 'pamrig[tables]'") from None
    _require_whole_tdms(path)
    try:
        with TdmsFile.open(path) as file:
            _require_possible(path, file)
            channels = [
                channel for group in file.groups() for channel in group.channels() if channel.dtype.kind in "iuf"
            ]
            columns = {f"{c.group_name}/{c.name}": RawColumn(c[:].astype(np.float64), _unit(c)) for c in channels}
            time = _waveform_time(path, channels)
            facts = {"tdms": {str(key): _plain(value) for key, value in file.properties.items()}}
    except RecordError:
        raise
    except Exception as error:  # noqa: BLE001 - npTDMS raises whatever its parser stumbles over
        raise RecordError(f"{path}: not a whole TDMS file ({type(error).__name__})") from None
    if not columns:
        raise RecordError(f"{path}: holds no channel of numbers")
    if time is not None and not any(key.rpartition("/")[2] in (TIME_NAME, "t") for key in columns):
        columns[TIME_NAME] = RawColumn(time, "s")
    return RawTable(path, columns, facts)


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
    lengths = {
        f"{c.group_name}/{c.name}": len(c) for group in file.groups() for c in group.channels() if c.dtype.kind in "iuf"
    }
    sizes = sum(len(c) * c.dtype.itemsize for group in file.groups() for c in group.channels())
    if sizes > path.stat().st_size:
        raise RecordError(f"{path}: its channels claim {sizes} bytes, more than the file has")
    if len(set(lengths.values())) > 1:
        raise RecordError(
            f"{path}: channels of different length: {', '.join(f'{name} {count}' for name, count in lengths.items())}"
        )


def _waveform_time(path: Path, channels: "list[TdmsChannel]") -> Array | None:
    """Seconds by the waveform properties of LabVIEW; None when no channel has them."""
    grids = {
        (c.properties.get("wf_start_offset", 0.0), c.properties["wf_increment"])
        for c in channels
        if "wf_increment" in c.properties
    }
    if len(grids) > 1:
        raise RecordError(f"{path}: channels of different rate: {', '.join(f'{step} s' for _, step in sorted(grids))}")
    if not grids:
        return None
    offset, step = grids.pop()
    return float(offset) + float(step) * np.arange(len(channels[0]))


def _unit(channel: "TdmsChannel") -> str | None:
    stated = (str(channel.properties[key]).strip() for key in _UNIT_PROPERTIES if key in channel.properties)
    return next((unit for unit in stated if unit), None)


def _plain(value: Any) -> Any:
    """A TDMS property as JSON can hold it."""
    if isinstance(value, str | bool | int | float):
        return value
    return value.tolist() if isinstance(value, np.generic) and value.dtype.kind in "iufb" else str(value)
