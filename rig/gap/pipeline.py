"""The steps of a diagnosis by one likelihood, in their order: pair, test the raw samples, expect, judge, re-tune,
answer.

The same for every reference: earlier days, a fingerprint, the simulator alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.gap.answer.assemble import assemble
from rig.gap.answer.findings import Findings
from rig.gap.answer.how_far.retuning import EffectChange, retune
from rig.gap.answer.result import Diagnosis
from rig.gap.both_factors import BothFactors
from rig.gap.evidence.posterior import Posterior
from rig.gap.hypotheses.inverse_problems import PRESSURES
from rig.gap.hypotheses.library import Effect, chosen
from rig.gap.pairing import paired, paired_without_artefacts
from rig.gap.plan.next_experiment import what_next
from rig.gap.question import Question
from rig.gap.raw_tests.all_tests import read_signatures
from rig.gap.raw_tests.quantisation import code_found
from rig.gap.raw_tests.signature import Signature
from rig.gap.reference.build import expect
from rig.gap.reference.expected import Expected
from rig.gap.reference.gaps import commanded_gaps
from rig.gap.reference.known_noise import known_noise
from rig.gap.reference.simulated import at_rest, misfit_deg
from rig.gap.settings import ANOTHER_RIG
from rig.model.parameters import Model


@dataclass(frozen=True)
class Grounds:
    """What an answer rests on, for the words, the pictures and the augmented model."""

    simulator: Model | None
    expected: Expected
    posteriors: tuple[Posterior, ...]


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
    pairing = paired(question, question.records, question.days)
    angles = [pair.case.angle_deg for pair in pairing.pairs]
    noise = known_noise(question.kind, question.model, question.settings.noise, angles)
    signatures = _named_only(read_signatures(pairing.pairs, noise), effects)
    expected = expect(
        question.kind, question.sister, question.model, paired_without_artefacts(question, pairing, signatures)
    )
    expected = replace(
        expected,
        signatures_deg2=sum(signature.smoothed_deg2 for signature in signatures if signature.found),
        step_deg=code_found(signatures)[0],
        known_hz=question.known_hz,
    )
    fitting = [effect for effect in effects if not effect.signature]
    return signatures, *BothFactors(question, fitting).judged(expected)


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


def _named_only(signatures: Sequence[Signature], effects: Sequence[Effect]) -> list[Signature]:
    """The signatures; those whose effect the library at hand does not hold stay without a name."""
    known = {effect.name for effect in effects}
    return [
        signature if signature.effect is None or signature.effect in known else replace(signature, effect=None)
        for signature in signatures
    ]
