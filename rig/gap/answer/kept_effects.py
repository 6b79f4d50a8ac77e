"""Which of the likeliest effects an answer keeps: those that close some of the gap, and that make the simulator follow
the records better, or at least not worse."""

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


def kept_effects(findings: Findings, gap_deg: float) -> list[Kept]:
    """The named effects that close some of the gap (rms of the smoothed angle). One after the other those are dropped
    without which the simulator, with the others in it, follows these records better."""
    named = [(posterior, fit) for posterior, fit in findings.named if share_closed(posterior, fit) > LEAST_CLOSED]
    left = cache(lambda *some: _left_deg(findings, [named[k][1] for k in some], gap_deg))
    beside = cache(lambda *some: _left_beside_pressures_deg(findings, [named[k] for k in some]))
    kept = tuple(range(len(named)))
    while (spoiler := _spoiler(kept, _open_to_doubt(findings, kept, named, beside), left)) is not None:
        kept = _but(kept, spoiler)
    return [Kept(*named[k], left(k)) for k in kept]


def dropped_effects(findings: Findings, kept: Sequence[Kept]) -> list[tuple[Posterior, Fit]]:
    """The likeliest effects of their factors that close some of its gap, and that the answer does not keep because the
    simulator is no better with them."""
    return [one for one in effects_not_kept(findings, kept) if share_closed(*one) > LEAST_CLOSED]


def effects_not_kept(findings: Findings, kept: Sequence[Kept]) -> list[tuple[Posterior, Fit]]:
    """The likeliest effects of their factors that the answer does not keep."""
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
    """Which of the kept effects may be dropped: those found on the angle. Where an effect ahead of the monitors is
    named as well, those that close the larger part of the gap under the measured pressures stay in any case: that the
    law of the valves is rough does not speak against them."""
    behind = [k for k in kept if named[k][0].problem.name != PRESSURES]
    if not findings.expected.driven or len(behind) == len(kept):
        return behind
    return [k for k in behind if beside(*kept) ** 2 > (1.0 - BEHIND_CLOSES) * beside(*_but(kept, k)) ** 2]


def _spoiler(kept: tuple[int, ...], doubtful: Sequence[int], left: Callable[..., float]) -> int | None:
    """The doubtful effect without which the simulator is best; None where it is better with each of them. They are
    tried beside the others: friction hides what a larger gain of a valve does, and the other way round."""
    together = left(*kept)
    without = {k: left(*_but(kept, k)) for k in doubtful}
    spoilt = {k: rms_deg for k, rms_deg in without.items() if together > SPOILT * rms_deg}
    return min(spoilt, key=lambda k: spoilt[k]) if spoilt else None


def _but(kept: tuple[int, ...], one: int) -> tuple[int, ...]:
    return tuple(k for k in kept if k != one)


def _left_deg(findings: Findings, fits: Sequence[Fit], gap_deg: float) -> float:
    """Rms of the simulator's error, deg, with these effects in it."""
    if not fits:
        return gap_deg
    return rms_of(
        remaining_gap(findings.simulator, [fit.applied for fit in fits], findings.expected), findings.expected.pairs
    )


def _left_beside_pressures_deg(findings: Findings, some: Sequence[tuple[Posterior, Fit]]) -> float:
    """Rms of the simulator's error, deg, under the pressures that were measured."""
    ahead = [fit.applied for posterior, fit in some if posterior.problem.name == PRESSURES]
    behind = [fit.applied for posterior, fit in some if posterior.problem.name != PRESSURES]
    left = beside_pressures(findings.simulator, ahead, behind, findings.expected)
    return rms_of(left, findings.expected.pairs)
