"""Answers of a diagnosis made by hand, for what is said of them."""

from dataclasses import replace
from typing import Any

from rig.gap.answer.facts import Evidence, Gap, Judged, RecordGap, Verdict, Where
from rig.gap.answer.result import Cause, Diagnosis, Interval
from rig.gap.reference.kinds import ReferenceKind

GAP = Gap(0.751, 0.1, 7.5, 0.98, 0.0804, 0.0711, 0.0893, "simulator", 0.751)


def cause(
    effect: str, side: str = "pressures", also: tuple[str, ...] = (), **numbers: tuple[float, float, float, str]
) -> Cause:
    said = {name: Interval(*number) for name, number in numbers.items()}
    return Cause(effect, "valve", side, None, said, 0.751, 0.0804, 0.98, also, 0.97)


def told(*causes: Cause, verdict: str = "explained", reference: str = "simulator", **gap: Any) -> Diagnosis:
    where = Where(causes[0].stage if causes else None, {"valve": 0.9, "downstream": 0.1})
    made = replace(GAP, **gap)
    seen = judged("pressures", True)
    return Diagnosis(Verdict(verdict), 0.9, made, where, causes, [], evidence=seen, reference=ReferenceKind(reference))


def judged(factor: str, found: bool) -> Evidence:
    """What one factor showed, or did not."""
    records = [RecordGap(name, 0.75, 0.08) for name in ("a", "b")]
    return Evidence({factor: Judged(0.02, 0.001, "MPa", found, {}, [], 0.0, {})}, records=records)
