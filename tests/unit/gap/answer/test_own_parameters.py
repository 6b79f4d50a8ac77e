"""What a simulator's own parameters explain is said in the first line, and not that nothing was found."""

import pytest

from rig.gap.answer.facts import Evidence, Gap, Judged, ParameterMove, RecordGap, Retuning, Verdict, Where
from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.sentences import headline
from rig.gap.reference.build import Kind

ZERO = ParameterMove("sensor_offset_deg", 0.2, 6.1, 5.8, 6.4, "deg")


def first_line(tuning: Retuning | None, rms_deg: float, reference: Kind = Kind.SIMULATOR) -> str:
    gap = Gap(rms_deg, 3.0, rms_deg / 3.0, 0.0, rms_deg, rms_deg, rms_deg, "sister", rms_deg)
    factors = {"angle": Judged(rms_deg, 3.0, "deg", False, {}, [], 0.0, {})}
    evidence = Evidence(factors, records=[RecordGap(name, rms_deg, 3.0) for name in ("a", "b")])
    where = Where(None, {"valve": 0.0, "downstream": 1.0})
    made = Diagnosis(
        Verdict.NONE, 0.72, gap, where, (), [], retuning=tuning, evidence=evidence, reference=reference,
    )  # fmt: skip
    (said,) = headline(made)
    return said


@pytest.mark.parametrize("rms_deg", [6.2, 9.7], ids=["twice as far off as usual", "and more than three times"])
def test_what_moved_stands_in_the_first_line(rms_deg: float) -> None:
    said = first_line(Retuning(rms_deg, 1.4, (ZERO,)), rms_deg)
    assert said.startswith(
        f"The simulator is {rms_deg} deg off (rms), and its own parameters explain that: fitted to these records "
        "again, it is 1.4 deg off, and no effect that it lacks is needed. What moves most plainly: sensor_offset_deg "
        "goes from 0.2 deg to 6.1 deg."
    )
    assert "these records do not tell; 3.0 deg is what a simulator usually misses of another rig" in said


@pytest.mark.parametrize(
    ("tuning", "rms_deg"),
    [
        (None, 6.2),
        (Retuning(6.2, 5.5, (ZERO,)), 6.2),
        (Retuning(6.2, 1.4, ()), 6.2),
        (Retuning(2.5, 1.4, (ZERO,)), 2.5),
    ],
    ids=["not re-tuned", "closes a fifth", "nothing moves plainly", "below what is usual"],
)
def test_else_the_line_is_about_what_is_usual(tuning: Retuning | None, rms_deg: float) -> None:
    assert first_line(tuning, rms_deg).startswith("The simulator says what these records show")
