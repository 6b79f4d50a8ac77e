"""What to record next: the few records that tell most of what is still possible, inside what the rig allows.

The gain is a lower bound of the mutual information between the hypotheses and the records to come: the pairwise
Bhattacharyya bound of a mixture of Gaussians of one covariance (Kolchinsky and Tracey, Entropy 19, 2017, 361). Rivals
are refitted within what is known of their numbers (Chen and Asprey, Ind. Eng. Chem. Res. 42, 2003, 1379).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import numpy as np

from rig.excite.run_plan import RunPlan, Waves
from rig.excite.sweep import Entry
from rig.gap.evidence.posterior import Posterior
from rig.gap.hypotheses.fit import Fit, runs_away
from rig.gap.hypotheses.inverse_problems import InverseProblem
from rig.gap.hypotheses.law_errors import later_pattern, rough_lines
from rig.gap.hypotheses.library import Law
from rig.gap.plan.candidates import SweepEnvelope, candidates, envelope_within, lasts_s, planned
from rig.gap.plan.experiment import Experiment
from rig.gap.plan.information import Information, inform
from rig.gap.plan.planned_records import KnownRig, expect_planned, factors_of, known_rig, within
from rig.gap.plan.settings import (
    LEAST_PROBABILITY,
    LENGTHS_S,
    MORE_NATS,
    MOST_HYPOTHESES,
    TIME_S,
    TOLD_APART,
    WORTH_NATS,
)
from rig.gap.priors import Fitted, fitted
from rig.gap.reference.expected import Expected
from rig.gap.response.causes import Applied
from rig.model.parameters import Model
from rig.record import Column

DRAWS = 4000
"""Of noise, over which a confidence is expected: known to 0.005. More: slower."""


@dataclass(frozen=True)
class Hypothesis:
    """A cause that is still possible."""

    factor: str
    """pressures or angle: where it shows."""
    applied: Applied
    probability: float
    spread: Mapping[str, float]
    """Standard deviations of the fitted numbers."""
    given: str = ""
    """The first of two effects on this factor, where this may be the second."""
    effect: str = ""
    """Its name where that is not its stage's: effects may share one."""
    roughness: float = 0.0
    """Share of what it changes by which its law is likely wrong."""
    law: Law | None = None
    """By which it was fitted."""

    @property
    def name(self) -> str:
        """Of the effect."""
        return self.effect or self.applied.effect

    def moved(self, name: str, scales: Mapping[str, float]) -> tuple[Applied, float]:
        """With one of its numbers a standard deviation off, as far as its law lets it, and how many that is."""
        value, spread, law = self.applied.numbers[name], self.spread[name], self.law
        if not 0.0 < spread < np.inf:
            return self.applied, 0.0
        low, high = (-np.inf, np.inf) if law is None else law.range_of(name, scales)
        to = value + spread if value + spread <= high else max(value - spread, low)
        numbers = {**self.applied.numbers, name: to}
        return Applied(self.applied.stage, numbers if law is None else law.with_tied(numbers)), (to - value) / spread


def hypotheses_of(posteriors: Sequence[Posterior]) -> list[Hypothesis]:
    """What is still possible on every factor that leaves a choice, the likeliest first."""
    return [
        _possible(posterior, name, fit)
        for posterior in posteriors
        if posterior.found and sum(one in posterior.fits for one in posterior.names) > 1
        for name, fit in sorted(posterior.fits.items(), key=lambda item: -posterior.probability[item[0]])
    ]


def _possible(posterior: Posterior, name: str, fit: Fit) -> Hypothesis:
    chance, factor = posterior.probability[name], posterior.problem.name
    return Hypothesis(factor, fit.applied, chance, spreads(fit), posterior.given, name, fit.roughness, fit.law)


def spreads(fit: Fit) -> dict[str, float]:
    """Standard deviations of the fitted numbers."""
    return dict(zip(fit.law.free, fit.spread.tolist(), strict=True))


def what_next(
    expected: Expected,
    posteriors: Sequence[Posterior],
    envelope: SweepEnvelope | None,
    seconds: float = TIME_S,
    settings: Fitted | None = None,
    simulator: Model | None = None,
) -> Experiment | None:
    """The experiment that tells most of what a diagnosis leaves open: at the amplitudes and rest pressures of its
    records, within what the rig allows (`envelope`; careful bounds where that is not known), by the `simulator` too."""
    rivals = hypotheses_of(posteriors)
    if not rivals:  # what the rig repeats need not be found out for nothing
        return None
    envelope, settings = envelope_within(expected.contexts, envelope or SweepEnvelope()), settings or fitted()
    lasted_s = sum(len(pair) * pair.dt_s for pair in expected.pairs)
    return next_experiment(rivals, known_rig(expected), envelope, settings, seconds, simulator, lasted_s)


