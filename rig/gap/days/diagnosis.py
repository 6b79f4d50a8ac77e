"""From findings to the diagnosis: the verdict, the causes with their numbers, the shares, the ranking.

What is there is found in `rig.gap.days.findings`; here it is put into words and numbers.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.gap.answer.augment import helping, noise_fraction, remaining_gap, tuned
from rig.gap.answer.chain import chain
from rig.gap.answer.result import Cause, Diagnosis, Ranked
from rig.gap.answer.where import frequency_shares, over_time, phase_shares, region_shares
from rig.gap.days.attribute import Candidate
from rig.gap.days.causes import marks_of, name_causes, trust
from rig.gap.days.engine import angle_side, overall_gap
from rig.gap.days.findings import Findings, find
from rig.gap.days.prepared import Judged, Prepared
from rig.gap.days.side import Side
from rig.gap.days.verdict import explained
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.hypotheses.propagate import Applied, full_numbers
from rig.gap.hypotheses.scenes import ANGLE, PRESSURES
from rig.gap.plan.candidates import room_within
from rig.gap.plan.next_experiment import Hypothesis, next_experiment
from rig.gap.plan.rehearse import known_by
from rig.gap.settings import fitted
from rig.identify.descent import square_sum
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.parameters import Model
from rig.record import Column, Record

SPOILING = 0.5
"""What remains of the confidence in a cause that the simulator speaks against."""
ROUGHLY = 0.1
"""How surely a candidate's numbers are known, as a share: what rivals may be refitted within by the next experiment."""
MOST_EXPLAINED = 1.25
"""An explained fraction above 1 says that less than the floor is left: the case's day was a quiet one."""


def diagnose_days(
    model: Model | None,
    records: Sequence[Record],
    baselines: Sequence[Sequence[Record]],
    *,
    pressures: bool = True,
    library: Sequence[str] | None = None,
) -> tuple[Diagnosis, Findings]:
    """Where the gap between rig and healthy sessions lies, which effect causes it and how far it shrinks with that
    effect added.

    `baselines` holds one list of records a session of the healthy rig. `library` limits the effects by name.
    Raises RecordError when no record can be used, ModelError when there is nothing to compare with.
    """
    findings = find(model, records, baselines, pressures, library)
    return _told(findings), findings


def _told(findings: Findings) -> Diagnosis:
    prepared, valve, angle, marks = findings.prepared, findings.valve, findings.angle, findings.signatures
    undriven = (
        angle_side(prepared, driven=False, model=None) if valve is not None and valve.trigger.found else angle.side
    )
    before = undriven.rms(np.concatenate(overall_gap(prepared, [])))
    kept = helping(findings.simulator, findings.applied, prepared)
    added = tuned(findings.simulator, kept, [findings.size_of(cause) for cause in kept], prepared)
    causes = [_unless_spoiling(cause, added, prepared) for cause in name_causes(findings, before, undriven.floor)]
    open_sides = [judged for judged in findings.sides if judged.open]
    named = [cause for cause in causes if cause.effect != "unknown"]
    verdict = _verdict(bool(named), bool(open_sides or findings.strange))
    gaps, remaining = overall_gap(prepared, []), remaining_gap(findings.simulator, added, prepared)
    after = _after(findings, undriven.rms(np.concatenate(remaining)))
    gap = {
        "rms_deg": before,
        "floor_deg": undriven.floor,
        "ratio": before / undriven.floor,
        "explained_fraction": _fraction(findings, before, after, undriven.floor) if named else 0.0,
        "after_deg": after,
        "floor_source": undriven.source,
    }
    ranking = _ranking(findings)
    healthy = [track.reference.angle_deg for track in prepared.tracks]
    where = {
        "stage": _stage(causes, valve),
        "shares": _shares(findings),
        "chain": chain(causes, after if named else before, undriven.floor),
        "frequency": frequency_shares(prepared.pairs, gaps),
        "phase": phase_shares(prepared.pairs, healthy, gaps),
        "region": region_shares(prepared.pairs, healthy, gaps),
        "time": over_time(prepared.pairs, gaps),
    }
    evidence = {
        "triggers": {judged.side.name: _trigger_facts(judged) for judged in findings.sides},
        "signatures": [mark.to_json() for mark in marks],
        "records": _per_record(prepared, gaps, remaining),
        "sessions": len(prepared.pairs[0].sessions),
        "pressures_used": prepared.pairing.pressures,
        "unpaired": prepared.pairing.unpaired,
        "pairing": [match.to_json() for match in prepared.pairing.matches],
        "reidentification": _hidden(undriven),
        "model_misfit_deg": findings.model_misfit_deg,
    }
    return Diagnosis(
        verdict,
        _confidence(causes, findings.sides, prepared),
        gap,
        where,
        causes,
        ranking,
        _next(findings, causes),
        evidence,
        list(
            dict.fromkeys(
                [
                    *prepared.pairing.notes,
                    *(f"{mark.text}: no effect of the library does that" for mark in findings.strange),
                ]
            )
        ),
        observations=marks_of(findings, before).observations,
    )


