"""Fits the prior odds of no cause, of something unknown, of two factors together, and of a healthy rig, to factors of
which the truth is known.

A probability that was stated under one prior is another under the next by Bayes' rule: nothing is diagnosed again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum

import numpy as np

from rig.gap.priors import Odds
from rig.record import Column

LEAST_COUNTED = 1e-4
"""A probability that was stated for what is true counts as about this much at least: no single answer decides."""
HELD = 2.0
"""How firmly odds are held to those before: the standard deviation of a normal prior, in nats. Less: more cases are
needed to move them."""
EVERY_ODDS = tuple(one.name for one in fields(Odds))
"""Names of all that can be fitted."""


class FactorTruth(IntEnum):
    """What a factor holds."""

    NONE = 0
    UNKNOWN = 1
    """Something that is not in the library."""
    EFFECT = 2
    """One effect of the library or more."""


@dataclass(frozen=True)
class Judgement:
    """What was said of one factor, and what was true."""

    truth: FactorTruth
    none: float
    unknown: float
    """Stated probabilities; what they lack of one is the library's."""
    right: float
    """Stated probability of what is true: of an effect that of its name."""
    alone: float = 1.0
    """Stated probability that nothing acts on the factor that this one goes together with; 1 where it goes with
    none."""
    after_nothing: bool = False
    """It is the angle, and nothing was thought to act ahead of the monitors: `Odds.healthy` counts."""


def fit_odds(families: Sequence[Sequence[Judgement]], odds: Odds, free: Sequence[str] = EVERY_ODDS) -> Odds:
    """The odds for a build that is not among these families: those under which the families' truths are likeliest; they
    were judged by `odds`, of which those that are not `free` stay. A family is one draw of what builds differ by,
    however many cases it brings."""
    from scipy.optimize import minimize  # half a second to import

    each = sum(map(len, families)) / len(families)

    def moved(shifts: Column) -> Odds:
        return replace(odds, **{name: getattr(odds, name) + float(by) for name, by in zip(free, shifts, strict=True)})

    def cost(shifts: Column) -> float:
        likely = sum(log_likelihood(judged, odds, moved(shifts)) for judged in families)
        return -each * likely + 0.5 * float(shifts @ shifts) / HELD**2

    return moved(minimize(cost, np.zeros(len(free)), method="Nelder-Mead").x)


def log_likelihood(judged: Sequence[Judgement], odds: Odds, other: Odds) -> float:
    """Mean nats of what was true, had the `other` odds stood where `odds` did."""
    stated = np.array([(one.none, one.unknown, 1.0 - one.none - one.unknown) for one in judged])
    right, truth = np.array([one.right for one in judged]), np.array([one.truth for one in judged])
    alone = np.array([one.alone for one in judged])
    was, now = (alone + (1.0 - alone) * np.exp(one.together) for one in (odds, other))
    times = np.tile(np.exp([other.none - odds.none, other.unknown - odds.unknown, 0.0]), (len(judged), 1))
    times[:, [FactorTruth.UNKNOWN, FactorTruth.EFFECT]] *= (now / was)[:, None]
    times[[one.after_nothing for one in judged], FactorTruth.NONE] *= np.exp(other.healthy - odds.healthy)
    posterior = right * times[np.arange(len(judged)), truth] / np.sum(stated * times, axis=1)
    return float(np.mean(np.log(posterior + LEAST_COUNTED)))
