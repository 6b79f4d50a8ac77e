"""Two causes on one factor: where the likeliest one leaves something unknown, each of the best few is taken for known
and everything competes once more on what is left."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rig.gap.evidence.posterior import LEAST_CHANCE, Posterior, judge
from rig.gap.hypotheses.fit import Fit, refit
from rig.gap.hypotheses.given import forward_given, problem_given
from rig.gap.hypotheses.library import UNKNOWN, Effect
from rig.gap.settings import EVEN_CHANCE, FIRSTS_TRIED


def with_second(effects: Sequence[Effect], alone: Posterior, said: Mapping[str, float]) -> tuple[Posterior, ...]:
    """The posterior as it is; or, where something unknown stands in it and two effects explain the factor better than
    one with that, those of the likeliest first effect and of the second beside it."""
    if not alone.found or (alone.best != UNKNOWN and alone.beside <= EVEN_CHANCE):
        return (alone,)
    firsts = sorted(alone.fits.values(), key=lambda fit: -fit.log_evidence)[:FIRSTS_TRIED]  # what explains most alone
    pairs = []
    for first in firsts:
        others = [effect for effect in effects if effect.name != first.effect.name]
        second = judge(others, problem_given(alone.problem, first), said)
        if second.fit is not None and second.beside <= EVEN_CHANCE:
            told = said.get(first.effect.name, 0.0) + said.get(second.best, 0.0)
            pairs.append((_of_both(first, second.fit) + told, first.effect.name, second))
    if not pairs:
        return (alone,)
    best, name, second = max(pairs, key=lambda pair: pair[0])
    if best < _of_one(alone):
        return (alone,)
    total = np.logaddexp.reduce([pair[0] for pair in pairs])
    chances = dict.fromkeys(alone.probability, 0.0) | {other: float(np.exp(one - total)) for one, other, _ in pairs}
    assert second.fit is not None
    fits = alone.fits | {name: _beside(alone, name, second.fit)}
    return replace(alone, probability=chances, log_odds_beside={}, fits=fits), replace(second, given=name)


def _of_both(first: Fit, second: Fit) -> float:
    """Log evidence of two effects: that of the second beside the first, what the numbers of the first cost, and that
    there is anything beside it."""
    return second.log_evidence + first.log_evidence - first.log_law + first.forward.prior.log_beside


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
