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
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rig.config import check_regular
from rig.errors import RecordError
from rig.log.foreign.stamps import Stamp, Stamps, stamp
from rig.log.mcap.framing import unpacked_limit

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


def read_table(
    path: Path,
    style: Style | None = None,
    require: Callable[[list[str]], None] | None = None,
    wanted: Collection[str] | None = None,
) -> dict[str, NDArray[np.float64]]:
    """Header -> column, in the order of the file; an empty cell is NaN, all columns have the same length. Time stamps
    are seconds since the first, where a column begins with one.

    With `wanted` only the columns of these names have to hold numbers; the others may be NaN.
    `require` sees the names before the rows are looked at, and raises when they are not what is wanted.

    RecordError names the row and the column when a cell is neither, a row is too short or too long, or a name stands
    twice.
    """
    style = style or Style()
    text = read_text(path)
    lines = text.split("\n")
    names, first = _header(path, lines, style)
    if require is not None:
        require(names)
    body = lines[first:]
    while body and not body[-1].strip():
        body.pop()
    if not body:
        raise RecordError(f"{path}: a header and no rows")
    table = _quick(body, style, len(names))
    if table is None:
        looked_at = [number for number, name in enumerate(names) if wanted is None or name in wanted]
        table = _careful(path, body, names, style, first + 1, looked_at)
    return {name: np.ascontiguousarray(table[:, number]) for number, name in enumerate(names)}


def numeric_columns(path: Path, style: Style) -> list[str]:
    """The columns of numbers and of time stamps, in the order of the file: not those most of whose filled cells are
    neither (a date alone, a remark).

    RecordError as for `read_table`, but for cells that are neither.
    """
    lines = read_text(path).split("\n")
    names, first = _header(path, lines, style)
    body = [line for line in lines[first:] if line.strip()]
    if _quick(body, style, len(names)) is not None:
        return names
    surplus = [0] * len(names)
    for cells in _rows(path, body, style, first + 1):
        for column, cell in enumerate(cells[: len(names)]):
            if cell.strip():
                number = is_value(cell, style.decimal) or _thousands(cell.strip())  # these are refused with their row
                surplus[column] += -1 if number else 1
    return [name for name, more in zip(names, surplus, strict=True) if more <= 0]


def below_header(path: Path, style: Style) -> tuple[dict[str, str], dict[str, Stamp]]:
    """Column -> the unit that the line below the header states, without brackets, where there is such a line; and
    column -> its first time stamp, for those that begin with one. RecordError as for `read_table`."""
    lines = read_text(path).split("\n")
    names, first = _header(path, lines, style)

    def cells(line: int) -> Iterator[tuple[str, str]]:
        return zip(names, next(csv.reader(lines[line : line + 1], delimiter=style.separator), []), strict=False)

    stated = ((name, cell.strip(" []()")) for name, cell in cells(first - 1)) if style.units_row else ()
    stamps = ((name, stamp(cell)) for name, cell in cells(first))
    return {name: unit for name, unit in stated if unit}, {name: found for name, found in stamps if found is not None}


def read_text(path: Path) -> str:
    """The text of a plain or gzipped file, bounded; RecordError when it cannot be read, or is not text."""
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
    return text.replace("\r\n", "\n").replace("\r", "\n")


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


def _header(path: Path, lines: list[str], style: Style) -> tuple[list[str], int]:
    """The column names, and the index of the line after them and their units; comment lines before them are skipped."""
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
    return names, first + 1 + style.units_row


def _quick(body: list[str], style: Style, columns: int) -> NDArray[np.float64] | None:
    """The table by numpy's parser; None when some cell is not a plain number."""
    if style.decimal != ".":
        return None
    try:
        table: NDArray[np.float64] = np.loadtxt(body, delimiter=style.separator, comments=None, ndmin=2)
    except (ValueError, IndexError, UserWarning):
        return None
    return table if table.shape == (len(body), columns) else None


def _careful(
    path: Path, body: list[str], names: list[str], style: Style, first_row: int, looked_at: list[int]
) -> NDArray[np.float64]:
    """The table cell by cell, so that a fault can be named; rows are counted from 1 as an editor does. Columns that are
    not looked at are NaN."""
    table = np.full((len(body), len(names)), np.nan)
    stamps: dict[int, Stamps] = {}
    for number, cells in enumerate(_rows(path, body, style, first_row)):
        where, cells = f"{path}, row {first_row + number}", filled(cells, names)
        if len(cells) != len(names):
            hint = _SEPARATOR_HINT if len(cells) == 2 * len(names) and style.separator == "," else ""
            raise RecordError(f"{where}: {len(cells)} cells where the header names {len(names)} columns{hint}")
        if number == 0:
            stamps = {column: Stamps(found) for column in looked_at if (found := stamp(cells[column])) is not None}
        for column in looked_at:
            cell, times = cells[column], stamps.get(column)
            try:
                table[number, column] = _number(cell, style.decimal) if times is None else times.seconds(cell)
            except ValueError:
                wanted = "a number" if times is None else "a time stamp like the first"
                hint = "" if times is not None else _hint(cell, style.decimal)
                raise RecordError(f"{where}: {names[column]}: {cell[:40]!r} is not {wanted}{hint}") from None
    return table


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


def _rows(path: Path, body: list[str], style: Style, first_row: int) -> Iterator[list[str]]:
    """The cells of each line; RecordError where a line break stands inside quotes, for rows are lines."""
    reader = csv.reader(body, delimiter=style.separator, strict=True)
    try:
        for number, cells in enumerate(reader):
            if reader.line_num != number + 1:
                raise RecordError(f"{path}, row {first_row + number}: a cell in quotes goes on in the next line")
            yield cells
    except csv.Error as error:
        raise RecordError(f"{path}: not a table: {error}") from None
