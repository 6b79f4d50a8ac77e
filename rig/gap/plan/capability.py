"""What a rig can tell before anything is wrong: the smallest size of each effect that would be seen, and named, and
what cannot be told from what."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import ndtri

from rig.gap.evidence.posterior import acting
from rig.gap.evidence.usual_sizes import times_usual
from rig.gap.hypotheses.inverse_problems import InverseProblem
from rig.gap.hypotheses.library import Effect, Law
from rig.gap.plan.directions import Direction, changed_at, columns, ladder, unit_of, usual_directions
from rig.gap.plan.information import inform, needed_separation, separations
from rig.gap.plan.planned_records import factors_of
from rig.gap.plan.settings import CHANCE, NAMED
from rig.gap.priors import Fitted, Odds, Prior
from rig.gap.reference.expected import Expected
from rig.gap.settings import FALSE_ALARM_RATE
from rig.record import Column


@dataclass(frozen=True)
class Ability:
    """What can be told of one effect on some records."""

    effect: str
    stage: str
    factor: str
    """pressures or angle: where it shows."""
    detectable: float | None
    nameable: float | None
    """Sizes in `unit`; None where no size of the law's range is enough."""
    unit: str
    rival: str | None
    """The effect that it is hardest to tell from."""


@dataclass(frozen=True)
class Capability:
    """What some records can tell."""

    abilities: tuple[Ability, ...]
    confusable: tuple[tuple[str, str], ...]
    """Pairs that these records cannot part at a usual size."""
    names: tuple[str, ...]
    separation: Column
    """(e, e) standard deviations between effect i at a usual size and effect j at its likeliest; on the diagonal, from
    nothing."""
    needed: float
    """Standard deviations from which two are told apart."""


def capability(expected: Expected, effects: Sequence[Effect], settings: Fitted) -> Capability:
    """What the records of `expected` could tell of each effect if it were there."""
    fitting = [effect for effect in effects if not effect.signature]
    abilities: list[Ability] = []
    blocks: list[tuple[list[str], Column]] = []
    for problem in factors_of(expected, settings):
        directions = usual_directions(fitting, problem, settings.prior.share)
        if not directions:
            continue
        known = inform(problem, columns(directions))
        apart = separations(known.of(range(len(known.seconds))))
        owners = [one.effect.name for one in directions]
        between = by_effect(apart, owners)
        blocks.append(([owners[k] for k in first_of_each(owners)], between))
        abilities.extend(_abilities(problem, directions, between, fitting))
    needed = named_separation(settings.prior)
    names, matrix = _joined(blocks)
    pairs = _confusable(names, matrix, needed)
    return Capability(tuple(abilities), tuple(pairs), tuple(names), matrix, needed)


@cache
def named_separation(prior: Prior) -> float:
    """Standard deviations from a rival at which an effect is named with the chance CHANCE."""
    return needed_separation(float(np.log(NAMED / (1.0 - NAMED))), prior, float(ndtri(CHANCE)))


@cache
def seen_separation(prior: Prior, odds: Odds, choices: int, effects: int) -> float:
    """Standard deviations from nothing at which an effect is seen with the chance CHANCE. Its evidence must outweigh
    the prior odds of no cause, and more than any of so many `effects` reaches by chance at FALSE_ALARM_RATE (Markov's
    inequality on the evidence ratio); and the fit pays for its `choices` (Occam's factor)."""
    nats = max(odds.none, float(np.log(effects / FALSE_ALARM_RATE)))
    quantile = float(ndtri(CHANCE))
    found = needed_separation(nats, prior, quantile)
    paid = float(np.log(prior.share_spread * choices * max(found, 1.0)))
    return needed_separation(nats + max(paid, 0.0), prior, quantile)


def by_effect(apart: Column, names: Sequence[str]) -> Column:
    """(e, e) from separations (m, m) of directions of the effects `names`, which stand together effect by effect: each
    effect by its law that is seen best, against the rival's law that comes nearest."""
    starts = first_of_each(names)
    ends = [*starts[1:], len(names)]
    seen = np.diag(apart)
    best = [start + int(np.argmax(seen[start:end])) for start, end in zip(starts, ends, strict=True)]
    out: Column = np.minimum.reduceat(apart[best], starts, axis=1)
    np.fill_diagonal(out, seen[best])
    return out


