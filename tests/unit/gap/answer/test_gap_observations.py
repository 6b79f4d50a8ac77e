"""What raw-data tests found is a cause where it makes up the gap or stands alone, else an observation: both sides."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.plants.gap_rigs import asked, baselines, model, names, session
from support.records.told_answers import cause
from support.records.told_answers import told as told_answer

from rig.gap.answer.observations import JudgedSignatures, judged_signatures
from rig.gap.answer.result import Interval, Observation
from rig.gap.answer.settings import LEAST_SIGNATURE_SHARE
from rig.gap.answer.words.sentences import answers, headline
from rig.gap.raw_tests.signature import Signature, Size
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect
from rig.gap.reference.expected import Expected
from rig.gap.reference.kinds import ReferenceKind
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.parameters import AddedEffect
from rig.record import Record

GAP_DEG = 2.0
STEP = {"step_deg": Size(0.2, 0.19, 0.21)}


def signature(variance_deg2: float, effect: str | None = "quantisation") -> Signature:
    return Signature("quantisation step", effect, True, 0.2, 0.0, "deg", "steps", STEP, 0.0, variance_deg2)


@cache
def beside(days: int) -> Expected:
    pairing = pair_up(session(90), [list(day) for day in baselines()[:days]], 0.2)
    kind = ReferenceKind.SESSIONS if days else ReferenceKind.SIMULATOR
    return expect(kind, False, model(), pairing)


def told(one: Signature, days: int, else_found: bool) -> JudgedSignatures:
    return judged_signatures([one], beside(days), GAP_DEG, else_found)


@pytest.mark.parametrize("else_found", [True, False])
@pytest.mark.parametrize(
    ("share", "cause"), [(0.9 * LEAST_SIGNATURE_SHARE, False), (1.2 * LEAST_SIGNATURE_SHARE, True)]
)
def test_without_an_earlier_day_a_mark_is_a_cause_where_it_makes_up_some_of_the_gap(
    share: float, cause: bool, else_found: bool
) -> None:
    found = told(signature(share / (1.0 - share) * GAP_DEG**2), 0, else_found)
    assert bool(found.causes) is cause
    assert bool(found.observations) is not cause
    said = (found.causes or found.observations)[0]
    assert said.parameters["step_deg"].value == 0.2
    assert (found.causes[0].explained_fraction if cause else found.observations[0].share) == pytest.approx(share)


@pytest.mark.parametrize("else_found", [True, False])
def test_a_small_mark_against_an_earlier_day_is_a_cause_where_nothing_else_is_found(else_found: bool) -> None:
    found = told(signature(1e-6), 3, else_found)
    assert bool(found.causes) is not else_found
    assert bool(found.observations) is else_found


def test_beside_records_without_raw_samples_a_small_mark_is_no_cause() -> None:
    """What a fingerprint keeps shows no steps: a signature stands for itself there, as without an earlier day."""
    whole = replace(beside(1), kind=ReferenceKind.FINGERPRINT)
    kept = [replace(one, pair=replace(one.pair, raw_days=())) for one in whole.contexts]
    assert judged_signatures([signature(1e-6)], replace(whole, contexts=kept), GAP_DEG, False).causes == []
    assert len(judged_signatures([signature(1e-6)], whole, GAP_DEG, False).causes) == 1


def test_where_only_a_mark_is_named_the_gap_is_explained_by_its_share() -> None:
    healthy = [replace(one, angle_deg=np.round(np.asarray(one.angle_deg))) for one in session(92)]
    found = asked(healthy)
    assert names(found) == {"quantisation"}
    assert found.gap.explained_fraction == pytest.approx(found.causes[0].explained_fraction)
    assert found.gap.explained_fraction < 1.0
    assert found.gap.rms_deg == found.causes[0].gap_before_deg
    assert found.gap.after_deg == pytest.approx(found.causes[0].gap_after_deg)
    assert found.gap.smoothed_deg < found.gap.rms_deg
    ranked = next(line for line in found.ranking if line.effect == "quantisation")
    assert (ranked.judged_on, ranked.minus_log_evidence) == (found.causes[0].judged_on, 0.0)


def test_what_no_effect_makes_is_an_observation_unless_it_is_in_the_angle() -> None:
    assert told(signature(0.0, effect=None), 3, False).observations[0].effect is None
    # something unknown, which the verdict says
    assert told(signature(1.0, effect=None), 3, False) == JudgedSignatures([], [])


def coarse(step_deg: float) -> list[Record]:
    late = session(91, AddedEffect("delay", {"delay_s": 0.04}))
    return [replace(one, angle_deg=step_deg * np.round(np.asarray(one.angle_deg) / step_deg)) for one in late]


@pytest.mark.parametrize(("step_deg", "causes"), [(0.3, {"delay"}), (4.0, {"delay", "quantisation"})])
def test_a_coarse_reading_beside_a_delay(step_deg: float, causes: set[str]) -> None:
    found = asked(coarse(step_deg))
    assert names(found) == causes
    seen = [one.effect for one in found.observations]
    assert ("quantisation" in seen) is ("quantisation" not in causes)
    assert ("Also seen:" in answers(found)) is bool(seen)
    assert found.to_json()["observations"] == [one.to_json() for one in found.observations]


@pytest.mark.parametrize(
    ("effect", "taken_out"), [("lost_samples", True), ("sensor_dropout", True), ("quantisation", False)]
)
def test_samples_that_were_taken_out_before_anything_is_compared_are_a_part_of_the_gap(
    effect: str, taken_out: bool
) -> None:
    size = {next(iter(EFFECT_STAGES[effect].neutral())): Size(0.2, 0.19, 0.21)}
    few, many = (
        told(replace(signature(v, effect), sizes=size, taken_out_deg2=v if taken_out else 0.0), 3, False).causes[0]
        for v in (1e-6, 4.0)
    )
    assert (many.gap_before_deg**2 - few.gap_before_deg**2 > 3.9) is taken_out


def test_where_nothing_else_is_found_what_single_samples_show_is_a_part_of_the_answer() -> None:
    """A fifth of the samples lost stood last, behind "no effect that it lacks is needed"."""
    lost = Observation("lost", "lost_samples", "", {"probability": Interval(0.19, 0.18, 0.2, "1")}, 0.99, 0.01)
    nothing = replace(told_answer(verdict="none"), observations=[lost])
    assert headline(nothing)[-1] == (
        "Single samples show more: about 19 % of the samples are lost and repeat the one before."
    )
    assert "Also seen:" not in answers(nothing)
    named = replace(told_answer(cause("delay", delay_s=(0.01, 0.009, 0.011, "s"))), observations=[lost])
    assert "Single samples" not in " ".join(headline(named))
    assert answers(named)["Also seen:"].endswith("lost and repeat the one before (no cause of the gap).")
