"""Tables of numbers and time stamps as text: CSV and CSV.gz in, with any separator and decimal mark, and every fault
named by its row.

It knows nothing of what the columns mean; rig.log.reader and rig.log.foreign.mapping do.
"""

import codecs
import contextlib
import csv
import gzip
import io
import math
import re
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rig.config import check_regular
from rig.errors import RecordError
from rig.log.foreign.stamps import Stamp, Stamps, stamp
from rig.log.mcap.framing import unpacked_limit
from rig.number_text import counted

GZIP_MAGIC: Final = b"\x1f\x8b"
_MOST_BYTES: Final = 2 << 30
"""A day at 200 Hz with a hundred characters a row is 1.7 GB."""

LONGEST_HEADER: Final = 65536
"""Characters of a header that are looked at."""
_COLUMNS_LIMIT = 1000
_NO_TEXT: Final = re.compile(r"[\x00-\x08\x0e-\x1f]")
"""Control characters that no table holds."""
_SEPARATOR_HINT = "; decimal commas? import it with `separator` and `decimal` in a mapping"
_POINT_HINT = "; a point beside decimal commas may part thousands: take it out, or give `decimal: '.'`"
_DECIMAL_HINT = "; decimal comma? import it with `decimal: ','` in a mapping"
_THOUSANDS_HINT = "; take out what parts thousands"
_thousands: Final = re.compile(r"[+-]?\d{1,3}(?:[.,' \u2019\u00a0\u202f]\d{3})+(?:[.,]\d*)?").fullmatch


@dataclass(frozen=True)
class Style:
    """How a file writes its numbers."""

    separator: str = ","
    decimal: str = "."
    skip_rows: int = 0
    """Lines before the header."""
    units_row: bool = False
    """Whether the line below the header says in which units the columns are."""


@dataclass(frozen=True)
class TextTable:
    """The names of a table's columns, and its rows as text: what may be asked of it without reading the file again."""

    path: Path
    style: Style
    names: list[str]
    units_line: str
    """The line below the header, where the style says that it holds units."""
    rows: list[str]
    first_row: int
    """Number of the first of them in the file, counted from 1 as an editor does."""

    def columns(self, wanted: Collection[str] | None = None) -> dict[str, NDArray[np.float64]]:
        """Name -> column (n,), in the order of the file and in its own units; an empty cell is NaN. Time stamps are
        seconds since the first, where a column begins with one.

        With `wanted` only the columns of these names have to hold numbers; the others may be NaN. RecordError names the
        row and the column when a cell is neither, or a row is too short or too long.
        """
        if not self.rows:
            raise RecordError(f"{self.path}: a header and no rows")
        table = self._plain
        if table is None:
            table = _careful(self, [k for k, name in enumerate(self.names) if wanted is None or name in wanted])
        return {name: np.ascontiguousarray(table[:, number]) for number, name in enumerate(self.names)}

    def numeric(self) -> list[str]:
        """The columns of numbers and of time stamps, in the order of the file: not those most of whose filled cells are
        neither (a date alone, a remark)."""
        if self._plain is not None:
            return self.names
        surplus = [0] * len(self.names)
        for cells in _cells(self):
            for column, cell in enumerate(cells[: len(self.names)]):
                if cell.strip():
                    number = is_value(cell, self.style.decimal)
                    number = number or _thousands(cell.strip()) is not None  # these are refused with their row
                    surplus[column] += -1 if number else 1
        return [name for name, more in zip(self.names, surplus, strict=True) if more <= 0]

    def units(self) -> dict[str, str]:
        """Column -> the unit that the line below the header states, without brackets."""
        stated = self._named(self.units_line)
        return {name: unit for name, cell in stated if (unit := cell.strip(" []()"))}

    def first_stamps(self) -> dict[str, Stamp]:
        """Column -> its first time stamp, for those that begin with one."""
        cells = self._named(*self.rows[:1])
        return {name: found for name, cell in cells if (found := stamp(cell)) is not None}

    @cached_property
    def _plain(self) -> NDArray[np.float64] | None:
        """The table by numpy's parser; None when some cell is not a plain number."""
        if self.style.decimal != ".":
            return None
        try:
            table: NDArray[np.float64] = np.loadtxt(self.rows, delimiter=self.style.separator, comments=None, ndmin=2)
        except (ValueError, IndexError, UserWarning):
            return None
        return table if table.shape == (len(self.rows), len(self.names)) else None

    def _named(self, *line: str) -> Iterable[tuple[str, str]]:
        """The cells of a line with the columns that they stand in."""
        return zip(self.names, next(csv.reader(line, delimiter=self.style.separator), []), strict=False)


def read_table(
    path: Path,
    style: Style | None = None,
    require: Callable[[list[str]], None] | None = None,
    wanted: Collection[str] | None = None,
) -> dict[str, NDArray[np.float64]]:
    """The columns (n,) of the file at `path`, in its own units, see `TextTable.columns`. `require` sees the names
    before the rows are looked at, and raises when they are not what is wanted."""
    table = text_table(path, read_lines(path), style or Style())
    if require is not None:
        require(table.names)
    return table.columns(wanted)


