"""How an unknown text table writes its numbers: separator, decimal mark, and the lines before its header."""

from pathlib import Path
from typing import Final

from rig.errors import RecordError
from rig.log.foreign.delimited import Style, read_text

MOST_SKIPPED: Final = 40
"""Lines before the header that are looked at."""
LEAST_ROWS: Final = 3
"""Rows of numbers below a header."""
_STYLES: Final = ((",", "."), (";", ","), (";", "."), ("\t", "."), ("\t", ","))


def sniff(path: Path) -> Style:
    """The style under which most columns are numbers; RecordError when there is none."""
    lines = read_text(path).split("\n")
    best: tuple[int, Style] | None = None
    for separator, decimal in _STYLES:
        for skip in range(min(MOST_SKIPPED, max(len(lines) - LEAST_ROWS, 0))):
            width = len(lines[skip].split(separator))
            rows = [line.split(separator) for line in lines[skip + 1 : skip + 1 + LEAST_ROWS]]
            numbers = all(len(row) == width and all(_is_number(cell, decimal) for cell in row) for row in rows)
            if width > 1 and numbers and not all(_is_number(cell, decimal) for cell in lines[skip].split(separator)):
                if best is None or width > best[0]:
                    best = width, Style(separator, decimal, skip)
                break
    if best is None:
        raise RecordError(f"{path}: no header with rows of numbers below it in the first {MOST_SKIPPED} lines")
    return best[1]


def _is_number(cell: str, decimal: str) -> bool:
    text = cell.strip()
    if decimal != ".":
        if "." in text:
            return False
        text = text.replace(decimal, ".")
    try:
        float(text or "nan")
    except ValueError:
        return False
    return True