def _unless_spoiling(cause: Cause, added: Sequence[Applied], prepared: Prepared) -> Cause:
    """The cause, or without what would be added to the simulator where that makes it worse; said when so."""
    if cause.applied is None or cause.side == "signature":
        return cause
    mine = next((one for one in added if one.stage == cause.applied.stage), None)
    if mine is not None:
        return replace(cause, applied=Applied(mine.stage, full_numbers(mine, prepared.nominal)))
    prepared.pairing.notes.append(
        f"with {cause.effect} in it the simulator would follow these records worse: named, but not added to it, and "
        "less sure"
    )
    return replace(cause, applied=None, confidence=SPOILING * cause.confidence)


def _fraction(findings: Findings, before: float, after: float, floor: float) -> float:
    """Explained fraction of the angle gap; of the noise where signatures alone explain; of the side's own gap where the
    angle has none (a gain of both valves)."""
    accepted = [judged.fraction for judged in findings.sides if judged.accepted]
    named = [mark for mark in findings.signatures if mark.found and mark.effect]
    marked = [Applied(str(mark.effect), mark.numbers) for mark in named if mark.effect != "sensor_dropout"]
    if named and not accepted and not marked:
        return 1.0  # fallen samples are taken out of the records, and nothing else is there
    if marked and not accepted:
        return noise_fraction(findings.simulator, marked, findings.as_read)
    if before > 1.2 * floor:
        return explained(before, after, floor, most=MOST_EXPLAINED)
    return max(accepted, default=1.0)


def _hidden(side: Side) -> dict[str, object]:
    """What re-tuning the nominal model (its offset, gain, lag and loop width) to the case could hide of the angle gap;
    never ranked by."""
    sizes = side.free_sizes(side.gap)
    share = 1.0 - (side.rms(side.gap - side.modes @ sizes) / max(side.rms(side.gap), 1e-12)) ** 2
    offset, gain, lag, loop = (float(size) for size in sizes)
    text = (
        f"Re-tuning offset ({offset:+.2g} deg), gain ({100 * gain:+.1f} %), lag ({1e3 * lag:+.1f} ms) and loop width "
        f"({100 * loop:+.0f} %) "
        f"of the model to these records would hide {100 * share:.0f} % of the gap, and with it the cause."
    )
    return {"hidden_share": share, "offset_deg": offset, "gain": gain, "lag_s": lag, "loop_width": loop, "text": text}


def _per_record(prepared: Prepared, before: Sequence[Column], after: Sequence[Column]) -> list[dict[str, object]]:
    """Gap of each record before and after the causes are added."""

    def rms(gap: Column, used: Column) -> float:
        return float(np.sqrt(square_sum(gap) / max(float(used.sum()), 1.0)))

    return [
        {"record": pair.name, "gap_before_deg": rms(gap, pair.used), "gap_after_deg": rms(left, pair.used)}
        for pair, gap, left in zip(prepared.pairs, before, after, strict=True)
    ]


def _next(findings: Findings, causes: Sequence[Cause]) -> dict[str, object] | None:
    """The experiment that best tells apart what is still possible for each uncertain cause."""
    possible = [
        Hypothesis(
            PRESSURES if judged.side.name == "valve" else ANGLE,
            candidate.applied,
            1.0 / len(tied),
            {name: ROUGHLY * abs(candidate.applied.numbers[name]) for name in candidate.law.free},
        )
        for judged in findings.sides
        if len(tied := _tied(judged, causes)) > 1
        for candidate in tied
    ]
    nominal, tracks = findings.prepared.nominal, findings.prepared.tracks
    rig = known_by(nominal, tracks, pressures=findings.valve is not None)
    found = next_experiment(possible, rig, room_within(tracks), fitted())
    return None if found is None else found.to_json()


