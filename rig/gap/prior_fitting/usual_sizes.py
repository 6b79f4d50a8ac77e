"""Fits what a simulator usually lacks of a healthy rig (`UsualSizes`), by maximum likelihood on healthy days.

What comes in are healthy days beside a simulator, of units of several plant families, with what each effect of the
library would explain of them; nothing of a case with an effect is looked at.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.gap.priors import Prior, UsualSizes

SCALES = tuple(float(x) for x in np.exp(np.linspace(np.log(0.05), np.log(3.0), 21)))
"""That are tried, in floors. Below, an effect is lost in what days differ by; beyond, it is a gap in anybody's eyes."""
LEAST_NATS = 1.0
"""Nats, over all families, that another effect must bring (Akaike, IEEE Trans. Autom. Control 19, 1974)."""
HALF = float(np.log(0.5))


@dataclass(frozen=True)
class Shown:
    """What an effect would explain of one factor of a healthy day."""

    nats: float
    """Log evidence of its likeliest law over nothing."""
    share: float
    """What it changes then, as a share of what moves anyhow (rms)."""
    floors: float
    """What it does to the angle, in floors (rms)."""


Factors = Sequence[Mapping[str, Shown]]
"""Of one healthy day: effect -> what it shows, on the pressures and on the angle."""


def fit_usual(families: Sequence[Sequence[Factors]], prior: Prior) -> UsualSizes | None:
    """The likeliest scales: each family counts as one draw of what builds differ by, however many days it brings;
    effects are added one by one while they bring anything. None where none does."""
    scales, best = dict[str, float](), 0.0
    effects = sorted({effect for days in families for day in days for factor in day for effect in factor})
    while True:
        tried = [
            (log_likelihood(families, UsualSizes({**scales, effect: scale}), prior), effect, scale)
            for effect in effects
            for scale in SCALES
            if effect not in scales
        ]
        gained, effect, scale = max(tried)
        if gained < best + LEAST_NATS:
            return UsualSizes(scales) if scales else None
        scales[effect], best = scale, gained


def log_likelihood(families: Sequence[Sequence[Factors]], usual: UsualSizes, prior: Prior) -> float:
    """Nats by which these healthy days are likelier with something usual than without, summed over families; of each
    the mean."""
    return float(sum(np.mean([_of_day(day, usual, prior) for day in days]) for days in families))


def _of_day(day: Factors, usual: UsualSizes, prior: Prior) -> float:
    return sum(_of_factor(factor, usual, prior) for factor in day)


def _of_factor(factor: Mapping[str, Shown], usual: UsualSizes, prior: Prior) -> float:
    """Of a healthy rig, which shows one of these effects or none, as likely."""
    logs = [HALF] + [
        HALF - np.log(len(usual.scales)) + one.nats + usual.log_density(name, one.floors) - prior.log_density(one.share)
        for name, one in factor.items()
        if name in usual.scales
    ]
    return float(np.logaddexp.reduce(logs))
