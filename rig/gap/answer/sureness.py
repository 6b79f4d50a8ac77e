"""How probable it is that what an answer says is right: of each factor, and as a whole."""

from collections.abc import Sequence

import numpy as np

from rig.gap.answer.findings import Findings, Kept
from rig.gap.answer.kept_effects import dropped_effects
from rig.gap.answer.result import Cause
from rig.gap.hypotheses.library import LIBRARY, NONE, UNKNOWN
from rig.gap.records.pairs import Pairing
from rig.gap.settings import EITHER_CHANCE


def confidence_of(findings: Findings, kept: Sequence[Kept], raw: Sequence[Cause], *, doubted: int) -> float:
    """Probability that the whole answer is right: the product over the factors (`right_of_each`) and over the causes in
    the raw samples. It is halved for each likeliest effect that was dropped, and for each of the `doubted` statements:
    those on something unknown that have no probability of their own, because of the degrees that are left or because of
    the raw samples."""
    chances = right_of_each(findings, kept) + [EITHER_CHANCE] * (len(dropped_effects(findings, kept)) + doubted)
    return float(np.prod([*chances, *(cause.confidence for cause in raw)]))


def right_of_each(findings: Findings, kept: Sequence[Kept]) -> list[float]:
    """Of each factor the probability that what the answer says of it is right: that its likeliest hypothesis holds, and
    that something unknown is, or is not, beside it as said. Where the likeliest effect was dropped, that there is
    something at all."""
    nameless = [id(posterior) for posterior, _ in dropped_effects(findings, kept)]
    return [
        1.0 - one.probability[NONE]
        if id(one) in nameless
        else one.probability[one.best] * one.sure_beside * trust(findings.expected.pairing, one.best)
        for one in findings.posteriors
    ]


def trust(pairing: Pairing, name: str) -> float:
    """Factor on an effect's probability: below 1 where something that is no hypothesis may have done the same, as a
    clipped sensor or another commanded P0."""
    return EITHER_CHANCE if doubts_of(pairing, name) else 1.0


def doubts_of(pairing: Pairing, name: str) -> tuple[str, ...]:
    """The notes that make an effect half as sure: they tell of something that may have done the same."""
    if name == NONE:
        return ()
    return pairing.clipped + (pairing.elsewhere if name != UNKNOWN and LIBRARY[name].as_another_p0 else ())
