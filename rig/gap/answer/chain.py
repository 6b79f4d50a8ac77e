"""The gap along the chain: command, valves, muscles, joint, sensor, with the share of each stage."""

from collections.abc import Sequence

from rig.gap.answer.facts import Link
from rig.gap.answer.result import Cause

STAGES = ("timing", "valve", "muscle", "joint", "sensor")
"""Of the chain from the command to the measured angle, in their order."""
NAMES = {"timing": "command", "valve": "valves", "muscle": "muscles", "joint": "joint", "sensor": "sensor"}
"""What a stage is called in pictures and tables."""


def chain(causes: Sequence[Cause], left_deg: float, usual_deg: float) -> list[Link]:
    """Every stage in the order of the chain with what was found there and its share of the gap's mean square.

    A named effect has what it closes; what is left above the usual goes to where something unknown was seen. The
    shares add up to 1, or to 0 where nothing is found.
    """
    share = dict.fromkeys(STAGES, 0.0)
    for cause in causes:
        share[cause.stage] += max(cause.gap_before_deg**2 - cause.gap_after_deg**2, 0.0)
    unknown = [cause.stage for cause in causes if not cause.is_named]
    for stage in unknown:
        share[stage] += max(left_deg**2 - usual_deg**2, 0.0) / len(unknown)
    total = sum(share.values())
    if causes and total <= 0.0:
        share[causes[0].stage] = total = 1.0
    return [
        Link(
            stage,
            tuple(dict.fromkeys(cause.effect for cause in causes if cause.stage == stage)),
            share[stage] / total if total > 0.0 else 0.0,
        )
        for stage in STAGES
    ]
