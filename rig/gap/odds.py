"""Fits the prior odds of no cause, and of something unknown, to factors of which the truth is known.

A probability that was stated under one prior is another under the next by Bayes' rule: nothing is diagnosed again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from rig.gap.settings import Odds
from rig.record import Column

LEAST_CHANCE = 1e-4
"""A probability below counts as about this much: no single answer decides."""
HELD = 2.0
"""How firmly odds are held to those before: the standard deviation of a normal prior, in nats. Less: more cases are
needed to move them."""


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
    right: float
    """Stated probability of what is true: of an effect that of its name."""


def fit_odds(families: Sequence[Sequence[Judgement]], odds: Odds) -> Odds:
    """The odds for a build that is not among these families: the mean of those under which each family's truths are
    likeliest; they were judged by `odds`. A family is one draw of what builds differ by, however many cases it
    brings."""
    none, unknown = np.mean([_shifts(judged) for judged in families], axis=0).tolist()
    return replace(odds, none=odds.none + none, unknown=odds.unknown + unknown)


def _shifts(judged: Sequence[Judgement]) -> Column:
    """By how much odds of none and of something unknown must move for these truths to be likeliest."""
    from scipy.optimize import minimize  # half a second to import

    def cost(shifts: Column) -> float:
        return -_log_likelihood(judged, *shifts) + 0.5 * float(shifts @ shifts) / HELD**2

    return np.asarray(minimize(cost, np.zeros(2), method="Nelder-Mead").x)


def log_likelihood(judged: Sequence[Judgement], odds: Odds, other: Odds) -> float:
    """Mean nats of what was true, had the `other` odds stood where `odds` did."""
    return _log_likelihood(judged, other.none - odds.none, other.unknown - odds.unknown) / len(judged)


def _log_likelihood(judged: Sequence[Judgement], none: float, unknown: float) -> float:
    """Nats of what was true, with both odds shifted by so much."""
    stated = np.array([(one.none, one.unknown, 1.0 - one.none - one.unknown) for one in judged])
    right, truth = np.array([one.right for one in judged]), np.array([one.truth for one in judged])
    times = np.exp([none, unknown, 0.0])
    said = right * times[truth] / (stated @ times)
    return float(np.sum(np.log(said + LEAST_CHANCE)))
