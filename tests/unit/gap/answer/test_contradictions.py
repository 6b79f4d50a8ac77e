"""An answer that contradicts itself is found out: each rule on an answer that breaks it alone."""

from dataclasses import replace

import pytest

from rig.gap.answer.consistency import contradictions
from rig.gap.answer.facts import Evidence, Gap, Judged, RecordGap, Verdict, Where
from rig.gap.answer.result import Cause, Diagnosis, Interval
from rig.gap.reference.kinds import ReferenceKind

GAP = Gap(0.751, 0.1, 7.5, 0.98, 0.0804, 0.0711, 0.0893, "simulator", 0.751)
LAG = Cause(
    "valve_lag", "valve", "pressures", None, {"tau_s": Interval(0.0102, 0.0097, 0.0107, "s")}, 0.751, 0.0804, 0.98, (),
    0.97,
)  # fmt: skip
PLAY = replace(LAG, effect="backlash", stage="joint", judged_on="angle", parameters={})
UNKNOWN = Cause("unknown", "joint", "angle", None, {}, 0.751, 0.751, 0.0, (), 0.9)


def judged(found: bool, floors: float = 2.0) -> Evidence:
    """What the angle showed, or did not, on two records, at a gap of so many floors."""
    records = [RecordGap(name, 0.75, 0.08) for name in ("a", "b")]
    return Evidence({"angle": Judged(0.001 * floors, 0.001, "deg", found, {}, [], 0.0, {})}, records=records)


SOUND = Diagnosis(
    Verdict.EXPLAINED, 0.9, GAP, Where("valve", {"valve": 0.9}), (LAG,), [], evidence=judged(True),
    reference=ReferenceKind.SIMULATOR,
)  # fmt: skip
NONE = replace(SOUND, verdict=Verdict.NONE, causes=(), gap=replace(GAP, rms_deg=0.2), where=Where(None))


FAR_OFF = replace(
    SOUND, verdict=Verdict.UNKNOWN, causes=(UNKNOWN,), gap=replace(GAP, rms_deg=0.09), evidence=judged(False, 4.0),
    where=Where(UNKNOWN.stage),
)  # fmt: skip
"""Nothing is likeliest, and the side is far above its own floor (0661)."""


@pytest.mark.parametrize("made", [SOUND, NONE, FAR_OFF])
def test_a_sound_answer_does_not_contradict_itself(made: Diagnosis) -> None:
    assert contradictions(made.to_json()) == []


def of_gap(**changed: float) -> Diagnosis:
    return replace(SOUND, gap=replace(GAP, **changed))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (replace(SOUND, verdict=Verdict.NONE), "the causes"),
        (replace(SOUND, verdict=Verdict.UNKNOWN, causes=()), "the causes"),
        (replace(SOUND, causes=(replace(LAG, explained_fraction=0.0),)), "closes nothing"),
        (of_gap(after_deg=0.8, after_high_deg=0.9), "gets worse"),
        (
            replace(of_gap(after_deg=0.751, after_high_deg=0.8), causes=(PLAY,), where=Where("joint")),
            "gets no better",
        ),
        (replace(of_gap(rms_deg=0.09), evidence=judged(False)), "below the usual"),
        (
            replace(SOUND, verdict=Verdict.PARTLY_EXPLAINED, causes=(UNKNOWN, LAG), where=Where("joint")),
            "before a named effect",
        ),
        (replace(SOUND, where=Where("joint")), "it lies in joint, and the first cause in valve"),
        (replace(SOUND, causes=(replace(LAG, confidence=0.7),)), "0.90 as a whole, 0.70 for valve_lag"),
        (replace(SOUND, causes=(replace(LAG, confidence=1.2),)), "a confidence of 1.2"),
        (
            replace(SOUND, causes=(replace(LAG, gap_after_deg=0.7, explained_fraction=0.1), PLAY)),
            "explains less",
        ),
        (replace(SOUND, causes=(LAG, LAG)), "named twice"),
        (of_gap(after_low_deg=0.2), "outside of"),
        (
            replace(SOUND, causes=(replace(LAG, parameters={"tau_s": Interval(0.1, 0.2, 0.3, "s")}),)),
            "outside its own interval",
        ),
        (replace(SOUND, causes=(replace(LAG, ambiguous_with=("valve_lag",)),)), "also be itself"),
        (
            replace(SOUND, causes=(replace(LAG, doubted_by=("run: the monitor of p1 stays at its upper end",)),)),
            "takes it back",
        ),
    ],
)
def test_each_contradiction_is_found(made: Diagnosis, words: str) -> None:
    (said,) = contradictions(made.to_json())
    assert words in said