def next_experiment(
    hypotheses: Sequence[Hypothesis],
    rig: KnownRig,
    envelope: SweepEnvelope,
    settings: Fitted,
    seconds: float = TIME_S,
    simulator: Model | None = None,
    lasted_s: float = 0.0,
) -> Experiment | None:
    """The records that tell most of these hypotheses within `seconds`, beside records that `lasted_s`; None when
    nothing is open, or none tells any more."""
    open_ones = [one for one in hypotheses if one.probability >= LEAST_PROBABILITY]
    places = dict.fromkeys((one.factor, one.given) for one in open_ones)
    rivals = [[one for one in open_ones if (one.factor, one.given) == place][:MOST_HYPOTHESES] for place in places]
    rivals = [those for those in rivals if len(those) > 1]
    pool, plans = _pool(envelope, rig.grid_ns) if rivals else ((), ())
    if not pool:
        return None
    expected = expect_planned(rig, plans)
    asked = {those[0].factor for those in rivals}
    problems = {problem.name: problem for problem in factors_of(expected, settings, asked)}
    known = [_weigh(problems[those[0].factor], those, lasted_s) for those in rivals if those[0].factor in problems]
    allowed = within(expected, envelope.angle_deg, simulator)
    chosen = _chosen(known, [lasts_s(entry) for entry in pool], allowed, seconds)
    return _described(known, pool, chosen) if chosen else None


@lru_cache(maxsize=4)
def _pool(envelope: SweepEnvelope, grid_ns: int) -> tuple[tuple[Entry, ...], tuple[RunPlan, ...]]:
    """What could be recorded, and its plans: the same for every case of a rig."""
    made: Waves = {}
    entries = candidates(envelope, LENGTHS_S, grid_ns, made)
    return tuple(entries), tuple(planned(entries, grid_ns, made))


@dataclass(frozen=True)
class _Open:
    """The hypotheses of one factor under the whole pool."""

    names: tuple[str, ...]
    probability: Column
    """(h,) summing to 1."""
    information: Information
    """About their changes, then about their numbers."""
    owner: tuple[int, ...]
    """(m,) which hypothesis each number belongs to."""
    mass: float
    """Probability that it is one of them at all."""
    temperature: float
    """Of names: as much less of what the records say will count."""

    def distances(self, chosen: Sequence[int]) -> Column:
        """(h, h) squared, in variances as they count: between hypotheses whose numbers are known within their spreads
        only."""
        info, h = self.information.of(chosen), len(self.names)
        out = np.zeros((h, h))
        for i, j in combinations(range(h), 2):
            toward = np.zeros(info.shape[0])
            toward[i], toward[j] = 1.0, -1.0
            free = [h + k for k, owner in enumerate(self.owner) if owner in (i, j)]
            pull = info[free] @ toward
            inner = np.eye(len(free)) + info[np.ix_(free, free)]
            left = toward @ info @ toward - pull @ np.linalg.solve(inner, pull)
            out[i, j] = out[j, i] = max(float(left), 0.0) / self.temperature
        return out

    @property
    def entropy(self) -> float:
        return float(-np.sum(self.probability * np.log(self.probability)))

    def gain(self, chosen: Sequence[int]) -> float:
        """Nats that these records tell at least."""
        overlap = np.exp(-self.distances(chosen) / 8.0) @ self.probability
        return float(-np.sum(self.probability * np.log(overlap)))

    def confidence(self, chosen: Sequence[int]) -> float:
        """Probability that the truth is expected to have after these records. They part the hypotheses from each
        other; that it is none of them stays as likely as it was."""
        return self.mass**2 * expected_confidence(self.probability, self.distances(chosen)) + (1.0 - self.mass) ** 2