def first_of_each(names: Sequence[str]) -> list[int]:
    """Where the directions of each effect begin."""
    return [k for k, name in enumerate(names) if k == 0 or name != names[k - 1]]


def _abilities(
    problem: InverseProblem, directions: Sequence[Direction], between: Column, effects: Sequence[Effect]
) -> list[Ability]:
    prior, choices = problem.forward.prior, acting(effects, problem)
    firsts = [directions[k] for k in first_of_each([one.effect.name for one in directions])]
    found = []
    for i, first in enumerate(firsts):
        others = [j for j in range(len(firsts)) if j != i]
        nearest = min(others, key=lambda j: between[i, j]) if others else None
        share = 1.0 if nearest is None else between[i, nearest] / max(between[i, i], 1e-12)
        seen = seen_separation(prior, problem.forward.odds, first.choices, len(effects))
        detectable = _size_at(problem, first, seen, choices)
        nameable = _size_at(problem, first, max(seen, named_separation(prior) / max(share, 1e-9)), choices)
        rival = None if nearest is None else firsts[nearest].effect.name
        found.append(
            Ability(
                first.effect.name, first.effect.stage, problem.name, detectable, nameable, unit_of(first.law), rival
            )
        )
    return found


def _size_at(problem: InverseProblem, direction: Direction, separation: float, effects: int) -> float | None:
    """The size of a law at which it lies that many standard deviations from nothing, and beyond what is usual beside so
    many effects: between the steps of its ladder in proportion on logarithmic axes; None where none is enough."""
    law: Law = direction.law
    sign = float(np.sign(direction.size)) if law.signs != (1.0,) else 1.0
    sizes, far = [], []
    for size in ladder(law, sign, problem):
        change = changed_at(law, next(law.shapes_in(problem.forward.scales)), size, problem)
        if change is not None:
            sizes.append(size)
            unusual = times_usual(direction.effect.name, change, effects, problem.forward)
            far.append(min(_distance(problem, change) / separation, unusual))
    order = np.argsort(far)
    reach, at = np.array(far)[order], np.array(sizes)[order]
    if not len(reach) or reach[-1] < 1.0:
        return None
    k = int(np.searchsorted(reach, 1.0))
    if k == 0:
        return float(at[0])
    low, high = max(reach[k - 1], 1e-12), max(reach[k], 1e-12)
    part = float(-np.log(low) / max(np.log(high / low), 1e-12)) if reach[k - 1] > 0.0 else 1.0
    return float(at[k - 1] + np.clip(part, 0.0, 1.0) * (at[k] - at[k - 1]))


def _distance(problem: InverseProblem, change: Column) -> float:
    """Standard deviations between a change (n,) and nothing."""
    factor = problem.forward.factor
    return float(np.sqrt(max(factor.healthy.chi_square(factor.lines.of(change)), 0.0)))


def _joined(blocks: Sequence[tuple[list[str], Column]]) -> tuple[list[str], Column]:
    """The factors' matrices in one: effects of different factors are told apart by where they show, so that each lies
    as far from them as from nothing."""
    names = list(dict.fromkeys(name for block, _ in blocks for name in block))
    out = np.full((len(names), len(names)), np.inf)
    for block, between in blocks:
        at = [names.index(name) for name in block]
        out[np.ix_(at, at)] = np.minimum(out[np.ix_(at, at)], between)
    return names, np.where(np.isinf(out), np.diag(out)[:, None], out)


def _confusable(names: Sequence[str], matrix: Column, needed: float) -> list[tuple[str, str]]:
    return [
        (names[i], names[j])
        for i in range(len(names))
        for j in range(i + 1, len(names))
        if min(matrix[i, j], matrix[j, i]) < needed <= min(matrix[i, i], matrix[j, j])
    ]
