"""Records of the rig beside their baselines: what the diagnosis computes on, and the table of what pairs with what.

No effect and no verdict is known here.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.errors import RecordError
from rig.gap.records.alignment import align
from rig.gap.records.cleaning.dropouts import Dropouts
from rig.gap.records.clipped import clipped_notes
from rig.gap.records.conditions import difference
from rig.gap.records.days import usable_baselines, usable_day
from rig.gap.records.grid import Pair, RunColumns, pair_on_grid
from rig.gap.records.own_zero import OWN_ZERO_NOTE, count_from_rest
from rig.gap.records.partners import Match, Partner, find_partner, named_session, require_partners
from rig.gap.records.reach import check_direction, check_scale, runs_against
from rig.gap.records.rest import at_rests, rest_pressure, shifted
from rig.gap.records.usable import hole, reasons
from rig.identify.records.causality import before_pressures, subject_of
from rig.identify.records.monitors import broken_monitor
from rig.log.session_times import are_numbered, begun_s
from rig.number_text import counted
from rig.record import Record

__all__ = ["Pair", "Pairing", "RunColumns", "pair_up"]


@dataclass(frozen=True)
class Pairing:
    """All pairs, and what was found out while pairing."""

    pairs: list[Pair]
    pressures: bool
    day_count: int
    """Of earlier days that pair with every record of the case; 1 for what a fingerprint keeps."""
    p0_mpa: float
    notes: tuple[str, ...] = ()
    unpaired: Sequence[str] = ()
    clipped: tuple[str, ...] = ()
    """The notes of sensors that seem clipped: what cuts off a value cannot be told from that."""
    matches: Sequence[Match] = ()
    """The table: each usable record beside each session, what paired by what, and how far off what did not."""
    elsewhere: tuple[str, ...] = ()
    """The note that the measured P0 lies elsewhere than the earlier days', or the model's, where nobody says which was
    commanded."""
    numbered: bool = False
    """Nobody says when the records began, and their files are numbered."""
    strange: tuple[str, ...] = ()
    """The note that the model does not follow the earlier days at all: another rig's?"""
    stuck: tuple[str, ...] = ()
    """Which monitors stood still for a while, see `rig.gap.records.cleaning.stuck_monitors`."""

    @property
    def doubts(self) -> tuple[str, ...]:
        """The notes that doubt whether like is compared with like: another rig, another P0."""
        return (*self.strange, *self.elsewhere)

    def noting(self, *lines: str) -> "Pairing":
        """The same with further lines for whoever reads the answer."""
        return replace(self, notes=(*self.notes, *lines))


@dataclass(frozen=True)
class _Beside:
    """A record of the case with what pairs with it, of each session one."""

    record: Record
    partners: tuple[Partner, ...]

    @property
    def others(self) -> list[Record]:
        return [partner.record for partner in self.partners]


@dataclass(frozen=True)
class _Matched:
    """The records that have partners, the names of those that have none, the whole table of what pairs with what, and
    notes on it."""

    kept: list[_Beside]
    unpaired: list[str]
    matches: list[Match]
    notes: list[str]