def _weigh(problem: InverseProblem, rivals: Sequence[Hypothesis], lasted_s: float) -> _Open:
    probability = np.array([one.probability for one in rivals])
    mass = min(float(probability.sum()), 1.0)
    chance = probability / probability.sum()
    changes = [_held(problem.forward.changed_by(one.applied)) for one in rivals]
    slopes, owner = [], []
    for k, one in enumerate(rivals):
        for name in one.spread:
            moved, deviations = one.moved(name, problem.forward.scales)
            if deviations == 0.0:
                continue
            slopes.append(_held((problem.forward.changed_by(moved) - changes[k]) / deviations))
            owner.append(k)
    lines = problem.forward.factor.lines
    directions = np.column_stack([lines.of(one) for one in (*changes, *slopes)])
    wrong = directions[:, : len(rivals)] * np.sqrt(chance) * np.array([one.roughness for one in rivals])
    information = inform(as_rough(problem, wrong), directions, wrong, lasted_s)
    names = tuple(one.name for one in rivals)
    return _Open(names, chance, information, tuple(owner), mass, problem.forward.prior.temperature)


def _held(change: Column) -> Column:
    """(n,) a change, none where its law runs away: of records that it does not hold for nothing is promised."""
    return np.zeros_like(change) if runs_away(change) else change


def as_rough(problem: InverseProblem, wrong: Column) -> InverseProblem:
    """The factor where the change of each hypothesis is wrong by so much (l, h): by the mean over the hypotheses, for
    the bound is that of one covariance."""
    forward, factor = problem.forward, problem.forward.factor
    variance = np.sum([rough_lines(factor.lines, one, 1.0, forward.prior) for one in wrong.T], axis=0)
    later = np.column_stack([later_pattern(one, factor.lines, 1.0) for one in wrong.T])
    healthy = factor.healthy.with_patterns(later).with_variance(variance)
    return replace(problem, forward=replace(forward, factor=replace(factor, healthy=healthy)))


def _chosen(known: Sequence[_Open], times: Sequence[float], allowed: Sequence[int], seconds: float) -> list[int]:
    """Of the allowed records, by what they add a second, until the time is over or none adds enough; none at all where
    they are not worth it together."""
    chosen: list[int] = []
    gained = 0.0
    while True:
        left = seconds - sum(times[k] for k in chosen)
        gains = {
            k: sum(one.gain([*chosen, k]) for one in known) for k in allowed if k not in chosen and times[k] <= left
        }
        enough = [k for k, gain in gains.items() if gain - gained >= MORE_NATS]
        best = max(enough, key=lambda k: (gains[k] - gained) / times[k], default=None)
        if best is None:
            return chosen if gained >= WORTH_NATS else []
        chosen.append(best)
        gained = gains[best]


def _described(known: Sequence[_Open], pool: Sequence[Entry], chosen: Sequence[int]) -> Experiment:
    first = max(known, key=lambda one: one.gain(chosen))
    apart = np.sqrt(first.distances(chosen))
    kept = _parted(apart)
    weakest = min((apart[i, j] for i, j in combinations(kept, 2)), default=0.0)
    surely = np.prod([one.confidence(chosen) for one in known])
    return Experiment(
        tuple(pool[k] for k in chosen),
        sum(one.gain(chosen) for one in known),
        sum(one.entropy for one in known),
        float(surely),
        tuple(first.names[k] for k in kept),
        float(weakest),
    )


def expected_confidence(probability: Column, distances: Column) -> float:
    """Probability that the truth is expected to have after records: the mean over hypotheses (h,) and over the noise.
    `distances` (h, h): squared, in variances. The posterior of a record without noise is larger than this mean."""
    drawn = np.random.default_rng(0).standard_normal((DRAWS, len(probability)))
    mean = 0.0
    for truth, chance in enumerate(probability):
        far = distances[truth]
        power, axes = np.linalg.eigh(0.5 * (far[:, None] + far[None, :] - distances))
        scatter = drawn @ (axes * np.sqrt(np.maximum(power, 0.0))).T
        against = np.exp(scatter - 0.5 * far[None, :]) @ probability / chance
        mean += float(chance * np.mean(1.0 / against))
    return mean


def _parted(apart: Column) -> list[int]:
    """Hypotheses that all lie apart: the likeliest, and each next one that joins; where none does, the two that come
    farthest apart."""
    kept = [0]
    for k in range(1, len(apart)):
        if all(apart[j, k] >= TOLD_APART for j in kept):
            kept.append(k)
    return kept if len(kept) > 1 else sorted(int(k) for k in np.unravel_index(int(np.argmax(apart)), apart.shape))
