"""Which of the likeliest effects an answer keeps: those that close something, and without which the simulator follows
the records no better."""

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from rig.gap.answer.findings import Findings, Kept
from rig.gap.answer.how_far.augment import beside_pressures, remaining_gap
from rig.gap.evidence.posterior import Posterior
from rig.gap.hypotheses.fit import Fit
from rig.gap.hypotheses.inverse_problems import PRESSURES
from rig.gap.hypotheses.library import NONE
from rig.gap.reference.gaps import rms_of
from rig.gap.settings import BEHIND_CLOSES, LEAST_CLOSED, SPOILT


def kept_effects(findings: Findings, before: float) -> list[Kept]:
    """The named effects that close something, without any that makes the simulator, with the others in it, follow these
    records worse."""
    named = [(posterior, fit) for posterior, fit in findings.named if share_closed(posterior, fit) > LEAST_CLOSED]
    left = cache(lambda *some: _left(findings, [named[k][1] for k in some], before))
    beside = cache(lambda *some: _left_beside_pressures(findings, [named[k] for k in some]))
    kept = tuple(range(len(named)))
    while (spoiler := _spoiler(kept, _open_to_doubt(findings, kept, named, beside), left)) is not None:
        kept = _but(kept, spoiler)
    return [Kept(*named[k], left(k)) for k in kept]


def dropped_effects(findings: Findings, kept: Sequence[Kept]) -> list[tuple[Posterior, Fit]]:
    """The effects that are the likeliest of their factor and close something of it, and are not named because the
    simulator is no better with them."""
    return [one for one in effects_not_kept(findings, kept) if share_closed(*one) > LEAST_CLOSED]


def effects_not_kept(findings: Findings, kept: Sequence[Kept]) -> list[tuple[Posterior, Fit]]:
    """The effects that are the likeliest of their factor and are not named."""
    return [(posterior, fit) for posterior, fit in findings.named if not any(fit is one.fit for one in kept)]


def share_closed(posterior: Posterior, fit: Fit) -> float:
    """Share of its own factor's gap that an effect closes, in mean squares above what is expected anyhow."""
    effective = posterior.plain.factor.healthy.effective
    before = posterior.plain.factor.healthy.chi_square(posterior.residual(NONE))
    after = fit.forward.factor.healthy.chi_square(posterior.residual(fit.effect.name))
    return float(np.clip((before - after) / max(before - min(effective, 0.5 * before), 1e-9), 0.0, 1.0))


def _open_to_doubt(
    findings: Findings,
    kept: tuple[int, ...],
    named: Sequence[tuple[Posterior, Fit]],
    beside: Callable[..., float],
) -> list[int]:
    """Which of the kept effects the simulator may be better off without: those found on the angle, but for any that
    closes the larger part of the gap beside the measured pressures, where an effect ahead of them is named as well. A
    law of the valves that is rough speaks against none of those."""
    behind = [k for k in kept if named[k][0].problem.name != PRESSURES]
    if not findings.expected.driven or len(behind) == len(kept):
        return behind
    return [k for k in behind if beside(*kept) ** 2 > (1.0 - BEHIND_CLOSES) * beside(*_but(kept, k)) ** 2]


def _spoiler(kept: tuple[int, ...], doubtful: Sequence[int], left: Callable[..., float]) -> int | None:
    """Which of the doubtful effects the simulator is better off without, most of all; None where it needs each beside
    the others: friction hides what a larger gain of a valve does, and the other way round."""
    together = left(*kept)
    without = {k: left(*_but(kept, k)) for k in doubtful}
    spoilt = {k: rms_deg for k, rms_deg in without.items() if together > SPOILT * rms_deg}
    return min(spoilt, key=lambda k: spoilt[k]) if spoilt else None


def _but(kept: tuple[int, ...], one: int) -> tuple[int, ...]:
    return tuple(k for k in kept if k != one)


def _left(findings: Findings, fits: Sequence[Fit], before: float) -> float:
    """Rms of the simulator's error, deg, with these effects in it."""
    if not fits:
        return before
    return rms_of(
        remaining_gap(findings.simulator, [fit.applied for fit in fits], findings.expected), findings.expected.pairs
    )


def _left_beside_pressures(findings: Findings, some: Sequence[tuple[Posterior, Fit]]) -> float:
    """Rms of the simulator's error, deg, under the pressures that were measured."""
    ahead = [fit.applied for posterior, fit in some if posterior.problem.name == PRESSURES]
    behind = [fit.applied for posterior, fit in some if posterior.problem.name != PRESSURES]
    left = beside_pressures(findings.simulator, ahead, behind, findings.expected)
    return rms_of(left, findings.expected.pairs)
