"""Which effect: every law fitted to the frozen nominal rig, judged on records that its fit did not see, ranked side by
side.

A side is either the pressures (valve side) or the angle; `Bench` knows what an effect changes on it. Thresholds and
words of the verdict are in `rig.gap.days.verdict`.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from rig.gap.days.bench import Bench
from rig.gap.days.side import Side
from rig.gap.hypotheses.library import FAINT, Effect, Law
from rig.gap.hypotheses.propagate import Applied
from rig.identify.descent import Fit, descend, normal, square_sum
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.slots import Slot
from rig.record import Column

LOOSENESS = 0.04
"""A law is an approximation: share of the gap that even the right one may leave."""
SHARPNESS = 40.0
"""How many independent comparisons the ranking counts for: from the reliability plot."""
PLAIN = 4.0
"""Standard deviations from which on a number that a law needs is there."""
AT_BOUND = 45.0
"""What a flexible number at its bound costs, in chi-square: a form stretched to its limit is seldom the truth."""
MOST_CREDIT = 30.0
"""Most that an upstream effect is credited for what it explains in the pressures, in chi-square."""
FOLDS = 8
LEAST_FITTED = 5
REACH = 5.0
"""Effects that leave up to this many times what the best leaves are fitted to all records."""


@dataclass(frozen=True)
class Candidate:
    """One effect with its best law, fitted to a side."""

    effect: Effect
    law: Law
    applied: Applied
    score: float
    """Chi-square on held-out records, with the charges for parameters and special forms: less is better."""
    left: float
    """Rms that remains on held-out records, modes of the sessions taken out as far as they are usual."""
    residual: Column
    """(n,) measured minus predicted."""
    sizes: Column
    """(k,) fitted numbers, in the order of the law's free ones."""
    spread: Column
    """(k,) their standard deviations, from how the records disagree."""


def rank(
    effects: Sequence[Effect], bench: Bench, least: int = LEAST_FITTED, reach: float = REACH, workers: int = 2
) -> list[Candidate]:
    """Every effect's best law on this side, best first. Effects that this side cannot show are left out.

    All are tried on the three records that show most; those within reach of the best are then fitted to all records.
    What the monitors speak against is left out.
    """
    fitting = [effect for effect in effects if not effect.signature and shows(effect, bench)]
    few = bench.on(telling_records(bench.side))
    with ThreadPoolExecutor(workers) as pool:
        rough = [found for found in pool.map(lambda effect: fit_effect(effect, few), fitting) if found is not None]
        rough.sort(key=lambda candidate: candidate.score)
        near = [candidate for k, candidate in enumerate(rough) if k < least or candidate.score < reach * rough[0].score]
        full = list(pool.map(lambda candidate: refit(candidate, bench), near))
    possible = [candidate for candidate in full if candidate is not None and not bench.ruled_out([candidate.applied])]
    known = sorted(possible, key=lambda candidate: candidate.score)
    if not known:
        return []
    scale = bench.side.effective / few.side.effective
    far = [replace(one, score=max(one.score * scale, reach * known[0].score)) for one in rough[len(near) :]]
    return [*known, *sorted(far, key=lambda candidate: candidate.score)]


