"""What can be used of each day: its rows without what no joint did, its records that something can be learnt from, and
no day twice.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.errors import RecordError
from rig.gap.records.cleaning.dropouts import Dropouts
from rig.gap.records.cleaning.outliers import without_falls
from rig.gap.records.cleaning.stuck_monitors import without_stuck_monitors
from rig.gap.records.partners import named_session
from rig.gap.records.usable import early, reasons, usable_of
from rig.record import Record

_KIND = "baseline "
"""What an earlier day's record is called in a note."""


@dataclass(frozen=True)
class UsableDay:
    """One day's records that can be used, none where together they put the effect before its cause."""

    records: list[Record]
    fallen: dict[int, tuple[Dropouts, ...]]
    """What fell in each of these records, by the record's identity."""
    stuck: list[str]
    """Which monitors stood still for a while, in words."""
    notes: list[str]
    """What was taken out, and which records cannot be used, with why."""


@dataclass(frozen=True)
class BaselineSessions:
    """The baseline sessions that can be used."""

    by_number: dict[int, list[Record]]
    """Each session's records by its number, from 1 in the order in which they were given."""
    fallen: dict[int, tuple[Dropouts, ...]]
    """What fell in each record, by its identity."""
    notes: list[str]


def usable_day(records: Sequence[Record], kind: str = "") -> UsableDay:
    """Of the rig as it is now; `kind`: what an earlier day's record is called in a note."""
    moving, stuck = without_stuck_monitors(records)
    cleaned = without_falls(moving, kind)
    if reason := early(cleaned.records):
        return UsableDay([], {}, stuck, [*cleaned.notes, f"{kind}{reason}"])
    kept, notes = usable_of(cleaned.records, kind)
    fallen = {id(record): mine for record, mine in zip(cleaned.records, cleaned.dropouts, strict=True)}
    # of those alone that live on: another record may be given the identity of one that is gone
    return UsableDay(kept, {id(record): fallen[id(record)] for record in kept}, stuck, [*cleaned.notes, *notes])


def usable_baselines(baselines: Sequence[Sequence[Record]], case: Sequence[Record]) -> BaselineSessions:
    """The baselines beside the usable records of the case. RecordError when some were given and none can be used."""
    days, notes, fallen = list[list[Record]](), list[str](), dict[int, tuple[Dropouts, ...]]()
    for number, session in enumerate(baselines, 1):
        day = usable_day(session, _KIND)
        notes += [*(f"{named_session(number, session[0])}: {line}" for line in day.stuck), *day.notes]
        fallen |= day.fallen
        days.append(day.records)
    kept, copies = _distinct(days, case)
    notes += copies
    if baselines and not kept:
        raise RecordError(f"no baseline session can be used: {reasons(notes)}")
    return BaselineSessions(kept, fallen, notes)


def _distinct(sessions: Sequence[list[Record]], case: Sequence[Record]) -> tuple[dict[int, list[Record]], list[str]]:
    """Each day once, by its number from 1, and none that is the case itself: a copy would make the floor too low; and a
    note on each copy."""

    def contents(records: Sequence[Record]) -> set[bytes]:
        return {np.asarray(record.angle_deg).tobytes() for record in records}

    seen = contents(case)
    kept, copies = dict[int, list[Record]](), list[str]()
    for number, session in enumerate(sessions, 1):
        mine = contents(session)
        if mine & seen:
            copies.append(
                f"{named_session(number, session[0])} repeats records of the case or of another session; left out"
            )
        elif mine:
            seen |= mine
            kept[number] = session
    return kept, copies
