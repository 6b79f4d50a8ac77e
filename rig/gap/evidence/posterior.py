"""The hypotheses of one factor and their probabilities: nothing, every effect of the library, and something unknown."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from rig.gap.evidence.unknown import beside, log_unknown
from rig.gap.evidence.usual_sizes import Usual, nothing
from rig.gap.hypotheses.fit import Fit, ForwardModel, fit_effect, settled
from rig.gap.hypotheses.inverse_problems import InverseProblem
from rig.gap.hypotheses.library import NONE, UNKNOWN, Effect
from rig.gap.settings import CREDIBLE, EVEN_CHANCE
from rig.record import Column

LEAST_CHANCE = 1e-12
"""An effect's share of all effects below counts as this much beside experiments: nothing is ever ruled out for good.
More: a wrong name that is sure is corrected sooner."""


def likeliest(probability: Mapping[str, float]) -> str:
    """The hypothesis that is believed: none, or one of those that are something where they are likelier together."""
    something = {name: chance for name, chance in probability.items() if name != NONE}
    if probability.get(NONE, 0.0) >= EVEN_CHANCE or not something:
        return NONE
    return max(something, key=lambda name: something[name])


@dataclass(frozen=True)
class Posterior:
    """What competes on one factor, with its probabilities."""

    problem: InverseProblem
    plain: ForwardModel
    """The problem's forward model as it is judged without any effect."""
    probability: dict[str, float]
    """none, unknown and every effect that acts here."""
    fits: dict[str, Fit]
    """Effect -> its likeliest law."""
    log_odds_beside: Mapping[str, float]
    """ln odds that an effect leaves something unknown and is needed beside it, against that its law is only as rough as
    it usually is; none for one that leaves nothing to another."""
    log_evidence: float = 0.0
    """ln p of the factor's gap, over all hypotheses."""
    given: str = ""
    """The first of two effects on this factor, where this one is about the second."""
    usual: Usual | None = None
    """What is there as large as is usual, where none is likelier with it than without."""
    monitors_alone: float = 0.0
    """Of the pressures: probability that only their monitors show otherwise, and the joint moves as it did."""

    @property
    def best(self) -> str:
        """The likeliest hypothesis: none where that is likelier than everything else together, else the likeliest of
        the others."""
        return likeliest(self.probability)

    @property
    def fit(self) -> Fit | None:
        """The likeliest effect where an effect is the likeliest hypothesis."""
        return self.fits.get(self.best)

    @property
    def beside(self) -> float:
        """Probability that something unknown stands beside the likeliest effect, if that is the answer."""
        return chance_of(self.log_odds_beside.get(self.best, -math.inf))

    @property
    def sure_beside(self) -> float:
        """Probability that it is right to say, or not to say, that something unknown stands beside that effect."""
        return max(self.beside, 1.0 - self.beside)

    def with_unknown(self, name: str) -> float:
        """Log evidence of an effect, by itself or with something unknown beside it."""
        return _with_unknown(self.fits[name], self.log_odds_beside[name])

    def residual(self, name: str) -> Column:
        """(l,) lines of what a hypothesis leaves of the gap, by the model that it was judged by."""
        factor = self.forward_of(name).factor
        return factor.lines.of(factor.gap - self.fits[name].change) if name in self.fits else factor.gap_lines

    def forward_of(self, name: str) -> ForwardModel:
        """On which a hypothesis was judged."""
        return self.fits[name].forward if name in self.fits else self.plain

    @property
    def beyond(self) -> float:
        """Floors (rms) that the likeliest hypothesis leaves beyond all that may differ without being a gap, what a
        simulator usually lacks included where that is nothing."""
        name = self.usual.effect if self.best == NONE and self.usual is not None else self.best
        factor = self.forward_of(name).factor
        return factor.rms_of_lines(factor.healthy.beyond(self.residual(name))) / factor.floor

    def likely(self, least: float) -> list[str]:
        """The hypotheses of at least this probability, likeliest first."""
        ordered = sorted(self.probability, key=lambda name: -self.probability[name])
        return [name for name in ordered if self.probability[name] >= least] or ordered[:1]

    def log_evidence_beside(self, together: float) -> float:
        """Log evidence where another factor holds something: what acts on this one is likelier by `together` nats."""
        none = self.probability[NONE]
        return self.log_evidence + float(np.log(none + (1.0 - none) * np.exp(together)))

    @property
    def log_evidence_of_none(self) -> float:
        """Log evidence that nothing acts, the usual included, with what is thought of it beforehand."""
        return self.log_evidence + float(np.log(max(self.probability[NONE], 1e-300)))

    def with_evidence(self, nats: Mapping[str, float]) -> "Posterior":
        """The posterior updated by another factor's log evidence (nats) for some of the hypotheses; those without one
        take that of none, or else the mean."""
        others = nats.get(NONE, float(np.mean(list(nats.values()))))
        evidence = {name: nats.get(name, others) for name in self.probability}
        logs = {name: float(np.log(max(chance, 1e-300))) + evidence[name] for name, chance in self.probability.items()}
        probability, total = _normalised(logs)
        return replace(self, probability=probability, log_evidence=self.log_evidence + total)

    def as_if_misread(self, chance: float) -> "Posterior":
        """The same where with this chance the monitors alone show something that no effect of the library is."""
        chance = min(chance, 1.0 - LEAST_CHANCE)
        probability = {name: (1.0 - chance) * held for name, held in self.probability.items()}
        return replace(self, probability=probability | {UNKNOWN: probability[UNKNOWN] + chance}, monitors_alone=chance)

    def at(self, temperature: float) -> "Posterior":
        """The same with names told apart by as much of the evidence as counts at a temperature (`Prior.temperature`);
        none, something unknown and all effects together stay as likely as they were."""
        names = [name for name in self.probability if name not in (NONE, UNKNOWN)]
        chances = flattened(np.array([self.probability[name] for name in names]), temperature).tolist()
        return replace(self, probability=self.probability | dict(zip(names, chances, strict=True)))

    @property
    def found(self) -> bool:
        """There is something."""
        return self.probability[NONE] < EVEN_CHANCE

    @property
    def names(self) -> list[str]:
        """The likeliest hypotheses that together hold the credible mass, likeliest first."""
        kept, mass = [], 0.0
        for name in sorted(self.probability, key=lambda one: -self.probability[one]):
            kept.append(name)
            mass += self.probability[name]
            if mass >= CREDIBLE:
                break
        return kept