def telling_records(side: Side) -> list[int]:
    """Three records on which to try first: the two with the largest gap, and the middle one."""
    records = side.records.astype(int)
    sizes = np.bincount(records, side.gap**2)
    order = np.argsort(-sizes)
    return sorted({int(order[0]), int(order[min(1, len(order) - 1)]), int(order[len(order) // 2])})


def shows(effect: Effect, bench: Bench) -> bool:
    """Whether any law of the effect acts on what this side sees."""
    if bench.beside is not None and effect.upstream and effect.name not in FAINT:
        return False
    return any(_law_shows(law, bench) for law in effect.laws)


def _law_shows(law: Law, bench: Bench) -> bool:
    upstream = EFFECT_STAGES[law.stage].slot in (Slot.TIMING, Slot.VALVE)
    if bench.side.name == "valve":
        return upstream
    return not (upstream and bench.driven)


def fit_effect(effect: Effect, bench: Bench) -> Candidate | None:
    """The best law of one effect, roughly; None when none gives a finite response."""
    fitted = [fit_law(effect, law, bench) for law in effect.laws if _law_shows(law, bench)]
    known = [candidate for candidate in fitted if candidate is not None]
    return min(known, key=lambda candidate: candidate.score) if known else None


def fit_law(effect: Effect, law: Law, bench: Bench) -> Candidate | None:
    """Scan the law's grid and go on from its best point by a few steps."""
    trial = _Trial(effect, law, bench)
    unit = bench.scales[law.scale]
    best: tuple[float, Column, dict[str, float]] | None = None
    for shape in law.shapes:
        fixed = {name: value for name, value in shape.items() if name not in law.free}
        for size in (sign * size * unit for sign in law.signs for size in law.grid):
            x = np.array([size, *(shape.get(name, trial.usual(name)) for name in law.free[1:])])
            if not trial.low[0] <= size <= trial.high[0]:
                continue
            cost = square_sum(trial.weighed(x, fixed))
            if np.isfinite(cost) and (best is None or cost < best[0]):
                best = (cost, x, fixed)
    if best is None:
        return None
    _, start, fixed = best
    if law.scan:
        tries = [np.array([start[0] * share, *start[1:]]) for share in np.linspace(0.86, 1.14, 15)]
        start = min(tries, key=lambda x: square_sum(trial.weighed(x, fixed)))
    return trial.settled(start, fixed, 3)


def refit(candidate: Candidate, bench: Bench) -> Candidate | None:
    """The same law and shapes, fitted again from where they stand."""
    trial = _Trial(candidate.effect, candidate.law, bench)
    fixed = {
        name: value
        for name, value in candidate.applied.numbers.items()
        if name not in candidate.law.free and name not in candidate.law.tied
    }
    return trial.settled(candidate.sizes, fixed, 8)


class _Trial:
    """One law on one bench: predictions and weighed residuals for numbers."""

    def __init__(self, effect: Effect, law: Law, bench: Bench) -> None:
        self.effect, self.law, self.bench = effect, law, bench
        self.looseness = LOOSENESS * bench.side.rms(bench.side.gap)
        self._whiten = bench.side.whitened(self.looseness)
        self._measured, self._used = bench.measured, bench.used
        upstream = EFFECT_STAGES[law.stage].slot in (Slot.TIMING, Slot.VALVE)
        self._other = bench.valves if upstream else None
        self._numbers = {number.name: number for number in EFFECT_STAGES[law.stage].numbers}
        bounds = [law.bounds.get(name, (self._numbers[name].low, self._numbers[name].high)) for name in law.free]
        self.low, self.high = np.array([pair[0] for pair in bounds]), np.array([pair[1] for pair in bounds])

    def usual(self, name: str) -> float:
        return self._numbers[name].neutral

    def applied(self, x: Column, fixed: Mapping[str, float]) -> Applied:
        values = dict(fixed) | {name: float(value) for name, value in zip(self.law.free, x, strict=True)}
        return Applied(self.law.stage, values | {name: values[owner] for name, owner in self.law.tied.items()})

    def raw(self, x: Column, fixed: Mapping[str, float]) -> Column:
        with np.errstate(invalid="ignore"):  # a law may run away: its cost is then not finite, and it is passed over
            left: Column = (self._measured - self.bench.predicted([self.applied(x, fixed)])) * self._used
        return left

    def weighed(self, x: Column, fixed: Mapping[str, float]) -> Column:
        own = self._whiten(self.raw(x, fixed))
        return own if self._other is None else np.concatenate([own, self._valves(self._other, x, fixed)])

    def _valves(self, valves: Bench, x: Column, fixed: Mapping[str, float]) -> Column:
        left = (valves.measured - valves.predicted([self.applied(x, fixed)])) * valves.used
        return valves.side.whitened()(left)

    def valves_cost(self, x: Column, fixed: Mapping[str, float]) -> float:
        """Chi-square of the pressures with this effect; 0 where they do not count."""
        return 0.0 if self._other is None else square_sum(self._valves(self._other, x, fixed))

    def valves_at_rest(self) -> float:
        """The same without it: it is charged for what it makes worse there, and gets no credit for what it makes
        better."""
        return 0.0 if self._other is None else square_sum(self._other.side.whitened()(self._other.side.gap))

    def settled(self, start: Column, fixed: Mapping[str, float], steps: int) -> Candidate | None:
        """The candidate at the optimum near `start`, judged on held-out parts."""
        side, law = self.bench.side, self.law
        fit = descend(lambda x: self.weighed(x, fixed), start, self.low, self.high, steps)
        if not np.isfinite(fit.cost):
            return None
        held_out, spread = cross_validated(fit, side)
        if law.needs and not any(
            abs(x) > PLAIN * deviation
            for name, x, deviation in zip(law.free, fit.x, spread, strict=True)
            if name in law.needs
        ):
            return None
        residual = self.raw(fit.x, fixed)
        left = side.rms(side.beside(residual, self.looseness)) * float(
            np.sqrt(max(held_out, 1e-12) / max(fit.cost, 1e-12))
        )
        valves, at_rest = self.valves_cost(fit.x, fixed), self.valves_at_rest()
        score = max(held_out - valves, 1e-9) + max(valves - at_rest, 0.0) + 2.0 * law.charge + 2.0 * (len(law.free) - 1)
        at_bound = sum(
            name in law.bounds and abs(x - self.usual(name)) > 1e-9 and (x <= low + 1e-9 or x >= high - 1e-9)
            for name, x, low, high in zip(law.free, fit.x, self.low, self.high, strict=True)
        )
        odds = AT_BOUND * at_bound - min(max(at_rest - valves, 0.0), MOST_CREDIT)
        score *= float(np.exp(odds / SHARPNESS))
        return Candidate(self.effect, law, self.applied(fit.x, fixed), score, left, residual, fit.x, spread)


def cross_validated(fit: Fit, side: Side) -> tuple[float, Column]:
    """Chi-square over held-out parts, each with the numbers fitted to the others, and the numbers' standard deviations.

    Parts are records, or eight stretches of time where there are fewer than three records. The refits are Gauss-Newton
    steps from the common optimum, so nothing is simulated again.
    """
    n, k = len(side.gap), len(fit.x)
    parts = fold_of(side)
    grams, pulls, costs = normal(fit.jacobian[:n], fit.residual[:n], parts, int(parts.max()) + 1)
    tail, rest = fit.jacobian[n:], fit.residual[n:]
    whole_gram, whole_pull = grams.sum(axis=0) + tail.T @ tail, pulls.sum(axis=0) + tail.T @ rest
    diagonal = np.diag(np.diag(whole_gram) + 1e-30)
    limit = np.abs(fit.x) + 1e-12
    total, scatter = square_sum(rest), np.zeros((k, k))
    for gram, pull, cost in zip(grams, pulls, costs, strict=True):
        step = np.clip(-np.linalg.solve(whole_gram - gram + 1e-6 * diagonal, whole_pull - pull), -limit, limit)
        total += cost + 2.0 * float(step @ pull) + float(step @ gram @ step)
        share = pull - gram @ np.linalg.solve(whole_gram + 1e-9 * diagonal, whole_pull)
        scatter += np.outer(share, share)
    inverse = np.linalg.inv(whole_gram + 1e-9 * diagonal)
    count = max(len(costs), 2)
    covariance = inverse @ (scatter * count / (count - 1)) @ inverse + inverse
    return total, np.sqrt(np.maximum(np.diag(covariance), 0.0))


def fold_of(side: Side) -> Column:
    """(n,) the part that each row belongs to: its record, or a stretch of time where records are few."""
    records = side.records.astype(int)
    count = records.max() + 1
    if count >= 3:
        return records % FOLDS if count > FOLDS else records
    folds = np.zeros(len(records), dtype=int)
    for record in range(count):
        rows = np.flatnonzero(records == record)
        halves = 2 if side.name == "valve" else 1
        for half in np.array_split(rows, halves):
            folds[half] = np.minimum(np.arange(len(half)) * FOLDS // max(len(half), 1), FOLDS - 1)
    return folds
