"""What there is to find in the records: marks, the pressures' side judged, and the angle's with what the pressures hand
over.

Each step's computing is in `rig.gap.days.engine`, what goes between the sides in `rig.gap.days.handover`; here stands
their order.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.gap.days.attribute import Candidate
from rig.gap.days.engine import (
    angle_side,
    judge,
    library_of,
    model_misfit_deg,
    overall_gap,
    preferring,
    prepare,
    signatures_of,
    valve_side,
)
from rig.gap.days.handover import doubts, faint, misreading, stiffened, stripped, with_mean_law
from rig.gap.days.prepared import Judged, Prepared, untriggered
from rig.gap.days.verdict import leaves_too_much
from rig.gap.hypotheses.library import Effect
from rig.gap.hypotheses.propagate import Applied
from rig.gap.raw_tests.repeats import bridged, lost_rows
from rig.gap.raw_tests.signature import Signature
from rig.identify.descent import square_sum
from rig.model.parameters import Model
from rig.record import Column, Record

ANOTHER_RIG = 0.3
"""A model that misses the healthy sessions by this share of the angle's spread is no simulator of this rig."""
UNDOING = 0.4
"""Causes of a rig that have nothing to do with each other hardly fit together as closely as to leave less than this of
themselves."""
MOST_CAUSES = 2
"""More at once are less likely than one that the library does not hold."""
WORSENED = 0.8
"""A cause makes the angle plainly worse when without it this share of the rms is left."""


@dataclass(frozen=True)
class Findings:
    """What was computed, for the words, the report and for judging further records."""

    prepared: Prepared
    valve: Judged | None
    angle: Judged
    signatures: list[Signature]
    simulator: Model | None
    """What the causes are added to, and asked how far the gap shrinks; None without one, or when it is plainly another
    rig's."""
    as_read: Prepared
    """As `prepared`, before lost samples were bridged."""
    model_misfit_deg: float | None = None
    """How far the model as it stands is from the healthy sessions."""

    @property
    def sides(self) -> list[Judged]:
        """The judged sides, upstream first."""
        return [judged for judged in (self.valve, self.angle) if judged is not None]

    @property
    def accepted(self) -> list[Candidate]:
        """The accepted causes of all sides, upstream first."""
        return [candidate for judged in self.sides for candidate in judged.accepted]

    @property
    def applied(self) -> list[Applied]:
        """The accepted causes as stages, upstream first."""
        return [candidate.applied for candidate in self.accepted]

    @property
    def strange(self) -> list[Signature]:
        """Marks of something in the angle that the library has no name for."""
        return [mark for mark in self.signatures if mark.found and mark.effect is None and mark.variance_deg2 > 0.0]

    def size_of(self, cause: Applied) -> set[str]:
        """The numbers that are an accepted cause's size."""
        law = next(one.law for one in self.accepted if one.applied is cause)
        return {law.free[0]} | {name for name, owner in law.tied.items() if owner == law.free[0]}


def find(
    model: Model | None,
    records: Sequence[Record],
    baselines: Sequence[Sequence[Record]],
    pressures: bool,
    library: Sequence[str] | None,
) -> Findings:
    """Everything from the records to the judged sides; raises what `prepare` raises."""
    effects = library_of(library)
    as_read = prepared = prepare(model, records, baselines, pressures)
    known = {effect.name for effect in effects}
    marks = [_named_by(known, mark) for mark in signatures_of(prepared)]
    if any(mark.found and mark.effect == "lost_samples" for mark in marks):
        prepared = _without_lost(prepared, model, pressures)
        noise = next(_named_by(known, mark) for mark in signatures_of(prepared) if mark.test == "noise")
        marks = [noise if mark.test == "noise" else mark for mark in marks]
    valve = judge(prepared, valve_side(prepared), effects) if prepared.pairing.pressures else None

    def with_valves(judged: Judged | None) -> Findings:
        return _both_sides(prepared, judged, effects, marks, model, as_read)

    findings = _sparing(with_valves(valve), with_valves)
    if valve is not None and _misled(findings):
        findings = with_valves(_misread(prepared, valve))
    missed = model_misfit_deg(model, as_read)
    simulator = model if missed is None or _is_of_this_rig(missed, as_read) else None
    return replace(findings, simulator=simulator, model_misfit_deg=missed)


def _named_by(known: Collection[str], mark: Signature) -> Signature:
    """The mark, without its name where the library does not hold that."""
    return mark if mark.effect is None or mark.effect in known else replace(mark, effect=None)


def _is_of_this_rig(missed: float, prepared: Prepared) -> bool:
    """Whether a model that misses the healthy sessions by so many degrees follows them at all; said when not."""
    spread = float(np.std(np.concatenate([reference.angle_deg for reference in prepared.references])))
    if missed > ANOTHER_RIG * spread:
        prepared.pairing.notes.append(
            f"the model misses the healthy sessions by {missed:.2g} deg, {100 * missed / spread:.0f} % of its "
            "spread: another rig's? "
            "How far the gap shrinks is by the description of the healthy sessions, not by this model"
        )
    return missed <= ANOTHER_RIG * spread


