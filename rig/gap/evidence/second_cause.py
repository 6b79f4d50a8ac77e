"""Two causes on one factor: where the likeliest one leaves something unknown, each of the best few is taken for known
and everything competes once more on what is left, what a simulator usually lacks included."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.gap.evidence.posterior import LEAST_CHANCE, Posterior, acting, judge
from rig.gap.evidence.usual_sizes import Usual, log_usual
from rig.gap.hypotheses.fit import Fit, refit
from rig.gap.hypotheses.given import forward_given, problem_given
from rig.gap.hypotheses.library import NONE, UNKNOWN, Effect
from rig.gap.settings import EVEN_CHANCE, FIRSTS_TRIED


@dataclass(frozen=True)
class _Two:
    """Two effects on one factor, one of them perhaps as large as a simulator usually lacks it."""

    log_evidence: float
    first: Fit
    second: Posterior
    """What competes beside the first."""
    usual: str = ""
    """The one that is no gap; none where both are."""

    @property
    def name(self) -> str:
        """Of the first that is a gap."""
        return self.second.best if self.usual == self.first.effect.name else self.first.effect.name


def with_second(effects: Sequence[Effect], alone: Posterior, experiments: Mapping[str, float]) -> tuple[Posterior, ...]:
    """The posterior as it is; or, where something unknown stands in it and two effects explain the factor better than
    one with that, those of the likeliest first effect and of the second beside it, and of one alone where the other is
    there at a usual size."""
    if not alone.found:
        return (alone,)
    alone = replace(alone, usual=None)
    if alone.best != UNKNOWN and alone.beside <= EVEN_CHANCE:
        return (alone,)
    firsts = sorted(alone.fits.values(), key=lambda fit: -fit.log_evidence)[:FIRSTS_TRIED]  # what explains most alone
    choices, pairs = acting(effects, alone.problem), list[_Two]()
    for first in firsts:
        others = [effect for effect in effects if effect.name != first.effect.name]
        second = judge(others, problem_given(alone.problem, first), experiments)
        nats = experiments.get(first.effect.name, 0.0) + experiments.get(second.best, 0.0)
        pairs += [replace(two, log_evidence=two.log_evidence + nats) for two in _explanations(first, second, choices)]
    if not pairs:
        return (alone,)
    best = max(pairs, key=lambda two: two.log_evidence)
    if best.log_evidence < _of_one(alone):
        return (alone,)
    return _told(alone, best, pairs)


def _explanations(first: Fit, second: Posterior, effects: int) -> Iterator[_Two]:
    """By two of so many effects: both a gap, or one of them as large as is usual of a simulator."""
    prior = first.forward.prior
    if second.fit is not None and second.beside <= EVEN_CHANCE:
        beside, usual = second.fit.log_evidence, log_usual(first, effects, first.forward.usual)
        yield _Two(_of_both(first, beside + prior.log_beside), first, second)
        if math.isfinite(usual):
            yield _Two(_of_both(first, beside + usual), first, second, first.effect.name)
    elif second.best == NONE and second.usual is not None:
        yield _Two(_of_both(first, second.log_evidence_of_none), first, second, second.usual.effect)


def _told(alone: Posterior, best: _Two, pairs: Sequence[_Two]) -> tuple[Posterior, ...]:
    """The posteriors of the likeliest two, where these are all that were tried."""
    first, second = best.first.effect.name, best.second
    total = float(np.logaddexp.reduce([two.log_evidence for two in pairs]))
    chances = dict.fromkeys(alone.probability, 0.0)
    for two in pairs:
        chances[two.name] = chances.get(two.name, 0.0) + math.exp(two.log_evidence - total)
    usual = Usual(best.usual, math.exp(best.log_evidence - total)) if best.usual else None
    if usual is not None and usual.effect == first:
        return (with_usual(second, usual, best.first),)
    likeliest = replace(alone, probability=chances, log_odds_beside={})
    if usual is not None:
        return (with_usual(likeliest, usual, second.fits[usual.effect]),)
    assert second.fit is not None
    return replace(likeliest, fits=alone.fits | {first: _beside(alone, first, second.fit)}), replace(
        second, given=first, usual=None
    )


def with_usual(posterior: Posterior, usual: Usual, fit: Fit) -> Posterior:
    """The same with an effect that is as large as is usual: no gap, so that without a share of the others' mass, where
    it did not compete with them."""
    probability = {usual.effect: 0.0} | posterior.probability
    return replace(posterior, usual=usual, fits=posterior.fits | {usual.effect: fit}, probability=probability)


def _of_both(first: Fit, log_beside: float) -> float:
    """Log evidence of the first effect and of what is beside it: of that, given the first, and what the numbers of the
    first cost."""
    return log_beside + first.log_evidence - first.log_law


def _of_one(alone: Posterior) -> float:
    """Log evidence of the likeliest hypothesis with one effect at most, something unknown beside it included."""
    known = max(alone.fits, key=lambda name: alone.probability[name])
    if alone.best == UNKNOWN:
        chances = alone.probability[UNKNOWN], max(alone.probability[known], LEAST_CHANCE)
        return alone.with_unknown(known) + float(np.log(chances[0] / chances[1]))
    return alone.with_unknown(known)


def _beside(alone: Posterior, name: str, second: Fit) -> Fit:
    """The first effect with the numbers that it has beside the second: by itself it explains some of that too."""
    first = alone.fits[name]
    forward = first.forward
    applied = refit(first, forward_given(forward, second))
    sizes = np.array([applied.numbers[number] for number in first.law.free])
    return replace(first, applied=applied, sizes=sizes, change=forward.changed_by(applied))