def _tied(judged: Judged, causes: Sequence[Cause]) -> list[Candidate]:
    """The candidates of a side between which its cause is uncertain, the likeliest first."""
    if not judged.trigger.found or not judged.ranking:
        return []
    own = [cause for cause in causes if cause.side == judged.side.name]
    named = bool(own) and own[0].effect != "unknown"
    names = judged.names if named else [candidate.effect.name for candidate in judged.ranking[:2]]
    return [candidate for candidate in judged.ranking if candidate.effect.name in names][:4]


def _verdict(named: bool, open_side: bool) -> str:
    if not named:
        return "unknown" if open_side else "none"
    return "partly_explained" if open_side else "explained"


def _after(findings: Findings, left_deg: float) -> float:
    """Rms of the angle gap that all causes leave, on held-out records, what the signatures explain taken off."""
    ratio = max((_held_out_ratio(candidate, findings) for candidate in findings.accepted), default=1.0)
    explained_marks = sum(mark.smoothed_deg2 for mark in findings.signatures if mark.found and mark.effect)
    return float(np.sqrt(max((left_deg * ratio) ** 2 - explained_marks, 0.0)))


def _held_out_ratio(candidate: Candidate, findings: Findings) -> float:
    """How much more a cause leaves on held-out records than on those it was fitted to."""
    judged = findings.angle if candidate in findings.angle.accepted else findings.valve
    assert judged is not None
    fitted = judged.side.rms(judged.side.beside(candidate.residual))
    return float(np.clip(candidate.left / max(fitted, 1e-12), 1.0, 2.0))


def _ranking(findings: Findings) -> list[Ranked]:
    """All candidates of both sides, and the signatures; by probability."""
    lines = [
        Ranked(mark.effect, LIBRARY[mark.effect].stage, "signature", 1.0, mark.confidence, 0.0)
        for mark in findings.signatures
        if mark.found and mark.effect
    ]
    for judged in findings.sides:
        before = judged.side.rms(judged.side.gap)
        for candidate, chance in zip(judged.ranking, judged.chances, strict=True):
            fraction = explained(before, judged.side.rms(candidate.residual), judged.side.floor)
            lines.append(
                Ranked(
                    candidate.effect.name,
                    EFFECT_STAGES[candidate.applied.stage].lies_in,
                    judged.side.name,
                    fraction,
                    chance,
                    candidate.score,
                )
            )
    return sorted(lines, key=lambda line: -line.probability)


def _shares(findings: Findings) -> dict[str, float]:
    """Shares of the angle gap's mean square that come through the valves and from behind them; they add up to 1."""
    if findings.valve is None:
        return {}
    prepared, side = findings.prepared, findings.angle.side
    if not findings.valve.trigger.found:
        return {"valve": 0.0, "downstream": 1.0} if findings.angle.trigger.found else {}
    healthy = np.concatenate([track.reference.angle_deg for track in prepared.tracks])
    measured = np.concatenate([pair.case.angle_deg for pair in prepared.pairs])
    used = np.concatenate([pair.used for pair in prepared.pairs])
    behind = max(side.rms(side.gap) ** 2 - side.floor**2, 0.0)
    through: Column = (measured - healthy) * used - side.gap
    ahead = side.rms(through) ** 2
    total = max(ahead + behind, 1e-12)
    return {"valve": ahead / total, "downstream": behind / total}


def _stage(causes: Sequence[Cause], valve: Judged | None) -> str | None:
    return causes[0].stage if causes else None


def _trigger_facts(judged: Judged) -> dict[str, object]:
    return {
        "gap": judged.side.rms(judged.side.gap),
        "floor": judged.side.floor,
        "unit": judged.side.unit,
        "found": judged.trigger.found,
        "structure_ratio": judged.trigger.structure,
        "mode_scores": judged.trigger.scores.tolist(),
        "threshold": judged.trigger.threshold,
        "explained_fraction": judged.fraction,
        "floor_source": judged.side.source,
    }


def _confidence(causes: Sequence[Cause], sides: Sequence[Judged], prepared: Prepared) -> float:
    """Probability that the names are right; for none, that there is nothing."""
    if causes:
        return min(cause.confidence for cause in causes)
    closest = max((judged.trigger.strength for judged in sides), default=0.0)
    return trust(prepared) * float(np.clip(1.0 - 0.5 * closest**2, 0.5, 0.99))
