"""The steps of a diagnosis by one likelihood, in their order: pair, test the raw samples, expect, judge, re-tune,
answer.

The same for every reference: earlier days, a fingerprint, the simulator alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rig.channels import REST_MPA
from rig.errors import RecordError
from rig.gap.answer.assemble import assemble
from rig.gap.answer.findings import Findings
from rig.gap.answer.how_far.retuning import EffectChange, retune
from rig.gap.answer.result import Diagnosis
from rig.gap.both_factors import BothFactors
from rig.gap.evidence.posterior import Posterior
from rig.gap.hypotheses.inverse_problems import PRESSURES
from rig.gap.hypotheses.library import Effect, chosen
from rig.gap.plan.next_experiment import what_next
from rig.gap.question import Question
from rig.gap.raw_tests.all_tests import read_signatures
from rig.gap.raw_tests.converter_codes import ConverterCode, centred
from rig.gap.raw_tests.lost_samples import lost_samples, without_lost
from rig.gap.raw_tests.quantisation import code_found
from rig.gap.raw_tests.signature import Signature
from rig.gap.records.fingerprint_records import pair_with_kept
from rig.gap.records.pairs import Pair, Pairing, pair_up
from rig.gap.reference.build import expect
from rig.gap.reference.expected import Expected
from rig.gap.reference.gaps import commanded_gaps
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.reference.known_noise import known_noise
from rig.gap.reference.simulated import at_rest, misfit_deg
from rig.gap.settings import ANOTHER_RIG
from rig.model.fingerprint import Fingerprint
from rig.model.parameters import Model
from rig.record import Record


@dataclass(frozen=True)
class Grounds:
    """What an answer rests on, for the words, the pictures and the augmented model."""

    simulator: Model | None
    expected: Expected
    posteriors: tuple[Posterior, ...]


Repair = Callable[[Record], Record]
"""Takes out of a record what its raw samples show."""


def answer(question: Question) -> tuple[Diagnosis, Grounds]:
    """The diagnosis with what it rests on. RecordError and ModelError when there is nothing to compare with."""
    settings = question.settings
    signatures, expected, weighed = weigh(question)
    posteriors = tuple(one.at(settings.prior.temperature) for one in weighed)
    simulator = None if question.model is None else at_rest(question.model, expected.pairing)
    missed = None if simulator is None or not question.kind.by_days else _misfit_deg(simulator, expected)
    if missed is not None and (strange := _of_another_rig(missed, expected)):
        simulator, expected = None, replace(expected, pairing=replace(expected.pairing, strange=(strange,)))
    refit = None
    if simulator is not None and not question.kind.by_days:  # what has changed is no matter of the simulator's
        refit = retune(simulator, expected.pairs, expected.driven, _effect_changes(expected, posteriors))
    grounds = Grounds(simulator, expected, posteriors)

    findings = Findings(
        expected=expected,
        simulator=simulator,
        posteriors=posteriors,
        signatures=signatures,
        retuning=None if refit is None else refit.retuning,
        settings=settings,
        misfit_deg=missed,
        limited=bool(question.withheld),
    )
    planned = what_next(expected, posteriors, question.envelope, settings=settings, simulator=simulator)
    return replace(assemble(findings), next_experiment=planned), grounds


def _effect_changes(expected: Expected, posteriors: Sequence[Posterior]) -> dict[str, EffectChange]:
    """What each effect changes, as it fits best by itself: behind the monitors where it was judged on both factors."""
    ahead, behind = posteriors[0], posteriors[-1]
    found = {}
    if ahead.problem.name == PRESSURES:
        healthy = np.concatenate(commanded_gaps(expected))
        for name, fit in ahead.fits.items():
            p1, p2 = np.split(fit.change, 2)
            angle = healthy - np.concatenate(commanded_gaps(expected, [fit.applied]))
            found[name] = EffectChange(angle, (p1, p2))
    return found | {name: EffectChange(fit.change) for name, fit in behind.fits.items()}


def weigh(question: Question) -> tuple[list[Signature], Expected, tuple[Posterior, ...]]:
    """What the raw samples show, what is expected, and the hypotheses that compete to explain the rest, weighed by the
    whole evidence (at a temperature of 1). RecordError and ModelError as `answer`."""
    effects = chosen(question.library)
    pairing = _paired(question, question.records, question.days)
    angles = [pair.case.angle_deg for pair in pairing.pairs]
    noise = known_noise(question.kind, question.model, question.settings.noise, angles)
    signatures = _named_only(read_signatures(pairing.pairs, noise), effects)
    expected = expect(question.kind, question.sister, question.model, _repaired(question, pairing, signatures))
    expected = replace(
        expected,
        signatures_deg2=sum(signature.smoothed_deg2 for signature in signatures if signature.found),
        step_deg=code_found(signatures)[0],
        known_hz=question.known_hz,
    )
    fitting = [effect for effect in effects if not effect.signature]
    return signatures, *BothFactors(question, fitting).judged(expected)


def _repaired(question: Question, pairing: Pairing, signatures: Sequence[Signature]) -> Pairing:
    """The pairs without what the raw-data tests found in their samples: lost samples are bridged, in the earlier days
    as well, and readings of a converter that cuts off are put into the middle of their codes."""
    step_deg, code = code_found(signatures)
    lost = any(signature.found and signature.effect == "lost_samples" for signature in signatures)
    if not lost and code is ConverterCode.NEAREST:
        return pairing
    bridges = [_bridge(pair) if lost else _same for pair in pairing.pairs]
    centre = _same if code is ConverterCode.NEAREST else partial(centred, step_deg=step_deg, code=code)
    return paired_anew(question, pairing, [_both(centre, bridge) for bridge in bridges], bridges)


def _fingerprint(question: Question) -> Fingerprint | None:
    """The model's, where it is the reference."""
    if question.model is None or question.kind is not ReferenceKind.FINGERPRINT:
        return None
    return question.model.fingerprint


