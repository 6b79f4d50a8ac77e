"""Time stamps as cells of a text table: a time of day (14:03:02.125), or a date and a time by ISO 8601, as seconds.

Dates in another form are none: of two of them nobody can say which number is the month.
"""

import math
import re
from datetime import date
from typing import Final, NamedTuple

FORMS: Final = "14:03:02.125 or 2026-03-05 14:03:02.125"
"""What is read as a time stamp, for a message."""
_STAMP: Final = re.compile(
    r"(?:(\d{4}-\d\d-\d\d)(?:T| +))?(\d{1,2}):([0-5]\d):([0-5]\d)(?:[.,](\d+))?(?: ?(Z|[+-]\d\d(?::?\d\d)?))?",
    re.ASCII,
)
_DAY_NS: Final = 86_400_000_000_000


class Stamp(NamedTuple):
    """One cell."""

    text: str
    ns: int
    """Since midnight; with a date since the Unix epoch: by UTC where it says its zone, else by the clock that wrote
    it."""
    dated: bool
    zoned: bool

    def like(self, other: "Stamp") -> bool:
        """Whether both say the same things, so that one may follow the other."""
        return (self.dated, self.zoned) == (other.dated, other.zoned)


def stamp(cell: str) -> Stamp | None:
    """What a cell says; None when it is no time stamp."""
    if (found := _STAMP.fullmatch(cell.strip())) is None:
        return None
    day, hour, minute, second, fraction, zone = found.groups()
    try:
        days = 0 if day is None else date.fromisoformat(day).toordinal() - date(1970, 1, 1).toordinal()
    except ValueError:
        return None
    east = 0 if zone in (None, "Z") else int(f"{zone[0]}1") * (60 * int(zone[1:3]) + int(zone[3:].strip(":") or 0))
    seconds = 60 * (60 * int(hour) + int(minute) - east) + int(second)
    ns = days * _DAY_NS + seconds * 10**9 + int(f"{fraction or 0:0<9}"[:9])
    return Stamp(found[0], ns, day is not None, zone is not None)


class Stamps:
    """The stamps of a column, from its first on; a time of day goes on past midnight."""

    def __init__(self, first: Stamp) -> None:
        self.first = first
        self._last_ns = first.ns

    def seconds(self, cell: str) -> float:
        """Since the first stamp, NaN for an empty cell; to be asked row by row. ValueError for what is no such
        stamp."""
        if not cell.strip():
            return math.nan
        found = stamp(cell)
        if found is None or not found.like(self.first):
            raise ValueError
        ns = found.ns
        if not found.dated:  # the day on which it is nearest to the row before
            ns += round((self._last_ns - ns) / _DAY_NS) * _DAY_NS
        self._last_ns = ns
        return (ns - self.first.ns) / 1e9