def text_table(path: Path, lines: Sequence[str], style: Style) -> TextTable:
    """The table in the lines of the file at `path`; comment lines before its header are skipped. RecordError when there
    is no header, or a name stands in it twice."""
    first = style.skip_rows
    while first < len(lines) and (not lines[first].strip() or lines[first].startswith("#")):
        first += 1
    if first >= len(lines):
        raise RecordError(f"{path}: no header line")
    names = [name.strip() for name in next(csv.reader([lines[first][:LONGEST_HEADER]], delimiter=style.separator))]
    if len(names) > _COLUMNS_LIMIT:
        raise RecordError(f"{path}: {len(names)} columns in the header, at most {_COLUMNS_LIMIT} are allowed")
    twice = next((name for number, name in enumerate(names) if name in names[:number]), None)
    if twice is not None:
        raise RecordError(f"{path}: the column {twice!r} stands twice in the header")
    begin, end = first + 1 + style.units_row, len(lines)
    while end > begin and not lines[end - 1].strip():
        end -= 1
    units_line = lines[first + 1] if style.units_row and first + 1 < len(lines) else ""
    return TextTable(path, style, names, units_line, list(lines[begin:end]), begin + 1)


def read_lines(path: Path) -> list[str]:
    """The lines of a plain or gzipped text, bounded; RecordError when the file cannot be read, or is not text."""
    try:
        check_regular(path, _MOST_BYTES)
        raw = path.read_bytes()
    except OSError as error:
        raise RecordError(f"{path}: cannot be read: {error.strerror or error}") from None
    text = _decoded(_gunzip(path, raw) if raw[:2] == GZIP_MAGIC else raw)
    if text is None:
        raise RecordError(
            f"{path}: neither MCAP, TDMS nor text in UTF-8, UTF-16 or Windows-1252; a log is .mcap, .csv, .csv.gz or "
            ".tdms"
        )
    if not text.strip():
        raise RecordError(f"{path}: the file is empty")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _decoded(data: bytes) -> str | None:
    """The text of the bytes, None where they are none. UTF-16 says by its first bytes that it is (Excel's "Unicode
    text", PowerShell's `>`). What is no UTF-8 is read as Windows writes it in the West, which moves no number: a degree
    sign in a header is all that it is about."""
    marked = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    for encoding in ("utf-16",) if marked else ("utf-8-sig", "cp1252"):
        with contextlib.suppress(UnicodeDecodeError):
            text = data.decode(encoding)
            return None if _NO_TEXT.search(text) else text
    return None


def _gunzip(path: Path, raw: bytes) -> bytes:
    limit = unpacked_limit(len(raw))
    try:
        with gzip.open(io.BytesIO(raw)) as file:
            data = file.read(limit + 1)
    except (EOFError, zlib.error, gzip.BadGzipFile):
        raise RecordError(f"{path}: the gzip data are cut or broken") from None
    if len(data) > limit:
        raise RecordError(f"{path}: unpacks to more than {limit >> 20} MiB, more than a log of this size can hold")
    return data


def _careful(table: TextTable, looked_at: list[int]) -> NDArray[np.float64]:
    """The table cell by cell, so that a fault can be named. Columns that are not looked at are NaN."""
    names, decimal = table.names, table.style.decimal
    numbers = np.full((len(table.rows), len(names)), np.nan)
    stamps: dict[int, Stamps] = {}
    for number, row in enumerate(_cells(table)):
        where, cells = f"{table.path}, row {table.first_row + number}", filled(row, names)
        if len(cells) != len(names):
            hint = _SEPARATOR_HINT if len(cells) == 2 * len(names) and table.style.separator == "," else ""
            mismatch = f"{counted(len(cells), 'cell')} where the header names {counted(len(names), 'column')}"
            raise RecordError(f"{where}: {mismatch}{hint}")
        if number == 0:
            stamps = {column: Stamps(found) for column in looked_at if (found := stamp(cells[column])) is not None}
        for column in looked_at:
            cell, times = cells[column], stamps.get(column)
            try:
                numbers[number, column] = _number(cell, decimal) if times is None else times.seconds(cell)
            except ValueError:
                wanted = "a number" if times is None else "a time stamp like the first"
                hint = "" if times is not None else _hint(cell, decimal)
                raise RecordError(f"{where}: {names[column]}: {cell[:40]!r} is not {wanted}{hint}") from None
    return numbers


def _hint(cell: str, decimal: str) -> str:
    """Why a cell may be none of the numbers that are written with that decimal mark."""
    if decimal == "," and "." in cell:
        return _POINT_HINT
    if decimal == "." and "," in cell and "." not in cell:
        return _DECIMAL_HINT
    return _THOUSANDS_HINT if _thousands(cell.strip()) else ""


def _number(cell: str, decimal: str) -> float:
    """A cell as a number, an empty one as NaN. ValueError for what may be read in two ways: a point beside a decimal
    comma, which may part thousands, and what Python alone takes for a number (1_000)."""
    if "_" in cell or (decimal != "." and "." in cell):
        raise ValueError
    return float(cell.replace(decimal, ".")) if cell.strip() else math.nan


def is_value(cell: str, decimal: str) -> bool:
    """Whether a cell is a number by that decimal mark, a time stamp, or empty."""
    try:
        _number(cell, decimal)
    except ValueError:
        return stamp(cell) is not None
    return True


def filled(cells: list[str], names: list[str]) -> list[str]:
    """The cells of a row; LabVIEW writes the one of its last column, Comment, only where there is a comment."""
    return [*cells, ""] if len(cells) == len(names) - 1 and names[-1].strip() == "Comment" else cells


def _cells(table: TextTable) -> Iterator[list[str]]:
    """The cells of each row; RecordError where a line break stands inside quotes, for rows are lines."""
    reader = csv.reader(table.rows, delimiter=table.style.separator, strict=True)
    try:
        for number, cells in enumerate(reader):
            if reader.line_num != number + 1:
                raise RecordError(
                    f"{table.path}, row {table.first_row + number}: a cell in quotes goes on in the next line"
                )
            yield cells
    except csv.Error as error:
        raise RecordError(f"{table.path}: not a table: {error}") from None
