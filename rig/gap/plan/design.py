"""A session that tells most in a given time: records chosen from a pool by the information that they add."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rig.excite.sweep import Entry
from rig.gap.hypotheses.library import Effect
from rig.gap.plan.candidates import lasts_s, planned
from rig.gap.plan.capability import by_effect, first_of_each, named_separation, seen_separation
from rig.gap.plan.directions import Direction, columns, usual_directions
from rig.gap.plan.information import Information, inform, separations
from rig.gap.plan.planned_records import KnownRig, expect_planned, factors_of
from rig.gap.plan.settings import LEAST_SCORE_GAIN
from rig.gap.priors import Fitted, Odds, Prior
from rig.parallel import each, executor
from rig.record import Column

SWAPS = 3
"""Passes that try another record in place of each chosen one; more change nothing on the rigs tried."""

MOST_SWAPS = 40
"""Records that are tried in place of a chosen one. More: slower."""
SIZING_RECORDS = 10
"""Records on which the effects' usual sizes are found. More: slower."""


@dataclass(frozen=True)
class DetectionPower:
    """How well a selection of records would tell effects, in the mean over the rigs that it was designed on."""

    seen: float
    """Share of the effects that would be seen at their usual size; parts of what it takes count in part."""
    parted: float
    """Share of the pairs of effects that would be told apart."""

    @property
    def score(self) -> float:
        """What the design makes as large as it can."""
        return 0.5 * (self.seen + self.parted)


@dataclass(frozen=True)
class Design:
    """The chosen records, what they tell, and how long they take on the rig."""

    entries: tuple[Entry, ...]
    power: DetectionPower
    seconds: float


def design(
    rigs: Sequence[KnownRig],
    pool: Sequence[Entry],
    seconds: float,
    effects: Sequence[Effect],
    settings: Fitted,
    report: Callable[[int], None] = lambda done: None,
) -> Design:
    """The records of the pool that together tell most within `seconds`: the best addition a second, again and again,
    then exchanges (Fedorov 1972). It ends before the time does where no record adds LEAST_SCORE_GAIN: the likelihood
    believes long sessions no more than those of SESSION_S, so that a record with little to tell takes from the
    others."""
    known = _all_known(rigs, pool, effects, settings, report)
    times = [lasts_s(entry) for entry in pool]
    chosen: list[int] = []
    while (more := _addition(known, chosen, times, seconds)) is not None:
        chosen.append(more)
    for _ in range(SWAPS):
        if not _exchanged(known, chosen, times, seconds):
            break
    return Design(tuple(pool[k] for k in chosen), power_of(known, chosen), sum(times[k] for k in chosen))


def appraise(
    rigs: Sequence[KnownRig], entries: Sequence[Entry], effects: Sequence[Effect], settings: Fitted
) -> DetectionPower:
    """What a session that there is would tell."""
    return power_of([_known(rig, entries, effects, settings) for rig in rigs], range(len(entries)))


@dataclass(frozen=True)
class _Known:
    """The factors of one rig under the whole pool."""

    factors: tuple[Information, ...]
    owners: tuple[tuple[str, ...], ...]
    """Of each factor, which effect each direction belongs to."""
    needed: tuple[Column, ...]
    """Of each factor (e,), standard deviations at which each effect is seen."""

    def beside(self, chosen: Sequence[int]) -> "_Known":
        """The same where these records are made in any case."""
        return replace(self, factors=tuple(factor.beside(chosen) for factor in self.factors))


def _all_known(
    rigs: Sequence[KnownRig],
    pool: Sequence[Entry],
    effects: Sequence[Effect],
    settings: Fitted,
    report: Callable[[int], None],
) -> list[_Known]:
    """What is known of every rig: several beside each other in processes."""
    work = partial(_numbered, pool=pool, effects=effects, settings=settings)
    if len(rigs) == 1:
        alone = [work((0, rigs[0]))[1]]
        report(1)
        return alone
    with executor() as workers:
        found = dict(each(workers, work, enumerate(rigs), report))
    return [found[number] for number in range(len(rigs))]


def _numbered(
    rig: tuple[int, KnownRig], pool: Sequence[Entry], effects: Sequence[Effect], settings: Fitted
) -> tuple[int, _Known]:
    """Beside each other the rigs come back in any order."""
    return rig[0], _known(rig[1], pool, effects, settings)