def pair_up(
    records: Sequence[Record], baselines: Sequence[Sequence[Record]], p0_mpa: float, *, pressures: bool = True
) -> Pairing:
    """Pair `records` with the records of each baseline session (one inner list a session); drop-outs are taken out of
    all of them.

    Raises RecordError when no record can be used, or when sessions were given and pair with nothing. Without any
    baseline the pairs have no sessions.
    """
    today = usable_day(records)
    if not today.records:
        raise RecordError(reasons(today.notes))
    earlier = usable_baselines(baselines, today.records)
    matched = _matched(today.records, earlier.by_number)
    kept = matched.kept
    hole_notes = list(_hole_notes(kept))
    case, days = [one.record for one in kept], [other for one in kept for other in one.others]
    p0 = rest_pressure(case, p0_mpa, beside_days=bool(earlier.by_number))
    placed, rest_notes = at_rests(case, [one.others for one in kept], p0_mpa)
    elsewhere = shifted(placed, days, p0_mpa)
    all_have_pressures, pressure_notes = _all_have_pressures(case, days) if pressures else (False, [])
    pairs, grid_notes = _on_grids(kept, placed, p0, all_have_pressures, today.fallen | earlier.fallen)
    _check_directions(pairs)
    clipped = tuple(clipped_notes(pairs))
    notes = (
        *today.notes, *earlier.notes, *_repeated_sweeps(today.records[0], earlier.by_number), *matched.notes,
        *hole_notes, *rest_notes, *elsewhere, *pressure_notes, *grid_notes, *_other_inputs(pairs), *clipped,
    )  # fmt: skip
    return Pairing(
        pairs,
        pressures=all_have_pressures,
        day_count=len(pairs[0].days),
        p0_mpa=p0,
        notes=notes,
        unpaired=matched.unpaired,
        clipped=clipped,
        matches=matched.matches,
        elsewhere=elsewhere,
        numbered=are_numbered(case),
        stuck=tuple(today.stuck),
    )


def _matched(records: Sequence[Record], sessions: Mapping[int, list[Record]]) -> _Matched:
    """The records with their partners of each session. RecordError where sessions pair with nothing."""
    found = [[find_partner(record, session, k) for k, session in sessions.items()] for record in records]
    matches = [match for each in found for _, match in each]
    require_partners(matches, len(sessions))
    kept, unpaired, notes = _with_all_sessions(records, [[one for one, _ in each] for each in found], matches)
    return _Matched(kept, unpaired, matches, [*_unpaired_sessions(matches), *notes])


def _hole_notes(kept: Sequence[_Beside]) -> Iterator[str]:
    """A note for each long stretch without rows. RecordError where an angle is of another scale than its partners'."""
    for one in kept:
        check_scale(one.record, one.others)
        yield from filter(None, (hole(one.record), *(hole(other, "baseline ") for other in one.others)))


def _on_grids(
    kept: Sequence[_Beside],
    placed: Sequence[Record],
    p0_mpa: float,
    pressures: bool,
    fallen: Mapping[int, tuple[Dropouts, ...]],
) -> tuple[list[Pair], list[str]]:
    """The pairs of `kept`, each on one grid of rows, and notes on them; `placed` are their records about P0, in their
    order."""
    begun, own_zeros = begun_s([one.record for one in kept]).tolist(), count_from_rest([one.record for one in kept])
    pairs, notes = list[Pair](), list[str]()
    for record, one, at_s in zip(placed, kept, begun, strict=True):
        dropouts = [fallen[id(each)] for each in (one.record, *one.others)]
        pair, note = pair_on_grid(record, one.partners, p0_mpa, pressures, dropouts)
        pairs.append(replace(pair, begun_s=at_s, counts_from_rest=own_zeros))
        notes += [note] if note else []
    return pairs, [*notes, OWN_ZERO_NOTE] if own_zeros else notes


def _check_directions(pairs: Sequence[Pair]) -> None:
    """RecordError when the case's angle runs against that of an earlier day, which is named when it is not all of
    them."""
    cases, count = [pair.case.angle_deg for pair in pairs], len(pairs[0].days)
    days = [[pair.days[k].angle_deg for pair in pairs] for k in range(count)]
    against = [k for k, day in enumerate(days) if runs_against(cases, day)]
    if against:
        k, one = against[0], pairs[0]
        day = "the earlier days" if len(against) == count else named_session(one.day_numbers[k], one.raw_days[k])
        whose = f"{day}'" if day.endswith("s") else f"that of {day}"
        check_direction(cases, days[k], whose)


