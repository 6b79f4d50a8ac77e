"""How an unknown text table writes its numbers: separator, decimal mark, and the lines before its header. Columns of
text may stand among those of numbers."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rig.errors import RecordError
from rig.log.foreign.delimited import LONGEST_HEADER, Style, filled, is_value
from rig.log.foreign.units import UNITS, spelt

MOST_SKIPPED: Final = 40
"""Lines before the header that are looked at."""
LEAST_NUMBER_ROWS: Final = 3
"""Rows of numbers below a header, where the file has no more."""
_ROWS: Final = 10
"""Rows below a header that are looked at: what is said before a table may look like a short one (LabVIEW's .lvm)."""
_STYLES: Final = ((",", "."), (";", ","), (";", "."), ("\t", "."), ("\t", ","))


def sniff(path: Path, lines: Sequence[str]) -> Style:
    """The style under which most columns of these lines are numbers, and of such styles the one with the fewest columns
    that are not; RecordError, which names the file at `path`, when none has two of them."""
    most, best = (1, 0), Style()
    for separator, decimal in _STYLES:
        for skip in range(min(MOST_SKIPPED, max(len(lines) - LEAST_NUMBER_ROWS, 0))):
            style = Style(separator, decimal, skip, _has_units(lines[skip : skip + 2], separator))
            below = skip + 1 + style.units_row
            numbers, others = _columns([lines[skip], *lines[below : below + _ROWS]], separator, decimal)
            if (numbers, -others) > most:
                most, best = (numbers, -others), style
            if numbers > 1:
                break
    if most[0] == 1:
        raise RecordError(f"{path}: no header with rows of numbers below it in the first {MOST_SKIPPED} lines")
    return best


def _has_units(lines: Sequence[str], separator: str) -> bool:
    """Whether the second line says the units of the columns that the first one names."""
    header, *below = csv.reader([line[:LONGEST_HEADER] for line in lines], delimiter=separator)
    cells = [] if len(below) != 1 or len(below[0]) != len(header) else [cell.strip(" []()") for cell in below[0]]
    return any(spelt(cell) in UNITS for cell in cells)


def _columns(lines: list[str], separator: str, decimal: str) -> tuple[int, int]:
    """How many columns of numbers and how many others these lines have, the first being their header; none of numbers
    where it cannot be that: rows of another length, or numbers above all the numbers."""
    header, *rows = csv.reader([line[:LONGEST_HEADER] for line in lines], delimiter=separator)
    rows = [filled(row, header) for row in rows if row]
    if len(rows) < LEAST_NUMBER_ROWS or any(len(row) != len(header) for row in rows):
        return 0, 0
    numbers = [all(is_value(row[column], decimal) for row in rows) for column in range(len(header))]
    if all(is_value(name, decimal) for name, number in zip(header, numbers, strict=True) if number):
        return 0, 0
    return sum(numbers), len(numbers) - sum(numbers)
