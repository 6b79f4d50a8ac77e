"""Observations: what is seen and explains little or nothing of the gap. Raw-data tests find some; others are effects no
larger than a simulator usually lacks them of a healthy rig.

A converter's step, noise, a line or lost samples are facts about the samples. They explain why simulator and rig differ
only as far as they make up that difference: where they do, or where nothing else is found, they are causes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.gap.answer.facts import SIGNATURE
from rig.gap.answer.how_far.size_intervals import intervals
from rig.gap.answer.result import Cause, Interval, Observation
from rig.gap.answer.settings import LEAST_SIGNATURE_SHARE
from rig.gap.evidence.posterior import Posterior
from rig.gap.hypotheses.fit import Fit
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.priors import Reach
from rig.gap.raw_tests.signature import Signature
from rig.gap.reference.expected import Expected
from rig.gap.response.causes import Applied
from rig.model.effect_stages import EFFECT_STAGES

USUAL = "usual of a simulator"
"""The name of the test by which such an effect is seen."""
STUCK = "stuck monitor"
"""The name of the test by which a monitor that stood still for a while is seen."""
MONITORS_ALONE = "monitors alone"
"""The name of the test by which what the pressures show is seen in their monitors alone."""


@dataclass(frozen=True)
class JudgedSignatures:
    """The signatures that were found: those that are causes, and those that are only seen."""

    causes: list[Cause]
    observations: list[Observation]


def judged_signatures(
    signatures: Sequence[Signature], expected: Expected, gap_deg: float, else_found: bool
) -> JudgedSignatures:
    """Which of the signatures that were found are causes, and which only observations. `gap_deg`: rms of the smoothed
    records' gap; `else_found`: whether anything was found in that.

    A signature is a cause where it makes up some of the gap; and, beside the raw samples of earlier days, where nothing
    else is found: then it is what has changed.
    """
    causes, observations = [], []
    compared = any(pair.raw_days for pair in expected.pairs)
    for signature in (one for one in signatures if one.found):
        raw_gap_deg = _raw_gap_deg(signature, expected, gap_deg)
        share = float(np.clip(signature.variance_deg2 / max(raw_gap_deg**2, 1e-12), 0.0, 1.0))
        alone = compared and not else_found
        if signature.effect is not None and (alone or share >= LEAST_SIGNATURE_SHARE):
            causes.append(_cause(signature, signature.effect, raw_gap_deg, share))
        elif signature.effect is not None or signature.variance_deg2 == 0.0:
            observations.append(_observation(signature, share))
    return JudgedSignatures(sorted(causes, key=lambda cause: cause.gap_after_deg), observations)


def _raw_gap_deg(signature: Signature, expected: Expected, gap_deg: float) -> float:
    """Rms of the unsmoothed angle's gap, fallen samples included; without an earlier day the smoothed one's with the
    signature."""
    raw = [
        np.interp(pair.raw.t_s, other.t_s[known], other.angle_deg[known]) - pair.raw.angle_deg
        for pair in expected.pairs
        for other in pair.raw_days
        if pair.raw.angle_deg is not None and other.angle_deg is not None
        for known in (np.isfinite(other.angle_deg),)
    ]
    if not raw:
        return float(np.hypot(gap_deg, np.sqrt(signature.variance_deg2)))
    return float(np.sqrt(np.nanmean(np.concatenate(raw) ** 2) + signature.taken_out_deg2))


def _cause(signature: Signature, effect: str, raw_gap_deg: float, share: float) -> Cause:
    return Cause(
        effect,
        LIBRARY[effect].stage,
        SIGNATURE,
        Applied(effect, signature.numbers),
        _numbers(signature, effect),
        raw_gap_deg,
        raw_gap_deg * float(np.sqrt(1.0 - share)),
        max(share, 1e-6),
        (),
        signature.confidence,
    )


def _numbers(signature: Signature, effect: str) -> dict[str, Interval]:
    units = {number.name: number.unit for number in EFFECT_STAGES[effect].numbers}
    return {name: Interval(size.value, size.low, size.high, units[name]) for name, size in signature.sizes.items()}


def _observation(signature: Signature, share: float) -> Observation:
    numbers = {} if signature.effect is None else _numbers(signature, signature.effect)
    return Observation(signature.test, signature.effect, signature.text, numbers, signature.confidence, share)


def stuck_monitors(sentences: Sequence[str]) -> list[Observation]:
    """Monitors that stood still for a while, each in a sentence; what they showed then was left out."""
    return [Observation(STUCK, None, text, {}, 1.0, 0.0) for text in sentences]


def of_monitors_alone(posterior: Posterior) -> Observation:
    """That the joint does not follow what the pressures show."""
    effects = {name: chance for name, chance in posterior.probability.items() if name in posterior.fits}
    nearest = f", most like {max(effects, key=lambda name: effects[name])}," if effects else ""
    text = (
        f"the joint moves as if nothing had happened to the pressures: what their monitors show{nearest} is more "
        "likely in the monitors, their lines or their filters than in the pressures"
    )
    return Observation(MONITORS_ALONE, None, text, {}, posterior.monitors_alone, 0.0)


def usual_of_a_simulator(fit: Fit, probability: float, share: float, reach: Reach) -> Observation:
    """An effect that is as large as a simulator usually lacks it of a healthy rig, and closes a share of what it was
    found on."""
    name = fit.effect.name
    text = f"{name} no larger than a simulator usually lacks it of a healthy rig"
    return Observation(USUAL, name, text, intervals(fit, reach), probability, share)
