"""From the posterior to the answer: verdict, causes, where, how far, what cannot be told."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np

from rig.gap.answer.chain import chain
from rig.gap.answer.facts import RAW_DATA, SIGNATURE, Gap, Verdict, Where
from rig.gap.answer.findings import Findings, Kept, evidence_of
from rig.gap.answer.floor import floor_of, floor_source
from rig.gap.answer.how_far.held_out import HowFar
from rig.gap.answer.how_far.prediction_interval import Shrunk, prediction_interval
from rig.gap.answer.how_far.size_intervals import intervals, reference_of
from rig.gap.answer.kept import dropped_effects, effects_not_kept, kept_effects, share_closed
from rig.gap.answer.observations import judged_signatures, stuck_monitors, usual_of_a_simulator
from rig.gap.answer.result import Cause, Diagnosis, Observation, Ranked
from rig.gap.answer.where import frequency_shares, over_time, phase_shares, region_shares
from rig.gap.evidence.posterior import Posterior
from rig.gap.hypotheses.fit import Fit
from rig.gap.hypotheses.inverse_problems import ANGLE, PRESSURES
from rig.gap.hypotheses.library import LIBRARY, NONE, UNKNOWN
from rig.gap.plan.next_experiment import what_next
from rig.gap.raw_tests.signature import Signature
from rig.gap.records.pairs import Pairing
from rig.gap.reference.build import Kind, commanded_gaps, from_own_zeros, rms_of
from rig.gap.response.causes import Applied, full_numbers
from rig.gap.settings import ABOVE_FLOOR, EITHER_CHANCE, EVEN_CHANCE, FAR, LEAST_EXPLAINED, Fitted
from rig.record import Column

IN_TURN = (
    "the records do not say when they began: they are taken one after the other, as their files are numbered, so that "
    "a rate is one per minute of record; with pauses between them it is smaller"
)


def tell(findings: Findings, after: Callable[[Sequence[tuple[str, Fit]]], HowFar]) -> Diagnosis:
    """The diagnosis; `after` says how far the gap shrinks with some causes in the simulator."""
    gaps, known = commanded_gaps(findings.expected), floor_of(findings.expected, findings.settings)
    before, floor = rms_of(gaps, findings.expected.pairs), known.deg
    kept, far = _kept_and_how_far(findings, before, after)
    added = bool(kept) and far.after_deg <= before
    left = far.after_deg if added else before
    suspected = _unknowns(findings, kept, before)
    small = _small(findings, suspected, kept, before, left, floor)
    rest = [] if suspected else _rest(kept, before, left, floor)
    rest += _too_far(findings, before, {one.judged_on for one in (*suspected, *rest)})
    unknowns = [*(one for one in suspected if one not in small), *rest]
    in_samples = judged_signatures(findings.signatures, findings.expected, before, bool(kept or unknowns))
    strange = [_unknown("sensor", RAW_DATA, before) for _ in _strange(findings)]
    causes = [*_causes(findings, kept, before, far, added), *in_samples.causes, *unknowns, *strange]
    causes = [_doubted(findings.expected.pairing, cause) for cause in causes]
    raw = [cause for cause in causes if cause.judged_on == SIGNATURE]
    interval = _predicted(kept, before, floor, far, findings.settings) if added else None
    gap = _gap(findings, causes, kept, before, left, floor, interval)
    return Diagnosis(
        _verdict(causes),
        how_sure(findings, kept, raw, doubted=len(small) + len(rest) + len(strange)),
        gap,
        _where(findings, causes, gaps, gap.after_deg, floor),
        causes,
        _ranking(findings, raw),
        what_next(
            findings.expected,
            findings.posteriors,
            findings.envelope,
            settings=findings.settings,
            simulator=findings.simulator,
        ),
        evidence_of(findings, right_of_each(findings, kept), gaps, far, added),
        _notes(findings, kept, [*known.notes, *_small_notes(small, kept, before, floor)]),
        doubts=findings.expected.pairing.doubts,
        reference=findings.expected.kind,
        retuning=findings.retuning,
        observations=[*stuck_monitors(findings.expected.pairing.stuck), *in_samples.observations, *_usual(findings)],
    )


def _kept_and_how_far(
    findings: Findings, before: float, after: Callable[[Sequence[tuple[str, Fit]]], HowFar]
) -> tuple[list[Kept], HowFar]:
    """The effects that are named, and how far the gap (rms in deg, `before`) shrinks with them. None where all act
    behind the monitors and explain nothing of records that the fit has not seen."""
    kept = kept_effects(findings, before)
    far = after([(one.posterior.problem.name, one.fit) for one in kept])
    if far.after_deg > before and all(one.posterior.problem.name != PRESSURES for one in kept):
        return [], after([])
    return kept, far


def _gap(
    findings: Findings,
    causes: Sequence[Cause],
    kept: Sequence[Kept],
    smoothed: float,
    left: float,
    floor: float,
    interval: tuple[float, float] | None,
) -> Gap:
    """The gap where it was found: that of the samples where nothing but these shows it, for it is hardly any when
    `smoothed`. All in deg, rms; `interval` on further records, None where what is `left` holds there too."""
    raw = all(cause.judged_on == SIGNATURE for cause in causes)
    before, after = _gap_of_samples(causes) if causes and raw else (smoothed, left)
    low, high = interval or (after, after)
    named = any(cause.is_named for cause in causes)
    return Gap(
        rms_deg=before,
        floor_deg=floor,
        ratio=before / floor,
        explained_fraction=_explained(kept, before, after, floor) if named else 0.0,
        after_deg=after,
        after_low_deg=low,
        after_high_deg=high,
        floor_source=floor_source(findings.expected),
        smoothed_deg=smoothed,
    )


def _small(
    findings: Findings, suspected: Sequence[Cause], kept: Sequence[Kept], before: float, left: float, floor: float
) -> list[Cause]:
    """Of what is suspected to be something unknown, that which nothing stands above the floor for: where the named
    causes leave no gap (rms in deg: `before` and `left`), or where there was none, and none in what it was found on.
    It is told in the notes, and is no cause; none where nothing is named and it may be an effect that was not asked
    about."""
    above = ABOVE_FLOOR * floor
    if left > above or (findings.limited and not kept):
        return []
    return [one for one in suspected if above < before or not _stands_out(findings, one.judged_on)]


def _small_notes(small: Sequence[Cause], kept: Sequence[Kept], before: float, floor: float) -> list[str]:
    why = "with what is named nothing is left" if ABOVE_FLOOR * floor < before else "nothing stands"
    return [
        f"something small that is not in the library may act{' as well' if kept else ''}, at the {one.stage} "
        f"({100.0 * one.confidence:.0f} %): {why} above the floor"
        for one in small
    ]


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


def _stands_out(findings: Findings, name: str) -> bool:
    """Whether the gap of one factor is above its own floor."""
    factors = (one.plain.factor for one in findings.posteriors if one.problem.name == name)
    return any(factor.rms(factor.gap) > ABOVE_FLOOR * factor.floor for factor in factors)


def _notes(findings: Findings, kept: Sequence[Kept], said: Sequence[str]) -> list[str]:
    """What doubts the whole comparison; what was `said` on the way, what the raw samples show that has no name, and
    the names that were dropped; each line once."""
    nameless = (f"{one.text}: no effect of the library does that" for one in _strange(findings))
    dropped = (
        f"{fit.effect.name} explains {100.0 * share_closed(posterior, fit):.0f} % of what the "
        f"{'pressures show' if posterior.problem.name == PRESSURES else 'angle shows'}, but with it the simulator "
        "follows these records no better: it may act, and the simulator miss more than that by itself"
        for posterior, fit in dropped_effects(findings, kept)
    )
    numbered = findings.expected.pairing.numbered and any(one.fit.law.whole_session for one in kept)
    in_turn = [IN_TURN] if numbered else []
    pairing = findings.expected.pairing
    return list(dict.fromkeys([*pairing.doubts, *pairing.notes, *said, *nameless, *dropped, *in_turn]))


def _predicted(kept: Sequence[Kept], before: float, floor: float, far: HowFar, settings: Fitted) -> tuple[float, float]:
    """Between what rms (deg) further records will lie with the kept effects in the simulator."""
    rho = max(one.fit.effect.roughness(settings.prior, one.fit.law) for one in kept)
    return prediction_interval(Shrunk(before, floor, far.per_record_deg2, rho), settings.prediction)


def _gap_of_samples(raw: Sequence[Cause]) -> tuple[float, float]:
    """Rms of the raw records' gap, deg, with and without what their samples show."""
    before = max(cause.gap_before_deg for cause in raw)
    closed = sum(cause.gap_before_deg**2 - cause.gap_after_deg**2 for cause in raw)
    return before, float(np.sqrt(max(before**2 - closed, 0.0)))


