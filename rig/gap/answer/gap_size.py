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
from rig.gap.answer.smoothed_gap import SmoothedGap
from rig.gap.priors import Fitted
from rig.gap.settings import LARGE_GAP


def gap_of(
    findings: Findings,
    causes: Sequence[Cause],
    kept: Sequence[Kept],
    smoothed: SmoothedGap,
    interval_deg: tuple[float, float] | None,
) -> Gap:
    """The gap: that of the smoothed angle, or that of the raw samples where nothing else shows it. `interval_deg`: of
    the rms of further records; None: what remains holds for them."""
    raw = all(cause.judged_on == SIGNATURE for cause in causes)
    shown = _gap_of_samples(causes, smoothed.floor_deg) if causes and raw else smoothed
    low, high = interval_deg or (shown.after_deg, shown.after_deg)
    named = any(cause.is_named for cause in causes)
    return Gap(
        rms_deg=shown.before_deg,
        floor_deg=shown.floor_deg,
        ratio=shown.before_deg / shown.floor_deg,
        explained_fraction=_explained(kept, shown) if named else 0.0,
        after_deg=shown.after_deg,
        after_low_deg=low,
        after_high_deg=high,
        floor_source=floor_source(findings.expected),
        smoothed_deg=smoothed.before_deg,
    )


def predicted(kept: Sequence[Kept], gap: SmoothedGap, far: HowFar, settings: Fitted) -> tuple[float, float]:
    """The interval of the rms (deg) that further records will show with the kept effects in the simulator. It always
    holds what is left on the records at hand."""
    rho = max(one.fit.effect.roughness(settings.prior, one.fit.law) for one in kept)
    low, high = prediction_interval(
        Shrunk(gap.before_deg, gap.floor_deg, far.per_record_deg2, rho), settings.prediction
    )
    return min(low, far.after_deg), max(high, far.after_deg)


def _gap_of_samples(raw: Sequence[Cause], floor_deg: float) -> SmoothedGap:
    """The raw records' gap in the place of the smoothed one, with and without what their samples show."""
    before_deg = max(cause.gap_before_deg for cause in raw)
    closed_deg2 = sum(cause.gap_before_deg**2 - cause.gap_after_deg**2 for cause in raw)
    return SmoothedGap(before_deg, float(np.sqrt(max(before_deg**2 - closed_deg2, 0.0))), floor_deg)


def _explained(kept: Sequence[Kept], gap: SmoothedGap) -> float:
    """Share of the gap that the causes explain; where they close nothing of it, of what they were found on."""
    if not kept:
        return 1.0 - (gap.after_deg / gap.before_deg) ** 2
    if gap.shrinks:
        return gap.explained_fraction
    return (
        0.0 if gap.after_deg > LARGE_GAP * gap.floor_deg else max(share_closed(one.posterior, one.fit) for one in kept)
    )