def _both_sides(
    prepared: Prepared,
    valve: Judged | None,
    effects: Sequence[Effect],
    marks: list[Signature],
    model: Model | None,
    as_read: Prepared,
) -> Findings:
    """The angle judged with what the valve side hands over."""
    if valve is not None and valve.trigger.found and misreading(valve, angle_side(prepared, driven=False, model=model)):
        valve = _misread(prepared, valve)
    driven = valve is not None and valve.trigger.found
    doubted: Sequence[Column] = ()
    if valve is not None and valve.accepted:
        prepared, shared = stripped(prepared, valve)
        doubted = [*shared, *doubts(prepared, valve)]
    if driven:
        prepared = with_mean_law(prepared)
        doubted = [*doubted, stiffened(prepared)]
    added = sum(mark.smoothed_deg2 for mark in marks if mark.found)
    side = angle_side(prepared, driven=driven, model=model, added_variance=added, doubted=doubted)
    angle = judge(
        prepared, side, effects, driven=driven, beside=valve.side if valve is not None and not driven else None
    )
    return _doubting_conspiracies(Findings(prepared, valve, angle, marks, model, as_read))


def _sparing(findings: Findings, with_valves: Callable[[Judged], Findings]) -> Findings:
    """The same, or with another of the names that the pressures cannot tell apart, if that one leaves the angle without
    a gap where the likeliest needs a second cause there."""
    valve = findings.valve
    if valve is None or len(valve.accepted) != 1 or not findings.angle.accepted:
        return findings
    notes = findings.prepared.pairing.notes
    for candidate in valve.ranking:
        known = candidate.effect.name in valve.names and candidate is not valve.accepted[0]
        if known and not leaves_too_much([candidate], valve.side):
            told = list(notes)
            spared = with_valves(preferring(candidate, valve))
            if not spared.angle.trigger.found:
                return spared
            notes[:] = told
    return findings


def _doubting_conspiracies(findings: Findings) -> Findings:
    """Causes that all but undo each other in the angle, or more of them than are likely at once, leave room for one
    that is unknown."""
    causes = findings.applied
    if len(causes) < 2 or not findings.angle.accepted:
        return findings
    names = ", ".join(cause.effect for cause in causes)
    if _coherence(findings.prepared, causes) < UNDOING:
        doubt = f"{names} all but undo each other in the angle"
    elif len(causes) > MOST_CAUSES:
        doubt = f"{names}: so many at once are seldom"
    else:
        return findings
    findings.prepared.pairing.notes.append(f"{doubt}; one effect that the library does not hold would look the same")
    return replace(findings, angle=replace(findings.angle, remainder=True))


def _coherence(prepared: Prepared, causes: Sequence[Applied]) -> float:
    """What causes do to the angle together, over what they would do if they had nothing to do with each other; 0 when
    they undo each other."""
    healthy = np.concatenate(overall_gap(prepared, []))
    together = square_sum(healthy - np.concatenate(overall_gap(prepared, causes)))
    apart = sum(square_sum(healthy - np.concatenate(overall_gap(prepared, [cause]))) for cause in causes)
    return float(np.sqrt(together / max(apart, 1e-12)))


def _misread(prepared: Prepared, valve: Judged) -> Judged:
    """The valve side taken for its monitors' own error, and a note of it."""
    offsets = 1e3 * valve.side.free_sizes(valve.side.gap)[[0, 3]]
    prepared.pairing.notes.append(
        f"the monitors read {offsets[0]:+.1f} and {offsets[1]:+.1f} kPa off the reference, and the angle does not "
        "follow: "
        "taken for their own error"
    )
    return untriggered(valve)


def _misled(findings: Findings) -> bool:
    """Whether a faint cause in the pressures makes the angle plainly worse: then the monitors are off, and not the
    pressures."""
    valve, angle = findings.valve, findings.angle
    if valve is None or not valve.accepted or not faint(valve):
        return False
    others = [candidate.applied for candidate in angle.accepted]
    with_it, without = (
        angle.side.rms(np.concatenate(overall_gap(findings.prepared, causes))) for causes in (findings.applied, others)
    )
    return with_it > 1.2 * angle.side.floor and without < WORSENED * with_it


def _without_lost(prepared: Prepared, model: Model | None, pressures: bool) -> Prepared:
    """Prepared anew with the case's lost samples bridged, in the baselines as well."""
    lost = [lost_rows(pair.raw) for pair in prepared.pairs]
    count = len(prepared.pairs[0].raw_baselines)
    records = [bridged(pair.raw, rows) for pair, rows in zip(prepared.pairs, lost, strict=True)]
    days = [
        [bridged(pair.raw_baselines[k], rows) for pair, rows in zip(prepared.pairs, lost, strict=True)]
        for k in range(count)
    ]
    return prepare(model, records, days, pressures)