def _strange(findings: Findings) -> list[Signature]:
    """What the raw samples show in the angle that the library has no name for."""
    return [one for one in findings.signatures if one.found and one.effect is None and one.variance_deg2 > 0.0]


def _causes(findings: Findings, kept: Sequence[Kept], before: float, far: HowFar, added: bool) -> list[Cause]:
    """The named effects, the one that closes most first; where not `added`, none goes into the simulator."""
    found = []
    for one in kept:
        posterior, fit = one.posterior, one.fit
        left = far.after_deg if len(kept) == 1 else one.alone_deg
        others = tuple(name for name in posterior.names if name in posterior.fits and name != fit.effect.name)
        found.append(
            Cause(
                fit.effect.name,
                fit.effect.stage,
                posterior.problem.name,
                Applied(fit.applied.stage, full_numbers(fit.applied, findings.expected.response)) if added else None,
                intervals(fit, findings.settings.reach_of(reference_of(findings.expected.kind))),
                before,
                min(left, before) if added else before,
                share_closed(posterior, fit),
                others,
                posterior.probability[fit.effect.name] * trust(findings.expected.pairing, fit.effect.name),
            )
        )
    return sorted(found, key=lambda cause: cause.gap_after_deg)


def trust(pairing: Pairing, name: str) -> float:
    """What is left of an effect's probability where something that is no hypothesis may have done the same: a sensor
    that cuts off its values, another commanded P0."""
    return EITHER_CHANCE if _doubts(pairing, name) else 1.0