def _repeated_sweeps(record: Record, sessions: Mapping[int, Sequence[Record]]) -> Iterator[str]:
    """A note for each session that holds the sweep of this record more than once: two days in one folder would count
    as one."""
    for number, session in sessions.items():
        same = [other.name for other in session if align(record, other).same and difference(record, other) is None]
        if len(same) > 1:
            yield (
                f"{named_session(number, session[0])} holds the sweep of {record.name} {len(same)} times "
                f"({', '.join(same[:3])}): one of each is "
                "used; if these are several days, give each its own --baseline"
            )


def _with_all_sessions(
    records: Sequence[Record], found: Sequence[Sequence[Partner | None]], matches: Sequence[Match]
) -> tuple[list[_Beside], list[str], list[str]]:
    """The records that have a partner in every session, the names of the others, which are left out, and notes on it.
    `found`: the partners of each record, session by session. Sessions that pair with no record do not count. Where no
    record has a partner in all of them, each keeps its first partner: together these stand for one earlier day."""
    pairing = [any(partner is not None for partner in session) for session in zip(*found, strict=True)]
    if not any(pairing):
        return [_Beside(record, ()) for record in records], [], []
    sessions = sum(pairing)
    known = [tuple(partner for partner in each if partner is not None) for each in found]
    together = any(len(partners) == sessions for partners in known)
    least = sessions if together else 1
    unpaired = [record.name for record, partners in zip(records, known, strict=True) if len(partners) < least]
    why = {match.record: match.why for match in matches if match.partner is None}
    notes = [f"{name}: no baseline of this sweep ({why.get(name, '')}); left out" for name in unpaired]
    if not together:
        notes.append("the baseline sessions hold different sweeps: together they count as one earlier day")
    kept = [
        _Beside(record, partners[:least])
        for record, partners in zip(records, known, strict=True)
        if len(partners) >= least
    ]
    return kept, unpaired, notes


def _unpaired_sessions(matches: Sequence[Match]) -> Iterator[str]:
    """A note for each session that pairs with no record, with how far off it was."""
    for number in sorted({match.session for match in matches}):
        mine = [match for match in matches if match.session == number]
        if not any(match.partner for match in mine):
            nearest = min(mine, key=lambda match: np.inf if match.off is None else match.off)
            yield f"baseline session {number} pairs with no record; nearest: {nearest.record}: {nearest.why}"


def _all_have_pressures(records: Sequence[Record], days: Sequence[Record]) -> tuple[bool, list[str]]:
    """Whether the pressures can be used: case and baselines have both, and every monitor measures something; and a note
    on why not, none where nobody measured any."""
    silent = next((f"{record.name}: {why}" for record in records if (why := broken_monitor(record))), None)
    if silent and all(record.has_pressures for record in records):
        return False, [f"{silent}; broken wire? the angle alone is used"]
    if late := before_pressures(records):
        why = f"{late}: monitors that are slow, or of another clock? the angle alone is used"
        return False, [f"{subject_of(records)}: {why}"]
    without = ((record, where) for where, some in (("the case", records), ("the baselines", days)) for record in some)
    lacking, where = next(((record, where) for record, where in without if not record.has_pressures), (None, ""))
    if lacking is None:
        return True, []
    if all(record.p1_mpa is None and record.p2_mpa is None for record in (*records, *days)):
        return False, []
    missing = lacking.unmeasured
    was = "was" if len(missing) == 1 else "were"
    return False, [f"{' and '.join(missing)} {was} not measured in {where} ({lacking.name}): the angle alone is used"]


def _other_inputs(pairs: Sequence[Pair]) -> list[str]:
    """One note on all records whose baselines were taken at another input than their own: a jittered clock does that
    to every one."""
    names = [pair.name for pair in pairs if pair.other_input]
    if len(names) == 1:
        return [f"{names[0]}: its input is not exactly the baselines'; they are taken at its own"]
    of_all = f"{len(names)} of {counted(len(pairs), 'record')}"
    return [f"{of_all}: their input is not exactly the baselines'; those are taken at it"] if names else []
