"""Fits the temperature of names: by how much the evidence overstates which effect of the library it is.

Every law is a little wrong on every rig, and wrong alike on all of a session's lines, so that the evidence between two
laws grows with records that say nothing new. It is raised to the power 1 / T (a power posterior: Grünwald and van
Ommen, Bayesian Analysis 12, 2017, 1069; Miller and Dunson, JASA 114, 2019, 1113). T is the one under which the true
names of plants are likeliest on which no law and no level was fitted. Whether there is anything, and whether it is
something unknown, stays as likely as it was.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.gap.evidence.posterior import flattened
from rig.gap.prior_fitting.odds import LEAST_COUNTED
from rig.gap.settings import CREDIBLE
from rig.record import Column

COLDEST, HOTTEST = 0.5, 20.0
"""Temperatures that are tried lie between these. Hotter: nothing is told apart."""


@dataclass(frozen=True)
class NamedFactor:
    """One factor on which one effect of the library acts."""

    chances: Column
    """(k,) stated probabilities of the effects, of which the first is the one that acts."""

    def right(self, times: float) -> float:
        """Probability of the true name, of an effect at all, at so many times the temperature."""
        return float(flattened(self.chances, times)[0] / np.sum(self.chances))

    def held(self, times: float) -> bool:
        """Whether the true name is among the likeliest that hold CREDIBLE of what effects hold together."""
        chances = flattened(self.chances, times) / np.sum(self.chances)
        return float(np.sum(chances[chances > chances[0]])) < CREDIBLE


def fit_temperature(families: Sequence[Sequence[NamedFactor]], stated: float) -> float:
    """The temperature under which the true names are likeliest, where they were judged at the one `stated`. A family is
    one draw of what builds differ by, however many cases it brings."""
    from scipy.optimize import minimize_scalar  # half a second to import

    def cost(log_temperature: float) -> float:
        return -float(np.mean([log_likelihood(judged, float(np.exp(log_temperature)) / stated) for judged in families]))

    return float(np.exp(minimize_scalar(cost, bounds=np.log([COLDEST, HOTTEST]), method="bounded").x))


def log_likelihood(judged: Sequence[NamedFactor], times: float) -> float:
    """Mean nats of the true names at so many times the temperature that they were judged at."""
    return float(np.mean(np.log([one.right(times) + LEAST_COUNTED for one in judged])))
