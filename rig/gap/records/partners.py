"""What pairs with what: by name, command and condition. What pairs with nothing says how far off it was and where the
limit is.

A name that a session has decides: its record is the partner or there is none. Where the session does not have the name,
the command and the condition decide.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rig.conditions import conditions
from rig.errors import RecordError
from rig.gap.records.alignment import NO_OVERLAP, Alignment, align
from rig.gap.records.conditions import difference
from rig.gap.records.settings import SAME_COMMAND
from rig.gap.records.usable import reasons
from rig.record import Record


@dataclass(frozen=True)
class Match:
    """One line of the table: a record of the case beside one baseline session."""

    record: str
    session: int
    """Counted from 1, as the sessions were given."""
    partner: str | None
    """The baseline's name; None where nothing pairs."""
    by: str
    """name and command, or command; what was compared, where nothing pairs."""
    off: float | None
    """What the two commands differ by, aligned, as a share of the command's spread; None where another thing
    decided."""
    limit: float
    """What they may differ by."""
    shift_s: float
    """By how much later the sweep starts in the baseline."""
    why: str = ""
    """Why nothing pairs."""

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class Partner:
    """A baseline record and how it lies to the case's."""

    record: Record
    alignment: Alignment
    session: int
    """Counted from 1, as the sessions were given."""


def named_session(number: int, record: Record | None) -> str:
    """How a note names a session, counted from 1 as they were given: with the folder of a record of it, where that is
    known."""
    source = None if record is None else record.source
    return f"baseline session {number}" + (f" ({source.parent})" if source is not None else "")


def find_partner(record: Record, session: Sequence[Record], number: int) -> tuple[Partner | None, Match]:
    """The record of a session that pairs with `record`, and the table's line; `number` is the session's."""
    named = [other for other in session if other.name == record.name]
    by = "name and command" if named else "command"
    tried = [(other, align(record, other)) for other in named or session]
    fitting = [(other, found) for other, found in tried if found.same and difference(record, other) is None]
    if not fitting:
        return None, _unpaired(record, tried, by, number)
    if not named and (doubt := _ambiguous([other for other, _ in fitting])):
        return None, Match(record.name, number, None, by, None, SAME_COMMAND, 0.0, doubt)
    other, found = min(fitting, key=lambda each: each[1].off)
    match = Match(record.name, number, other.name, by, found.off, SAME_COMMAND, found.shift_s)
    return Partner(other, found, number), match


def _unpaired(record: Record, tried: Sequence[tuple[Record, Alignment]], by: str, number: int) -> Match:
    other, found = min(tried, key=lambda each: each[1].off)
    unlike = difference(record, other)
    if found is NO_OVERLAP:
        off, why = None, f"{other.name} is too short beside it"
    elif found.same and unlike is not None:
        off, why = found.off, unlike.text if other.name == record.name else f"{other.name}: {unlike.text}"
    else:
        off, why = (
            found.off,
            f"the command of {other.name} differs by {100 * found.off:.3g} % of its spread, allowed: "
            f"{100 * SAME_COMMAND:g} %",
        )
    return Match(record.name, number, None, by, off, SAME_COMMAND, found.shift_s, why)


def _ambiguous(fitting: Sequence[Record]) -> str:
    """Why it is open which of several records of one command is meant; empty where they are repeats."""
    first = fitting[0]
    unlike = next((found for other in fitting[1:] if (found := difference(first, other))), None)
    if unlike is None:
        return ""
    return (
        f"{len(fitting)} records of this command differ in {unlike.name} ({unlike.mine}, {unlike.other}), which the "
        "record does not say "
        f"(it says: {', '.join(conditions(first)) or 'nothing'})"
    )


def require_partners(matches: Sequence[Match], sessions: int) -> None:
    """RecordError when sessions were given and not one pairs with anything."""
    if sessions and not any(match.partner for match in matches):
        why_none = list(dict.fromkeys(f"{match.record}: {match.why}" for match in matches))
        which = (
            "the baseline session pairs with no record"
            if sessions == 1
            else f"none of {sessions} baseline sessions pairs with a record"
        )
        raise RecordError(f"{which}: {reasons(why_none)}")