def _doubts(pairing: Pairing, name: str) -> tuple[str, ...]:
    """The notes that take a name back by half."""
    if name == NONE:
        return ()
    return pairing.clipped + (pairing.elsewhere if name != UNKNOWN and LIBRARY[name].as_another_p0 else ())


def _doubted(pairing: Pairing, cause: Cause) -> Cause:
    """The cause with the notes that take it back, and no surer than they leave it."""
    notes = _doubts(pairing, cause.effect)
    return replace(cause, confidence=min(cause.confidence, EITHER_CHANCE), doubted_by=notes) if notes else cause


def _unknowns(findings: Findings, kept: Sequence[Kept], before: float) -> list[Cause]:
    """Something unknown for each factor where that is the likeliest, or stands beside the effect."""
    found = []
    left_out = [id(posterior) for posterior, _ in effects_not_kept(findings, kept)]
    dropped = [id(posterior) for posterior, _ in dropped_effects(findings, kept)]
    for posterior in findings.posteriors:
        useless = id(posterior) in left_out
        if posterior.found and (posterior.fit is None or posterior.beside > EVEN_CHANCE or useless):
            near = sorted(posterior.fits, key=lambda name: -posterior.probability[name])[:2]
            chance = posterior.probability[UNKNOWN] if posterior.fit is None else posterior.beside
            chance = 1.0 - posterior.probability[NONE] if useless else chance
            if id(posterior) in dropped:
                chance = min(chance, EITHER_CHANCE)
            found.append(_unknown_on(posterior, before, near, chance))
    return found


def _unknown(
    stage: str, judged_on: str, gap_deg: float, near: Sequence[str] = (), chance: float = EITHER_CHANCE
) -> Cause:
    """Something unknown, which closes nothing of the gap (rms); `near`: what is most like it. Where it has no
    probability of its own it is believed half."""
    return Cause(UNKNOWN, stage, judged_on, None, {}, gap_deg, gap_deg, 0.0, tuple(near), chance)


def _unknown_on(posterior: Posterior, gap_deg: float, near: Sequence[str], chance: float = EITHER_CHANCE) -> Cause:
    """The same on a factor: at the stage of what is nearest, and where that is like no effect ahead of the monitors or
    behind them."""
    factor = posterior.problem.name
    nowhere = "valve" if factor == PRESSURES else "joint"
    stage = posterior.fits[near[0]].effect.stage if near else nowhere
    return _unknown(stage, factor, gap_deg, near, chance)


def _explained(kept: Sequence[Kept], before: float, after: float, floor: float) -> float:
    """(G - E) / (G - F) in mean squares of the angle where it stands above the floor; else of what the causes were
    found on."""
    if not kept:
        return 1.0 - (after / before) ** 2
    if after < before and before > ABOVE_FLOOR * floor:
        return min((before**2 - after**2) / (before**2 - floor**2), 1.0)
    if after < before:
        return 1.0 - (after / before) ** 2
    return 0.0 if after > FAR * floor else max(share_closed(one.posterior, one.fit) for one in kept)


