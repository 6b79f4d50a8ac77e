"""A waveform from a CSV file: whatever another tool made, or a log recorded before."""

import csv
import math
from array import array
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

from rig.config import check_regular
from rig.errors import ConfigError
from rig.fields import bounded

MOST_TABLE_BYTES = 512 * 1024 * 1024
"""A day of rows at 5 ms, written with every digit."""


@dataclass(frozen=True)
class Waveform:
    """dp from a CSV file with the columns t_s and dp_mpa (or dp_cmd_mpa, as logs have it), straight lines between its
    rows.

    Before the first and after the last row it holds their value. A relative `file` counts from the sweep's YAML.
    """

    file: Path
    scale: float = bounded(-100.0, 100.0, default=1.0)
    COLUMNS: ClassVar[tuple[str, ...]] = ("dp_mpa", "dp_cmd_mpa")

    @property
    def highest_hz(self) -> float:
        return 0.0

    @property
    def label(self) -> str:
        return f"waveform_{self.file.stem}" + (f"_x{self.scale:g}" if self.scale != 1.0 else "")

    @cached_property
    def rows(self) -> "tuple[array[float], array[float]]":
        """Times (s) and values (MPa), one entry a row; ConfigError when the file is not such a table."""
        try:
            check_regular(self.file, MOST_TABLE_BYTES)
            with self.file.open(newline="", encoding="utf-8-sig") as lines:
                return _table(self.file, csv.DictReader(lines), self.COLUMNS)
        except csv.Error as error:
            raise ConfigError(f"{self.file}: cannot be read: {error}") from None
        except (OSError, UnicodeDecodeError) as error:
            why = getattr(error, "strerror", None) or "it is not UTF-8 text"
            raise ConfigError(f"{self.file}: cannot be read: {why}") from None

    @property
    def length_s(self) -> float:
        """Time of the last row."""
        return self.rows[0][-1]

    def value(self, t_s: float) -> float:
        times, values = self.rows
        after = bisect_right(times, t_s)
        if after in (0, len(times)):
            return self.scale * values[0 if after == 0 else -1]
        share = (t_s - times[after - 1]) / (times[after] - times[after - 1])
        return self.scale * (values[after - 1] + share * (values[after] - values[after - 1]))


@dataclass(frozen=True)
class AngleTable(Waveform):
    """The same of an angle to follow: columns t_s and angle_deg."""

    COLUMNS: ClassVar[tuple[str, ...]] = ("angle_deg",)

    @property
    def label(self) -> str:
        return super().label.replace("waveform", "angles", 1)


def _table(file: Path, rows: "csv.DictReader[str]", columns: tuple[str, ...]) -> "tuple[array[float], array[float]]":
    names = rows.fieldnames or []
    column = next((name for name in columns if name in names), None)
    if "t_s" not in names or column is None:
        wanted = f"{columns[0]} (or {columns[1]})" if len(columns) > 1 else columns[0]
        raise ConfigError(f"{file}: needs the columns t_s and {wanted}; it has {', '.join(names) or 'none'}")
    if any(names.count(name) > 1 for name in ("t_s", column)):
        raise ConfigError(f"{file}: t_s or {column} stands twice in the header")
    times, values = array("d"), array("d")
    for row in rows:
        where = f"{file}, line {rows.line_num}"
        if None in row:
            raise ConfigError(f"{where}: more cells than the header's {len(names)} columns; decimal commas?")
        _append(times, row["t_s"], values, row[column], where)
    if not times:
        raise ConfigError(f"{file}: holds no rows")
    return times, values


def _append(times: "array[float]", t_s: str, values: "array[float]", text: str, where: str) -> None:
    try:
        time, value = float(t_s), float(text)
    except (TypeError, ValueError):
        raise ConfigError(f"{where}: {t_s!r}, {text!r} are not two numbers") from None
    if not (math.isfinite(time) and math.isfinite(value)):
        raise ConfigError(f"{where}: {t_s}, {text}: both must be finite")
    if times and time <= times[-1]:
        raise ConfigError(f"{where}: time does not rise ({times[-1]:g} s, then {time:g} s)")
    times.append(time)
    values.append(value)
