"""Records of the rig beside their baselines: what the diagnosis computes on, and the table of what pairs with what.

No effect and no verdict is known here.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rig.errors import RecordError
from rig.gap.records.alignment import align
from rig.gap.records.conditions import difference
from rig.gap.records.dropouts import Dropouts
from rig.gap.records.grid import Pair, RunColumns, pair_on_grid
from rig.gap.records.outliers import IN_WORDS, without_falls
from rig.gap.records.own_zero import OWN_ZERO_NOTE, count_from_rest
from rig.gap.records.partners import Match, Partner, find_partner, named_session, require_partners
from rig.gap.records.rest import at_rests, rest_pressure, shifted
from rig.gap.records.settings import CLIPPED, CLIPPED_OVER_NEXT
from rig.gap.records.stuck_monitors import without_stuck_monitors
from rig.gap.records.usable import check_direction, check_scale, early, hole, reasons, runs_against, usable
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
    """Which monitors stood still for a while, see `rig.gap.records.stuck_monitors`."""

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


def pair_up(
    records: Sequence[Record], baselines: Sequence[Sequence[Record]], p0_mpa: float, *, pressures: bool = True
) -> Pairing:
    """Pair `records` with the records of each baseline session (one inner list a session); drop-outs are taken out of
    all of them.

    Raises RecordError when no record can be used, or when sessions were given and pair with nothing. Without any
    baseline the pairs have no sessions.
    """
    notes: list[str] = []
    moving, stuck = without_stuck_monitors(records)
    cleaned, dropouts = without_falls(moving, notes)
    fallen = _by_record(cleaned, dropouts)
    able = _usable(cleaned, notes)
    if not able:
        raise RecordError(reasons(notes))
    sessions = _sessions(baselines, able, notes, fallen)
    notes.extend(_repeated_sweeps(able[0], sessions))
    kept, unpaired, matches = _matched(able, sessions, notes)
    notes.extend(_holes(kept))
    case, days = [one.record for one in kept], [other for one in kept for other in one.others]
    p0 = rest_pressure(case, p0_mpa, beside_days=bool(sessions))
    placed, rest_notes = at_rests(case, [one.others for one in kept], p0_mpa)
    elsewhere = shifted(placed, days, p0_mpa)
    notes.extend([*rest_notes, *elsewhere])
    pressures_used = pressures and _all_have_pressures(case, days, notes)
    pairs, short = _on_grids(kept, placed, p0, pressures_used, fallen)
    notes.extend([*short, *_other_inputs(pairs)])
    _check_directions(pairs)
    clipped = tuple(_clipped(pairs))
    notes.extend(clipped)
    return Pairing(
        pairs,
        pressures=pressures_used,
        day_count=len(pairs[0].days),
        p0_mpa=p0,
        notes=tuple(notes),
        unpaired=unpaired,
        clipped=clipped,
        matches=matches,
        elsewhere=elsewhere,
        numbered=are_numbered(case),
        stuck=tuple(stuck),
    )


def _matched(
    records: Sequence[Record], sessions: Mapping[int, list[Record]], notes: list[str]
) -> tuple[list[_Beside], Sequence[str], list[Match]]:
    """The records with their partners, which records have none, and the whole table of what pairs with what.
    RecordError where sessions pair with nothing."""
    found = [[find_partner(record, session, k) for k, session in sessions.items()] for record in records]
    matches = [match for each in found for _, match in each]
    require_partners(matches, len(sessions))
    notes.extend(_unpaired_sessions(matches))
    kept, unpaired = _with_all_sessions(records, [[one for one, _ in each] for each in found], matches, notes)
    return kept, unpaired, matches


def _holes(kept: Sequence[_Beside]) -> Iterator[str]:
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


def _by_record(records: Sequence[Record], dropouts: Sequence[tuple[Dropouts, ...]]) -> dict[int, tuple[Dropouts, ...]]:
    """What fell in each record, by its identity."""
    return {id(record): mine for record, mine in zip(records, dropouts, strict=True)}


def _usable(records: Sequence[Record], notes: list[str], kind: str = "") -> list[Record]:
    """The records of one day that anything can be learnt from; none where together they put the effect before its
    cause."""
    if said := early(records):
        notes.append(f"{kind}{said}")
        return []
    return [record for record in records if usable(record, notes, kind)]


def _sessions(
    baselines: Sequence[Sequence[Record]],
    case: Sequence[Record],
    notes: list[str],
    fallen: dict[int, tuple[Dropouts, ...]],
) -> dict[int, list[Record]]:
    """The baseline sessions that can be used, by their numbers; what fell in their records goes into `fallen`.
    RecordError when some were given and none can be used."""
    sessions: list[list[Record]] = []
    for session in baselines:
        moving, stuck = without_stuck_monitors(session)
        notes.extend(f"{named_session(len(sessions) + 1, session[0])}: {line}" for line in stuck)
        cleaned, dropouts = without_falls(moving, notes, "baseline ")
        fallen |= _by_record(cleaned, dropouts)
        sessions.append(_usable(cleaned, notes, "baseline "))
    kept = _distinct(sessions, case, notes)
    if baselines and not kept:
        raise RecordError(f"no baseline session can be used: {reasons(notes)}")
    return kept


def _distinct(sessions: list[list[Record]], case: Sequence[Record], notes: list[str]) -> dict[int, list[Record]]:
    """Each day once, by its number from 1, and none that is the case itself: a copy would make the floor too low."""

    def contents(records: Sequence[Record]) -> set[bytes]:
        return {np.asarray(record.angle_deg).tobytes() for record in records}

    seen = contents(case)
    kept = {}
    for number, session in enumerate(sessions, 1):
        mine = contents(session)
        if mine & seen:
            said = named_session(number, session[0])
            notes.append(f"{said} repeats records of the case or of another session; left out")
        if not mine or mine & seen:
            continue
        seen |= mine
        kept[number] = session
    return kept


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
    records: Sequence[Record], found: Sequence[Sequence[Partner | None]], matches: Sequence[Match], notes: list[str]
) -> tuple[list[_Beside], list[str]]:
    """The records that have a partner in every session, and the names of the others, which are left out. `found`: the
    partners of each record, session by session. Sessions that pair with no record do not count. Where no record has a
    partner in all of them, each keeps its first partner: together these stand for one earlier day."""
    pairing = [any(partner is not None for partner in session) for session in zip(*found, strict=True)]
    if not any(pairing):
        return [_Beside(record, ()) for record in records], []
    sessions = sum(pairing)
    known = [tuple(partner for partner in each if partner is not None) for each in found]
    together = any(len(partners) == sessions for partners in known)
    least = sessions if together else 1
    unpaired = [record.name for record, partners in zip(records, known, strict=True) if len(partners) < least]
    why = {match.record: match.why for match in matches if match.partner is None}
    notes.extend(f"{name}: no baseline of this sweep ({why.get(name, '')}); left out" for name in unpaired)
    if not together:
        notes.append("the baseline sessions hold different sweeps: together they count as one earlier day")
    kept = [
        _Beside(record, partners[:least])
        for record, partners in zip(records, known, strict=True)
        if len(partners) >= least
    ]
    return kept, unpaired


def _unpaired_sessions(matches: Sequence[Match]) -> Iterator[str]:
    """A note for each session that pairs with no record, with how far off it was."""
    for number in sorted({match.session for match in matches}):
        mine = [match for match in matches if match.session == number]
        if not any(match.partner for match in mine):
            nearest = min(mine, key=lambda match: np.inf if match.off is None else match.off)
            yield f"baseline session {number} pairs with no record; nearest: {nearest.record}: {nearest.why}"


def _all_have_pressures(records: Sequence[Record], days: Sequence[Record], notes: list[str]) -> bool:
    """Whether the pressures can be used: case and baselines have both, and every monitor measures something. A note
    says why not, unless nobody measured any."""
    silent = next((f"{record.name}: {said}" for record in records if (said := broken_monitor(record))), None)
    if silent and all(record.has_pressures for record in records):
        notes.append(f"{silent}; broken wire? the angle alone is used")
        return False
    if late := before_pressures(records):
        notes.append(
            f"{subject_of(records)}: {late}: monitors that are slow, or of another clock? the angle alone is used"
        )
        return False
    without = ((record, where) for where, some in (("the case", records), ("the baselines", days)) for record in some)
    lacking, where = next(((record, where) for record, where in without if not record.has_pressures), (None, ""))
    if lacking is None:
        return True
    missing = lacking.unmeasured
    if any(record.p1_mpa is not None or record.p2_mpa is not None for record in (*records, *days)):
        notes.append(
            f"{' and '.join(missing)} {'was' if len(missing) == 1 else 'were'} not measured in {where} "
            f"({lacking.name}): the angle alone is used"
        )
    return False


def _other_inputs(pairs: Sequence[Pair]) -> list[str]:
    """One note on all records whose baselines were taken at another input than their own: a jittered clock does that
    to every one."""
    names = [pair.name for pair in pairs if pair.other_input]
    if len(names) == 1:
        return [f"{names[0]}: its input is not exactly the baselines'; they are taken at its own"]
    of_all = f"{len(names)} of {counted(len(pairs), 'record')}"
    return [f"{of_all}: their input is not exactly the baselines'; those are taken at it"] if names else []


def _clipped(pairs: Sequence[Pair]) -> Iterator[str]:
    """A note for each sensor that repeats its end value while the command moves on, and did not so on the earlier days:
    a joint that rests at an end of its sweep rested there then as well."""
    for pair in pairs:
        for name, (what, unit) in IN_WORDS.items():
            for word, stay in _stays(pair.raw, name).items():
                days = [_stays(day, name, stay.step) for day in pair.raw_days]
                before = min((day[word].share if word in day else 0.0 for day in days), default=0.0)
                if stay.share > max(CLIPPED + before, CLIPPED_OVER_NEXT * stay.beside):
                    yield (
                        f"{pair.name}: {what} stays at its {word} end, where it reads {stay.end:.4g} {unit}, for "
                        f"{100 * stay.share:.0f} % of the time: clipped?"
                    )


class _Stay(NamedTuple):
    """The end of a column, how far the value beside it is, and for which share of the time it stays at either."""

    end: float
    step: float
    share: float
    beside: float


def _stays(record: Record, name: str, within: float = 0.0) -> dict[str, _Stay]:
    """For how long a column of the record is at its upper and its lower end, or `within` so much of it, while it should
    move; empty where it has none, or one value. A sine on a coarse converter's steps is at its end 2.4 times as long as
    beside it."""
    column = getattr(record, name)
    if column is None:
        return {}
    known = np.isfinite(column)
    column, moves = column[known], (np.gradient(record.dp_cmd_mpa) != 0.0)[known]
    values = np.unique(column)
    if len(values) < 2:
        return {}
    ends = {"upper": (values[-1], values[-2]), "lower": (values[0], values[1])}
    return {
        word: _Stay(
            float(end), abs(float(end - beside)),
            *(float(np.mean(moves & (np.abs(column - value) <= within))) for value in (end, beside)),
        )
        for word, (end, beside) in ends.items()
    }  # fmt: skip