def closes_little(before: float, after: float, floor: float) -> bool:
    """Less than LEAST_EXPLAINED of what stands above the floor, in the degrees that somebody at the rig reads: that
    leaves more unexplained than it explains, however rough a law may be."""
    return before - after < LEAST_EXPLAINED * (before - floor)


def explains_too_little(before: float, after: float, floor: float, share: float) -> bool:
    """Whether effects that take a gap (rms in deg) from `before` to `after` leave something unknown: where they close
    less of it than they leave; or nothing of it, and it is large, or they not even half of what they were found on (the
    least `share` of each)."""
    if after < before:
        return closes_little(before, after, floor)
    return share < LEAST_EXPLAINED or after > FAR * floor


def _rest(kept: Sequence[Kept], before: float, left: float, floor: float) -> list[Cause]:
    """Something unknown that makes up the larger part of a gap: see `explains_too_little`. Where nothing is closed of a
    large one it lies behind the monitors: the pressures are explained."""
    if not kept or left <= ABOVE_FLOOR * floor:
        return []
    share, weakest = min(((share_closed(one.posterior, one.fit), one) for one in kept), key=lambda pair: pair[0])
    if not explains_too_little(before, left, floor, share):
        return []
    first = max(kept, key=lambda one: before - one.alone_deg) if left < before else weakest
    stage, factor = first.fit.effect.stage, first.posterior.problem.name
    if left >= before and share >= LEAST_EXPLAINED:
        stage, factor = "joint", ANGLE
    return [_unknown(stage, factor, before, [first.fit.effect.name])]


def _too_far(findings: Findings, before: float, said: Collection[str]) -> list[Cause]:
    """Something unknown on each factor of which none is `said` yet, although a simulator that differs in all that it
    may still leaves more than FAR floors, with the likeliest effect in it where that is one: its class is missed by so
    much on no healthy rig, and what the likelihood takes for a build that is missed by more than is usual is what a
    simulator lacks (docs/decisions/0661, 0662)."""
    if findings.expected.kind is not Kind.SIMULATOR:
        return []
    judged = {one.problem.name: one for one in findings.posteriors}  # of two effects the second, which knows the first
    return [
        _unknown_on(one, before, [one.best] if one.fit else [])
        for factor, one in judged.items()
        if factor not in said and one.beyond > FAR
    ]


def _verdict(causes: Sequence[Cause]) -> Verdict:
    named = any(cause.is_named for cause in causes)
    unknown = not all(cause.is_named for cause in causes)
    if not named:
        return Verdict.UNKNOWN if unknown else Verdict.NONE
    return Verdict.PARTLY_EXPLAINED if unknown else Verdict.EXPLAINED


def how_sure(findings: Findings, kept: Sequence[Kept], raw: Sequence[Cause], *, doubted: int) -> float:
    """Probability that what is said of every factor is right, of something unknown beside an effect as well. Where the
    likeliest effect was dropped it is that there is something at all. One of two for each that was, and for each of the
    `doubted`: what is said of something unknown because of the degrees that are left, or of the raw samples, and has no
    probability."""
    chances = right_of_each(findings, kept) + [EITHER_CHANCE] * (len(dropped_effects(findings, kept)) + doubted)
    return float(np.prod([*chances, *(cause.confidence for cause in raw)]))


def right_of_each(findings: Findings, kept: Sequence[Kept]) -> list[float]:
    """Probability that what is said of each factor is right: its likeliest hypothesis and what stands beside that, or
    that there is something at all."""
    nameless = [id(posterior) for posterior, _ in dropped_effects(findings, kept)]
    return [
        1.0 - one.probability[NONE]
        if id(one) in nameless
        else one.probability[one.best] * one.sure_beside * trust(findings.expected.pairing, one.best)
        for one in findings.posteriors
    ]


def _where(
    findings: Findings, causes: Sequence[Cause], gaps: Sequence[Column], left_deg: float, floor_deg: float
) -> Where:
    pairs = findings.expected.pairs
    healthy = [context.reference.angle_deg for context in findings.expected.contexts]
    return Where(
        causes[0].stage if causes else None,
        shares=_shares(findings),
        chain=chain(causes, left_deg, floor_deg),
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
    lines = [Ranked(one.effect, one.stage, one.judged_on, one.explained_fraction, one.confidence, 0.0) for one in raw]
    for posterior in findings.posteriors:
        for name, fit in posterior.fits.items():
            chance, closed = posterior.probability[name], share_closed(posterior, fit)
            lines.append(Ranked(name, fit.effect.stage, posterior.problem.name, closed, chance, -fit.log_evidence))
    return sorted(lines, key=lambda line: -line.probability)
