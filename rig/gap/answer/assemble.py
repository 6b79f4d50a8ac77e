"""From the posterior to the answer: verdict, causes, where, how far, what cannot be told."""

from collections.abc import Sequence
from dataclasses import replace

from rig.gap.answer.chain import chain
from rig.gap.answer.facts import RAW_DATA, SIGNATURE, Gap, Verdict, Where
from rig.gap.answer.findings import Findings, Kept, evidence_of
from rig.gap.answer.floor import floor_of
from rig.gap.answer.gap_size import gap_of, predicted
from rig.gap.answer.how_far.held_out import HowFar, how_far
from rig.gap.answer.how_far.size_intervals import intervals, reference_of
from rig.gap.answer.kept_effects import dropped_effects, kept_effects, share_closed
from rig.gap.answer.observations import (
    judged_signatures,
    of_monitors_alone,
    stuck_monitors,
    usual_of_a_simulator,
)
from rig.gap.answer.result import Cause, Diagnosis, Observation, Ranked
from rig.gap.answer.smoothed_gap import SmoothedGap
from rig.gap.answer.sureness import confidence_of, doubts_of, right_of_each, trust
from rig.gap.answer.unknowns import unknown_cause, unknowns
from rig.gap.answer.where import frequency_shares, over_time, phase_shares, region_shares
from rig.gap.hypotheses.fit import Fit
from rig.gap.hypotheses.inverse_problems import PRESSURES
from rig.gap.raw_tests.signature import Signature
from rig.gap.records.pairs import Pairing
from rig.gap.reference.gaps import commanded_gaps, from_own_zeros, rms_of
from rig.gap.response.causes import Applied, full_numbers
from rig.gap.settings import EITHER_CHANCE, EVEN_CHANCE
from rig.record import Column

IN_TURN = (
    "the records do not say when they began: they are taken one after the other, as their files are numbered, so that "
    "a rate is one per minute of record; with pauses between them it is smaller"
)


def assemble(findings: Findings) -> Diagnosis:
    """The diagnosis, without what to record next."""
    gaps, floor = commanded_gaps(findings.expected), floor_of(findings.expected, findings.settings)
    gap_deg = rms_of(gaps, findings.expected.pairs)
    kept, far = _kept_and_how_far(findings, gap_deg)
    added = bool(kept) and far.after_deg <= gap_deg
    smoothed = SmoothedGap(gap_deg, far.after_deg if added else gap_deg, floor.deg)
    unknown = unknowns(findings, kept, smoothed)
    in_samples = judged_signatures(findings.signatures, findings.expected, gap_deg, bool(kept or unknown.causes))
    strange = [unknown_cause("sensor", RAW_DATA, gap_deg) for _ in _strange(findings)]
    causes = [*_causes(findings, kept, gap_deg, far, added), *in_samples.causes, *unknown.causes, *strange]
    causes = [_doubted(findings.expected.pairing, cause) for cause in causes]
    raw = [cause for cause in causes if cause.judged_on == SIGNATURE]
    interval_deg = predicted(kept, smoothed, far, findings.settings) if added else None
    gap = gap_of(findings, causes, kept, smoothed, interval_deg)
    return Diagnosis(
        _verdict(causes),
        confidence_of(findings, kept, raw, doubted=len(unknown.below_floor) + len(unknown.by_degrees) + len(strange)),
        gap,
        _where(findings, causes, gaps, gap),
        causes,
        _ranking(findings, raw),
        evidence=evidence_of(findings, right_of_each(findings, kept), gaps, far, added),
        notes=_notes(findings, kept, [*floor.notes, *unknown.notes(kept)]),
        doubts=findings.expected.pairing.doubts,
        reference=findings.expected.kind,
        retuning=findings.retuning,
        observations=[*_of_monitors(findings), *in_samples.observations, *_usual(findings)],
    )


def _kept_and_how_far(findings: Findings, gap_deg: float) -> tuple[list[Kept], HowFar]:
    """The effects that are named, and how far the gap (rms) shrinks with them. None where all act behind the monitors
    and explain nothing of records that the fit has not seen."""

    def after(causes: Sequence[tuple[str, Fit]]) -> HowFar:
        return how_far(causes, findings.expected, findings.simulator, findings.settings)

    kept = kept_effects(findings, gap_deg)
    far = after([(each.posterior.problem.name, each.fit) for each in kept])
    if far.after_deg > gap_deg and all(each.posterior.problem.name != PRESSURES for each in kept):
        return [], after([])
    return kept, far


def _of_monitors(findings: Findings) -> list[Observation]:
    """Monitors that stood still for a while, and monitors that the joint does not follow."""
    stuck = stuck_monitors(findings.expected.pairing.stuck)
    alone = [one for one in findings.posteriors if one.monitors_alone > EVEN_CHANCE]
    return [*stuck, *map(of_monitors_alone, alone)]


def _usual(findings: Findings) -> list[Observation]:
    """What is there as large as a simulator usually lacks it of a healthy rig, and is no gap."""
    return [
        usual_of_a_simulator(
            posterior.fits[posterior.usual.effect],
            posterior.usual.probability,
            share_closed(posterior, posterior.fits[posterior.usual.effect]),
            findings.settings.reach_of(reference_of(findings.expected.kind)),
        )
        for posterior in findings.posteriors
        if posterior.usual is not None
    ]


