"""Two causes on one side: whether the best single one suffices, and which second one beside it takes away what it
leaves."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.gap.days.attribute import LOOSENESS, Candidate, rank, refit
from rig.gap.days.bench import Bench
from rig.gap.days.trigger import trigger
from rig.gap.days.verdict import SECOND_CAUSE, leaves_too_much
from rig.gap.hypotheses.library import Effect, effect_class
from rig.identify.descent import square_sum

LEADERS, LEADERS_BLIND = 2, 4
"""How many of the best single causes are tried as the first of a pair: with pressures, and from the angle alone."""
PLAINLY_LEFT, BESIDE_A_LAW = 2.0, 0.6
"""From the angle alone a rough law may well take in a second cause: one is tried also where the first leaves no more
than its law, but this many remainders, and it must take away this share of the mean square above the floor."""
MAKEWEIGHT = 0.12
"""A cause beside another on the same side that explains less than this of the gap by itself mends the other's law."""
SEVERAL, SETTLED = 8, 4
"""How many second causes are fitted for an offset, gain or lag that the first one leaves, and how many of those that
relieve it are fitted again together with it."""


def with_second(ranking: Sequence[Candidate], effects: Sequence[Effect], bench: Bench) -> list[Candidate]:
    """The best candidate, and a second one beside it when the first leaves a gap that the second takes away. A single
    one that leaves none, though it fits less well, goes before two.

    Either the second takes its share of the mean square that the first leaves above the floor; or what the first leaves
    is more of an offset, gain or lag than days bring, and with the second it is not.
    """
    first = ranking[0]
    side = bench.side
    loose = 1.5 * LOOSENESS * side.rms(side.gap)
    before = trigger(side, first.residual, loose)
    within_law = not (before.by_modes or leaves_too_much([first], side))
    if within_law and not (_blind(bench) and first.left > PLAINLY_LEFT * side.remainder):
        return [first]
    alone = [
        one for one in ranking if len(one.residual) == len(side.gap) and not trigger(side, one.residual, loose).found
    ]
    if alone:
        return alone[:1]
    floor = side.remainder**2
    best: list[Candidate] = [first]
    goal = floor + (1.0 - (BESIDE_A_LAW if within_law else SECOND_CAUSE)) * (first.left**2 - floor)
    calm: list[list[Candidate]] = []
    for leader in ranking[: _leaders(bench)]:
        seconds = _beside(leader, effects, bench, SEVERAL if before.by_modes else 1)
        for second in seconds[:1]:
            pair = _settled(leader, second, bench)
            if pair[1].left ** 2 < goal:
                best, goal = pair, pair[1].left ** 2
        if before.by_modes and leader is first:
            fitted = [second for second in seconds if len(second.residual) == len(side.gap)]
            quiet = [second for second in fitted if not trigger(side, second.residual, loose).by_modes]
            calm = [_settled(leader, second, bench) for second in quiet[:SETTLED]]
    if len(best) > 1 and not (before.by_modes and trigger(side, best[1].residual, loose).by_modes):
        return best
    return min(calm, key=lambda pair: pair[1].score, default=best)


def _leaders(bench: Bench) -> int:
    return LEADERS_BLIND if _blind(bench) else LEADERS


def _blind(bench: Bench) -> bool:
    """Whether no pressures were measured."""
    return bench.side.name == "angle" and bench.beside is None and not bench.driven


def _beside(leader: Candidate, effects: Sequence[Effect], bench: Bench, several: int) -> list[Candidate]:
    """Second causes beside the leader, best first; at least `several` of them are fitted to all records. None of the
    leader's own class: what two that look alike leave together says more about the laws than about the rig."""
    around = replace(bench, accepted=(leader.applied,))
    word = effect_class(leader.effect.name, True)
    others = [effect for effect in effects if effect_class(effect.name, True) != word]
    return rank(others, around, least=several, reach=1.2)


def _settled(first: Candidate, second: Candidate, bench: Bench) -> list[Candidate]:
    """Both fitted again, each beside the other, twice."""
    for _ in range(2):
        first = refit(first, replace(bench, accepted=(second.applied,))) or first
        second = refit(second, replace(bench, accepted=(first.applied,))) or second
    return [first, second]


def makeweight(causes: Sequence[Candidate], bench: Bench) -> Candidate | None:
    """The one of two causes that explains next to nothing of the side's gap by itself, if any: it is there to mend the
    other, and one effect that the library does not hold would look the same."""
    alone = replace(bench, accepted=())
    gap = square_sum(bench.side.gap)
    left = [square_sum((alone.measured - alone.predicted([cause.applied])) * alone.used) for cause in causes]
    weakest = int(np.argmax(left))
    return causes[weakest] if len(causes) > 1 and 1.0 - left[weakest] / gap < MAKEWEIGHT else None
