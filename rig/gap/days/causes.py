"""The named causes of a diagnosis with their numbers, intervals, doubts and confidence, from the judged sides.

The verdict and the other answers are in `rig.gap.days.diagnosis`.
"""

from collections.abc import Sequence

import numpy as np

from rig.gap.answer.observations import Marks, told_apart
from rig.gap.answer.result import Cause, Interval
from rig.gap.days.attribute import LOOSENESS, Candidate
from rig.gap.days.engine import overall_gap
from rig.gap.days.findings import Findings
from rig.gap.days.prepared import Judged, Prepared
from rig.gap.days.trigger import trigger
from rig.gap.days.verdict import explained
from rig.gap.hypotheses.library import alike
from rig.gap.hypotheses.propagate import Applied, full_numbers
from rig.model.effect_stages import EFFECT_STAGES

CLIPPED_TRUST = 0.5
PAIR_CHANCE = 0.7
"""Confidence in each of two causes on one side: from the development data."""


def name_causes(findings: Findings, before: float, floor: float) -> list[Cause]:
    """Named causes, strongest first, a side's second one after all first ones; a side that nothing explains gives
    `unknown`, last."""
    prepared = findings.prepared
    found: list[Cause] = []
    for judged in findings.sides:
        if not judged.trigger.found:
            continue
        if not judged.accepted:
            found.append(_unknown(judged, before))
            continue
        for candidate in judged.accepted:
            alone = _rms_with([candidate.applied], findings)
            names = (
                [name for name in judged.names if name != candidate.effect.name]
                if candidate.effect.name == judged.names[0] or len(judged.accepted) == 1
                else alike_left(candidate, judged, prepared)
            )
            chance = _chances(judged).get(candidate.effect.name, 0.5)
            found.append(
                Cause(
                    candidate.effect.name,
                    EFFECT_STAGES[candidate.applied.stage].lies_in,
                    judged.side.name,
                    Applied(candidate.applied.stage, full_numbers(candidate.applied, prepared.nominal)),
                    _intervals(candidate),
                    before,
                    alone,
                    judged.fraction if len(judged.accepted) == 1 else explained(before, alone, floor),
                    tuple(names),
                    trust(prepared) * fit(judged) * (chance if len(judged.accepted) == 1 else PAIR_CHANCE),
                )
            )
        if judged.open:
            found.append(_unknown(judged, before))
    found += marks_of(findings, before).causes
    found += [Cause("unknown", "sensor", "signature", None, {}, before, before, 0.0, (), 0.5) for _ in findings.strange]
    seconds = {name for judged in findings.sides for name in _second(judged)}

    def place(cause: Cause) -> tuple[int, float]:
        rank = 2 if cause.effect == "unknown" else int(cause.effect in seconds)
        return rank, cause.gap_after_deg - cause.gap_before_deg

    return sorted(found, key=place)


def marks_of(findings: Findings, before: float) -> Marks:
    """What the raw samples show, as causes and as observations beside them."""
    shows = any(judged.trigger.found for judged in findings.sides)
    return told_apart(findings.signatures, findings.prepared, before, shows)


def _chances(judged: Judged) -> dict[str, float]:
    """How likely each effect is to be all there is on a side."""
    return dict(zip((line.effect.name for line in judged.ranking), judged.chances, strict=True))


def _second(judged: Judged) -> list[str]:
    """Of several causes of a side those that alone are less likely than the likeliest."""
    alone = _chances(judged)
    names = [candidate.effect.name for candidate in judged.accepted]
    return sorted(names, key=lambda name: -alone.get(name, 0.0))[1:]


def fit(judged: Judged) -> float:
    """How well the accepted causes explain their side at all: 1 where nothing stands out any more, else the square of
    what they explain.

    The best name of a poor lot is no good name.
    """
    still = trigger(judged.side, judged.accepted[-1].residual, LOOSENESS * judged.side.rms(judged.side.gap)).found
    return float(np.clip(judged.fraction, 0.0, 1.0)) ** 2 if still else 1.0


def alike_left(candidate: Candidate, judged: Judged, prepared: Prepared) -> list[str]:
    """For a cause that was not the single best: those of its class in the ranking that fit alone about as well."""
    pressures = prepared.pairing.pressures
    own = {line.effect.name: line.score for line in judged.ranking}
    mine = own.get(candidate.effect.name, candidate.score)
    return [name for name in alike(candidate.effect.name, pressures) if name in own and own[name] < 1.1 * mine]


def _rms_with(causes: Sequence[Applied], findings: Findings) -> float:
    left = np.concatenate(overall_gap(findings.prepared, causes))
    return float(np.sqrt(left @ left / max(findings.angle.side.rows, 1.0)))


def _unknown(judged: Judged, before: float) -> Cause:
    stage = (
        "valve"
        if judged.side.name == "valve"
        else EFFECT_STAGES[judged.ranking[0].applied.stage].lies_in
        if judged.ranking
        else "joint"
    )
    near = tuple(candidate.effect.name for candidate in judged.ranking[:2])
    return Cause("unknown", stage, judged.side.name, None, {}, before, before, max(judged.fraction, 0.0), near, 0.5)


def _intervals(candidate: Candidate) -> dict[str, Interval]:
    """Fitted numbers with 95 % intervals, fixed shapes with none."""
    known = {number.name: number for number in EFFECT_STAGES[candidate.applied.stage].numbers}
    spread = dict(zip(candidate.law.free, candidate.spread, strict=True))
    said = {}
    for name, value in candidate.applied.numbers.items():
        half = 1.96 * float(spread.get(name, spread.get(candidate.law.tied.get(name, ""), 0.0)))
        said[name] = Interval(float(value), float(value) - half, float(value) + half, known[name].unit)
    return said


def trust(prepared: Prepared) -> float:
    """How far the records can be trusted: less without repeated sessions, much less without a baseline, half where a
    sensor seems clipped."""
    known = 1.0 if len(prepared.pairs[0].sessions) >= 2 else 0.8 if prepared.has_baseline else 0.5
    return known * (CLIPPED_TRUST if prepared.pairing.clipped else 1.0)
