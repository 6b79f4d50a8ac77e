"""How large the gap is, what is left of it with the causes, and the interval in which further records will lie."""

from collections.abc import Sequence

import numpy as np

from rig.gap.answer.facts import SIGNATURE, Gap
from rig.gap.answer.findings import Findings, Kept
from rig.gap.answer.floor import floor_source
from rig.gap.answer.how_far.held_out import HowFar
from rig.gap.answer.how_far.prediction_interval import Shrunk, prediction_interval
from rig.gap.answer.kept_effects import share_closed
from rig.gap.answer.result import Cause
from rig.gap.priors import Fitted
from rig.gap.settings import ABOVE_FLOOR, LARGE_GAP


def gap_of(
    findings: Findings,
    causes: Sequence[Cause],
    kept: Sequence[Kept],
    smoothed: float,
    remaining: float,
    floor: float,
    interval: tuple[float, float] | None,
) -> Gap:
    """The gap: that of the smoothed angle (`smoothed`, and `remaining` with the causes), or that of the raw samples
    where nothing else shows it. All in deg, rms. `interval`: for further records; None: what remains holds for them."""
    raw = all(cause.judged_on == SIGNATURE for cause in causes)
    before, after = _gap_of_samples(causes) if causes and raw else (smoothed, remaining)
    low, high = interval or (after, after)
    named = any(cause.is_named for cause in causes)
    return Gap(
        rms_deg=before,
        floor_deg=floor,
        ratio=before / floor,
        explained_fraction=_explained(kept, before, after, floor) if named else 0.0,
        after_deg=after,
        after_low_deg=low,
        after_high_deg=high,
        floor_source=floor_source(findings.expected),
        smoothed_deg=smoothed,
    )


def predicted(kept: Sequence[Kept], before: float, floor: float, far: HowFar, settings: Fitted) -> tuple[float, float]:
    """The interval of the rms (deg) that further records will show with the kept effects in the simulator. It always
    holds what is left on the records at hand."""
    rho = max(one.fit.effect.roughness(settings.prior, one.fit.law) for one in kept)
    low, high = prediction_interval(Shrunk(before, floor, far.per_record_deg2, rho), settings.prediction)
    return min(low, far.after_deg), max(high, far.after_deg)


def _gap_of_samples(raw: Sequence[Cause]) -> tuple[float, float]:
    """Rms of the raw records' gap, deg, with and without what their samples show."""
    before = max(cause.gap_before_deg for cause in raw)
    closed = sum(cause.gap_before_deg**2 - cause.gap_after_deg**2 for cause in raw)
    return before, float(np.sqrt(max(before**2 - closed, 0.0)))


def _explained(kept: Sequence[Kept], before: float, after: float, floor: float) -> float:
    """Share of the gap that the causes explain: (G - E) / (G - F) in mean squares of the angle (gap before, gap after,
    floor), where the gap stands above the floor; else the share of what the causes were found on."""
    if not kept:
        return 1.0 - (after / before) ** 2
    if after < before and before > ABOVE_FLOOR * floor:
        return min((before**2 - after**2) / (before**2 - floor**2), 1.0)
    if after < before:
        return 1.0 - (after / before) ** 2
    return 0.0 if after > LARGE_GAP * floor else max(share_closed(one.posterior, one.fit) for one in kept)