def _known(rig: KnownRig, pool: Sequence[Entry], effects: Sequence[Effect], settings: Fitted) -> _Known:
    fitting = [effect for effect in effects if not effect.signature]
    factors: list[Information] = []
    owners: list[tuple[str, ...]] = []
    needed: list[Column] = []
    whole, some = (
        factors_of(expect_planned(rig, planned(records, rig.grid_ns)), settings) for records in (pool, _few(pool))
    )
    for problem, few in zip(whole, some, strict=True):
        if directions := usual_directions(fitting, problem, settings.prior.share, few):
            names = [one.effect.name for one in directions]
            known = inform(problem, columns(directions))
            kept = known.distinct(names)
            factors.append(known.only(kept))
            owners.append(tuple(names[k] for k in kept))
            needed.append(_needed(directions, settings.prior, problem.forward.odds, len(fitting)))
    return _Known(tuple(factors), tuple(owners), tuple(needed))


def _few(pool: Sequence[Entry]) -> list[Entry]:
    """Records from all over the pool."""
    return list(pool[:: max(1, len(pool) // SIZING_RECORDS)])


def _needed(directions: Sequence[Direction], prior: Prior, odds: Odds, effects: int) -> Column:
    choices = [directions[k].choices for k in first_of_each([one.effect.name for one in directions])]
    return np.array([seen_separation(prior, odds, count, effects) for count in choices])


def power_of(known: Sequence[_Known], chosen: Sequence[int]) -> DetectionPower:
    """What some records of the pool tell, in the mean over the rigs."""
    if not chosen:
        return DetectionPower(0.0, 0.0)
    both = np.array([_power_on(rig, chosen) for rig in known])
    return DetectionPower(float(both[:, 0].mean()), float(both[:, 1].mean()))


def _power_on(rig: _Known, chosen: Sequence[int]) -> tuple[float, float]:
    seen: list[float] = []
    parted: list[float] = []
    for factor, owners, needed in zip(rig.factors, rig.owners, rig.needed, strict=True):
        between = by_effect(separations(factor.of(chosen)), owners)
        apart = ~np.eye(len(needed), dtype=bool)
        seen.extend(np.minimum(np.diag(between) / needed, 1.0))
        parted.extend(np.minimum(between[apart] / named_separation(factor.prior), 1.0))
    return float(np.mean(seen)), float(np.mean(parted))


def _addition(known: Sequence[_Known], chosen: Sequence[int], times: Sequence[float], seconds: float) -> int | None:
    """The record that adds most a second; None when none fits any more, or adds LEAST_SCORE_GAIN."""
    left = seconds - sum(times[k] for k in chosen)
    before = power_of(known, chosen).score
    fitting = [k for k in range(len(times)) if k not in chosen and times[k] <= left]
    gains = {k: score - before for k, score in _scores(known, chosen, fitting).items()}
    worth = [k for k, gain in gains.items() if gain >= LEAST_SCORE_GAIN]
    return max(worth, key=lambda k: gains[k] / times[k], default=None)


def _scores(known: Sequence[_Known], chosen: Sequence[int], further: Sequence[int]) -> dict[int, float]:
    """Of the chosen records with each of the further ones."""
    beside = [one.beside(chosen) for one in known]
    return {k: power_of(beside, [k]).score for k in further}


def _short_list(known: Sequence[_Known], chosen: Sequence[int]) -> list[int]:
    """The records of the pool that would add most to the chosen ones."""
    pool = range(known[0].factors[0].gram.shape[0])
    added = _scores(known, chosen, [k for k in pool if k not in chosen])
    return sorted(added, key=lambda k: -added[k])[:MOST_SWAPS]


def _exchanged(known: Sequence[_Known], chosen: list[int], times: Sequence[float], seconds: float) -> bool:
    """Whether another record in place of one of the chosen tells more; each is replaced by the best of those that would
    add most to all of them."""
    better, listed = False, _short_list(known, chosen)
    for place in range(len(chosen)):
        others = [k for n, k in enumerate(chosen) if n != place]
        left = seconds - sum(times[k] for k in others)
        fitting = [k for k in (*listed, chosen[place]) if k not in others and times[k] <= left]
        scores = _scores(known, others, fitting)
        best = max(scores, key=lambda k: scores[k])
        if scores[best] > scores[chosen[place]] + 1e-6:
            chosen[place], better = best, True
    return better