def judge(
    effects: Sequence[Effect],
    problem: InverseProblem,
    experiments: Mapping[str, float] = MappingProxyType({}),
    healthy: float = 0.0,
) -> Posterior:
    """Every hypothesis on one factor; `experiments` holds the nats that these have for some of the effects, `healthy`
    those by which nothing is likelier (`Odds.healthy`)."""
    forward = problem.forward
    plain = settled(forward)
    # one after the other: two threads on two cores spend a third more processor time to be no sooner
    found = [fit_effect(effect, forward, problem.shows, problem.screening, problem.identifiable) for effect in effects]
    fits = {fit.effect.name: fit for fit in found if fit is not None and np.isfinite(fit.log_evidence)}
    gap, expected = plain.factor.gap_lines, plain.factor.healthy
    bare = expected.log_density(gap) + forward.odds.none + healthy
    none = nothing(bare, fits, acting(effects, problem), forward.usual)
    unknown = log_unknown(plain, expected, gap)
    second = {name: beside(fit, unknown) for name, fit in fits.items()}
    odds = {name: one.needed - fits[name].log_evidence for name, one in second.items()}
    logs = {
        NONE: none.log_evidence,
        UNKNOWN: _sum([unknown + forward.odds.unknown, *(one.unneeded for one in second.values())]),
    }
    logs |= {name: _with_unknown(fit, odds[name]) for name, fit in fits.items()}
    probability, total = _normalised(parted(logs, experiments))
    return Posterior(problem, plain, probability, fits, odds, total, usual=none.usual)


def acting(effects: Sequence[Effect], problem: InverseProblem) -> int:
    """How many effects can show on a factor."""
    return sum(any(problem.shows(law) for law in effect.laws) for effect in effects)


def parted(logs: Mapping[str, float], experiments: Mapping[str, float]) -> dict[str, float]:
    """The same once `experiments` have said so many nats for some effects. They part effects from each other: that
    there is nothing, something unknown, or an effect that they say nothing of, stays as likely as it was."""
    effects = [name for name in logs if name in experiments]
    if not effects:
        return dict(logs)
    before = np.logaddexp.reduce([logs[name] for name in effects])
    average = float(np.logaddexp.reduce([logs[name] + experiments[name] for name in effects]) - before)
    return {name: value + (experiments[name] - average if name in experiments else 0.0) for name, value in logs.items()}


def chance_of(log_odds: float) -> float:
    """The probability that has these odds, ln."""
    return 0.5 * (1.0 + math.tanh(0.5 * log_odds))


def flattened(chances: Column, temperature: float) -> Column:
    """(k,) probabilities with the same sum, their odds raised to the power 1 / temperature."""
    if not np.any(chances > 0.0):
        return chances
    logs = np.log(np.maximum(chances, 1e-300)) / temperature
    out: Column = np.sum(chances) * np.exp(logs - np.logaddexp.reduce(logs))
    return out


def _normalised(logs: Mapping[str, float]) -> tuple[dict[str, float], float]:
    """Probabilities that sum to one, and ln of what they summed to."""
    total = _sum(list(logs.values()))
    return {name: float(np.exp(value - total)) for name, value in logs.items()}, total


def _sum(logs: Sequence[float]) -> float:
    """ln of the sum of what these are logarithms of."""
    return float(np.logaddexp.reduce(logs))


def effect_evidence(posterior: Posterior) -> dict[str, float]:
    """What a posterior says of the effects, if it is one of them, as nats."""
    chances = {name: chance for name, chance in posterior.probability.items() if name not in (NONE, UNKNOWN)}
    least = LEAST_CHANCE * max(sum(chances.values()), 1e-280)
    return {name: float(np.log(max(chance, least) / least)) for name, chance in chances.items()}


def _with_unknown(fit: Fit, log_odds: float) -> float:
    return fit.log_evidence + float(np.logaddexp(0.0, log_odds))
