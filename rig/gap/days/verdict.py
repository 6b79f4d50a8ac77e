"""Which names stay in the set, how sure they are, and when causes explain a side.

Thresholds stand here with where they come from; they were set on development data only (docs/explanation/diagnosis.md).
"""

from collections.abc import Sequence

import numpy as np

from rig.gap.days.attribute import LOOSENESS, SHARPNESS, Candidate
from rig.gap.days.side import Side
from rig.gap.days.trigger import STRUCTURE, trigger
from rig.gap.hypotheses.library import LIBRARY, effect_class
from rig.identify.descent import square_sum

KNOWN = 0.73
"""Explained fraction below which the library does not explain a side."""
HALF = 0.5
"""Explained fraction that suffices where what is left is no gap any more, or where every other effect explains plainly
less."""
PLAINLY = 2.0
"""Chi-square of the next effect over that of the best from which on the best stands alone."""
SECOND_CAUSE = 0.3
"""A further cause must take away this share of what the first ones leave above the floor."""
UNCLEARED = 0.05
"""What is left of an effect's chance when it leaves an offset, gain or lag that another effect takes away."""
MISFITS = 1.7
"""How many times its law's usual misfit an effect may leave before something else must be there."""
LEAST_EXACT = 8.0
"""Most that odds fall, in nats, for a law that leaves more than it usually does."""
BLURRED = 0.3
"""Share of the floor by which a misfit is blurred."""
BORROWED = 1.0
"""What a law costs, in nats, that is another effect's own: of two names for one course of events the owner's comes
first."""
FROM_ANGLE = 0.25
"""Share of the log odds that counts where no pressures were measured: the laws then act on pressures that are
themselves modelled."""
IN_SET = 0.05
"""Names with at least this probability stay in the set."""


def sufficient(fraction: float, ranking: Sequence[Candidate], still_found: bool, remainder: bool) -> bool:
    """Whether the accepted causes explain a side: by their share; by half of it when nothing stands out any more,
    because the share of a small gap is blurred by the floor's scatter, or no more `remainder` than their laws usually
    leave; or by half of it when no other effect comes near, because a law that repeats only roughly (a regulator that
    holds, then jumps) never explains more."""
    alone = len(ranking) > 1 and ranking[1].score > PLAINLY * ranking[0].score
    return fraction >= (HALF if alone or not still_found or not remainder else KNOWN)


def misfit_share(candidate: Candidate, side: Side) -> float:
    """What a candidate leaves of the gap beside the floor, as a share of the rms."""
    beside = max(candidate.left**2 - side.remainder**2, 0.0)
    return float(np.sqrt(beside)) / max(side.rms(side.gap), 1e-12)


def leaves_too_much(causes: Sequence[Candidate], side: Side) -> bool:
    """Whether causes leave more of a side than its floor and the misfit of the loosest of their laws: then they are not
    all there is."""
    law = MISFITS * max(law_misfit(candidate) for candidate in causes) * side.rms(side.gap)
    return causes[-1].left > float(np.hypot(STRUCTURE * side.remainder, law))


def law_misfit(candidate: Candidate) -> float:
    """How much a candidate's law usually leaves: that of the effect whose own law it is."""
    return LIBRARY[candidate.applied.effect].misfit


def exactness(candidate: Candidate, side: Side) -> float:
    """Log odds from how exact a law is known to be: an exact one that leaves much is unlikely, a rough one that leaves
    little as well."""
    blur = BLURRED * side.remainder / max(side.rms(side.gap), 1e-12)
    usual = float(np.hypot(law_misfit(candidate), blur))
    borrowed = BORROWED if candidate.applied.effect != candidate.effect.name else 0.0
    return -float(np.log(usual)) - min(0.5 * (misfit_share(candidate, side) / usual) ** 2, LEAST_EXACT) - borrowed


def probabilities(ranking: Sequence[Candidate], side: Side, pressures: bool) -> list[float]:
    """How likely each candidate is, from how much less it leaves than the others and how exact its law is; they add up
    to 1."""
    if not ranking:
        return []
    scores = np.array([max(candidate.score, 1e-9) for candidate in ranking])
    logs = -0.5 * SHARPNESS * np.log(scores / scores.min()) + np.array(
        [exactness(candidate, side) for candidate in ranking]
    )
    weights = np.exp((logs - logs.max()) * (1.0 if pressures else FROM_ANGLE))
    return [float(weight) for weight in weights / weights.sum()]


def clearing_first(ranking: Sequence[Candidate], side: Side, pressures: bool) -> tuple[list[Candidate], list[float]]:
    """The ranking and its probabilities: where some effects leave no offset, gain or lag but what days bring, the
    others are less likely.

    The chi-square hardly sees an offset of the size of a few days' spreads among thousands of rows; the trigger does.
    """
    loose = LOOSENESS * side.rms(side.gap)
    clear = [len(one.residual) == len(side.gap) and not trigger(side, one.residual, loose).by_modes for one in ranking]
    chances = probabilities(ranking, side, pressures)
    if any(clear):
        chances = [chance * (1.0 if good else UNCLEARED) for chance, good in zip(chances, clear, strict=True)]
    total = sum(chances)
    order = sorted(range(len(ranking)), key=lambda k: -chances[k])
    return [ranking[k] for k in order], [chances[k] / total for k in order]


def name_set(ranking: Sequence[Candidate], chances: Sequence[float], pressures: bool) -> list[str]:
    """Names that cannot be told from the best one: those with a fair probability, and of its declared class those that
    fit as well."""
    if not ranking:
        return []
    best = ranking[0].effect.name
    word = effect_class(best, pressures)
    kept = [best]
    for candidate, chance in zip(ranking[1:], chances[1:], strict=True):
        limit = 0.3 * IN_SET if effect_class(candidate.effect.name, pressures) == word else IN_SET
        if chance >= limit:
            kept.append(candidate.effect.name)
    return kept


def explained(before: float, after: float, floor: float, most: float = 1.0) -> float:
    """EF = (G - E) / (G - F) in mean squares, from rms values, at most `most`; 0 when nothing stands above the
    floor."""
    gap = before**2 - floor**2
    return float(np.clip((before**2 - after**2) / gap, -1.0, most)) if gap > 1e-12 else 0.0


def explained_share(causes: Sequence[Candidate], side: Side) -> float:
    """The explained fraction of a side: of its rms, or of its chi-square, where what sessions usually differ by need
    not be explained."""
    weigh, left = side.whitened(), causes[-1].residual
    before, after = square_sum(weigh(side.gap)), square_sum(weigh(left))
    beside_modes = float(np.clip((before - after) / max(before - side.effective, 1e-9), 0.0, 1.0))
    return max(explained(side.rms(side.gap), side.rms(left), side.floor), beside_modes)
