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


def trust(pairing: Pairing, name: str) -> float:
    """What is left of an effect's probability where something that is no hypothesis may have done the same: a sensor
    that cuts off its values, another commanded P0."""
    return EITHER_CHANCE if doubts_of(pairing, name) else 1.0


def doubts_of(pairing: Pairing, name: str) -> tuple[str, ...]:
    """The notes that take a name back by half."""
    if name == NONE:
        return ()
    return pairing.clipped + (pairing.elsewhere if name != UNKNOWN and LIBRARY[name].as_another_p0 else ())
