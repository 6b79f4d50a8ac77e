"""Fits the prior odds of no cause to factors of which the truth is known.

A probability that was stated under one prior is another under the next by Bayes' rule: nothing is diagnosed again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import logsumexp

from rig.gap.settings import Odds
from rig.record import Column

LEAST_CHANCE = 1e-4
"""A probability below counts as about this much: no single answer decides."""
HELD = 2.0
"""How firmly odds are held to those before: the standard deviation of a normal prior, in nats. Less: more cases are
needed to move them."""
WIDEST = 10.0
"""Farthest from the odds before that is looked, in nats."""


class Truth(IntEnum):
    """What a factor holds."""

    NONE = 0
    UNKNOWN = 1
    """Something that is not in the library."""
    EFFECT = 2
    """One effect of the library or more."""


@dataclass(frozen=True)
class Judgement:
    """What was said of one factor, and what was true."""

    truth: Truth
    none: float
    unknown: float
    """Stated probabilities; what they lack of one is the library's."""


def fit_odds(judged: Sequence[Judgement], odds: Odds) -> Odds:
    """The odds with that of no cause under which these truths are likeliest; they were judged by `odds`."""
    stated, truths = _log_stated(judged), np.array([one.truth for one in judged])

    def cost(shift: float) -> float:
        return -_log_likelihood(stated, truths, shift) + 0.5 * shift**2 / HELD**2

    found = minimize_scalar(cost, bounds=(-WIDEST, WIDEST), method="bounded")
    return replace(odds, none=odds.none + float(found.x))


def log_likelihood(judged: Sequence[Judgement], odds: Odds, other: Odds) -> float:
    """Mean nats of what was true, had the `other` odds of no cause stood where `odds` did."""
    truths = np.array([one.truth for one in judged])
    return _log_likelihood(_log_stated(judged), truths, other.none - odds.none) / len(judged)


def _log_stated(judged: Sequence[Judgement]) -> Column:
    """(n, 3) in the order of `Truth`."""
    chances = np.array([(one.none, one.unknown, 1.0 - one.none - one.unknown) for one in judged])
    out: Column = np.log(np.maximum(chances, LEAST_CHANCE))
    return out


def _log_likelihood(stated: Column, truths: Column, shift: float) -> float:
    moved = stated + np.array([shift, 0.0, 0.0])
    said = moved[np.arange(len(truths)), truths.astype(int)] - logsumexp(moved, axis=1)
    return float(np.sum(np.logaddexp(said, np.log(LEAST_CHANCE))))