def _misfit_deg(model: Model, expected: Expected) -> float | None:
    return misfit_deg(model, expected.pairs, [context.reference.angle_deg for context in expected.contexts])


def _of_another_rig(missed_deg: float, expected: Expected) -> str:
    """A note where a model that misses the earlier days by so many degrees does not follow them at all; else none."""
    spread = float(np.std(np.concatenate([context.reference.angle_deg for context in expected.contexts])))
    if missed_deg <= ANOTHER_RIG * spread:
        return ""
    return (
        f"the model misses the earlier days by {missed_deg:.2g} deg, {100 * missed_deg / spread:.0f} % of their "
        "spread: another rig's? How far the gap shrinks is by the description of those days, not by this model"
    )


def _paired(question: Question, records: Sequence[Record], days: Sequence[Sequence[Record]]) -> Pairing:
    p0_mpa = question.model.p0_mpa if question.model else REST_MPA
    if not question.kind.by_days:
        return pair_with_kept(records, _fingerprint(question), p0_mpa, pressures=question.pressures)
    pairing = pair_up(records, days, p0_mpa, pressures=question.pressures)
    if not pairing.pairs[0].days:
        raise RecordError(f"--baseline: pairs with no record: {'; '.join(pairing.notes) or 'other sweeps'}")
    return pairing


def _named_only(signatures: Sequence[Signature], effects: Sequence[Effect]) -> list[Signature]:
    """The signatures; those whose effect the library at hand does not hold stay without a name."""
    known = {effect.name for effect in effects}
    return [
        signature if signature.effect is None or signature.effect in known else replace(signature, effect=None)
        for signature in signatures
    ]


def _bridge(pair: Pair) -> Repair:
    """Over the case's lost samples, in the days beside it as well."""
    return partial(without_lost, lost=lost_samples(pair.raw))


def paired_anew(question: Question, pairing: Pairing, of_case: Sequence[Repair], of_days: Sequence[Repair]) -> Pairing:
    """Paired anew with repaired records (`of_case` and `of_days`: a repair for each pair). What the first pairing found
    out stands. The first pairing where the repair leaves a record that cannot be used any more: straight lines over
    nearly all rows of a sensor that hardly ever changes show nothing of it."""
    pairs = pairing.pairs
    records = [repair(pair.raw) for pair, repair in zip(pairs, of_case, strict=True)]
    days = [
        [repair(pair.raw_days[k]) for pair, repair in zip(pairs, of_days, strict=True)]
        for k in range(len(pairs[0].raw_days))
    ]
    try:
        anew = _paired(question, records, days)
    except RecordError:
        return pairing
    if [pair.name for pair in anew.pairs] != [pair.name for pair in pairs] or anew.day_count != pairing.day_count:
        return pairing
    kept = [
        replace(pair, dropouts=was.dropouts, day_dropouts=was.day_dropouts, day_numbers=was.day_numbers)
        for pair, was in zip(anew.pairs, pairs, strict=True)
    ]
    new_notes = [line for line in anew.notes if line not in pairing.notes]
    return replace(pairing, pairs=kept, pressures=anew.pressures).noting(*new_notes)


def _same(record: Record) -> Record:
    return record


def _both(first: Repair, then: Repair) -> Repair:
    return lambda record: then(first(record))