def _notes(findings: Findings, kept: Sequence[Kept], remarks: Sequence[str]) -> list[str]:
    """What doubts the whole comparison, the `remarks` of the steps, what the raw samples show that has no name, and the
    names that were dropped; each line once."""
    nameless = (f"{signature.text}: no effect of the library does that" for signature in _strange(findings))
    dropped = (
        f"{fit.effect.name} explains {100.0 * share_closed(posterior, fit):.0f} % of what the "
        f"{'pressures show' if posterior.problem.name == PRESSURES else 'angle shows'}, but with it the simulator "
        "follows these records no better: it may act, and the simulator miss more than that by itself"
        for posterior, fit in dropped_effects(findings, kept)
    )
    numbered = findings.expected.pairing.numbered and any(each.fit.law.whole_session for each in kept)
    in_turn = [IN_TURN] if numbered else []
    pairing = findings.expected.pairing
    return list(dict.fromkeys([*pairing.doubts, *pairing.notes, *remarks, *nameless, *dropped, *in_turn]))


def _strange(findings: Findings) -> list[Signature]:
    """What the raw samples show in the angle that the library has no name for."""
    return [each for each in findings.signatures if each.found and each.effect is None and each.variance_deg2 > 0.0]


def _causes(findings: Findings, kept: Sequence[Kept], gap_deg: float, far: HowFar, added: bool) -> list[Cause]:
    """The named effects, the one that closes most first; where not `added`, none goes into the simulator."""
    found = []
    for each in kept:
        posterior, fit = each.posterior, each.fit
        after_deg = far.after_deg if len(kept) == 1 else each.alone_deg
        others = tuple(name for name in posterior.names if name in posterior.fits and name != fit.effect.name)
        found.append(
            Cause(
                fit.effect.name,
                fit.effect.stage,
                posterior.problem.name,
                Applied(fit.applied.stage, full_numbers(fit.applied, findings.expected.response)) if added else None,
                intervals(fit, findings.settings.reach_of(reference_of(findings.expected.kind))),
                gap_deg,
                min(after_deg, gap_deg) if added else gap_deg,
                share_closed(posterior, fit),
                others,
                posterior.probability[fit.effect.name] * trust(findings.expected.pairing, fit.effect.name),
            )
        )
    return sorted(found, key=lambda cause: cause.gap_after_deg)


def _doubted(pairing: Pairing, cause: Cause) -> Cause:
    """The cause with the notes that take it back, and no surer than they leave it."""
    notes = doubts_of(pairing, cause.effect)
    return replace(cause, confidence=min(cause.confidence, EITHER_CHANCE), doubted_by=notes) if notes else cause


def _verdict(causes: Sequence[Cause]) -> Verdict:
    named = any(cause.is_named for cause in causes)
    unknown = not all(cause.is_named for cause in causes)
    if not named:
        return Verdict.UNKNOWN if unknown else Verdict.NONE
    return Verdict.PARTLY_EXPLAINED if unknown else Verdict.EXPLAINED


def _where(findings: Findings, causes: Sequence[Cause], gaps: Sequence[Column], gap: Gap) -> Where:
    pairs = findings.expected.pairs
    healthy = [context.reference.angle_deg for context in findings.expected.contexts]
    return Where(
        causes[0].stage if causes else None,
        shares=_shares(findings),
        chain=chain(causes, gap.after_deg, gap.floor_deg),
        frequency=frequency_shares(pairs, gaps),
        phase=phase_shares(pairs, healthy, gaps),
        region=region_shares(pairs, healthy, gaps),
        time=over_time(pairs, gaps),
    )


def _shares(findings: Findings) -> dict[str, float]:
    """Shares of the angle gap's mean square that come through the pressures and from behind them; empty from the angle
    alone."""
    if findings.pressures is None:
        return {}
    pairs, expected = findings.expected.pairs, findings.expected
    through = [
        base - context.reference.angle_deg for base, context in zip(expected.base, expected.contexts, strict=True)
    ]
    behind = [pair.case.angle_deg - base for pair, base in zip(pairs, expected.base, strict=True)]
    ahead, after = (rms_of(from_own_zeros(some, expected), pairs) ** 2 for some in (through, behind))
    return {"valve": ahead / max(ahead + after, 1e-12), "downstream": after / max(ahead + after, 1e-12)}


def _ranking(findings: Findings, raw: Sequence[Cause]) -> list[Ranked]:
    """What the raw samples show and all effects of both factors, by probability."""
    lines = [
        Ranked(cause.effect, cause.stage, cause.judged_on, cause.explained_fraction, cause.confidence, 0.0)
        for cause in raw
    ]
    for posterior in findings.posteriors:
        for name, fit in posterior.fits.items():
            chance, closed = posterior.probability[name], share_closed(posterior, fit)
            lines.append(Ranked(name, fit.effect.stage, posterior.problem.name, closed, chance, -fit.log_evidence))
    return sorted(lines, key=lambda line: -line.probability)
