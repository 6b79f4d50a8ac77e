"""What an answer may not say: each rule on both sides of its threshold."""

from typing import Any

import pytest

from rig.blind_check.contradictions import contradictions


def answer(*shares: float, verdict: str = "explained", **gap: float) -> dict[str, Any]:
    causes = [
        {"effect": f"effect_{k}", "explained_fraction": share, "judged_on": "angle", "confidence": 0.9}
        for k, share in enumerate(shares)
    ]
    return {
        "verdict": verdict,
        "gap": {"rms_deg": 1.0, "floor_deg": 0.2, "ratio": 5.0, "after_deg": 0.3} | gap,
        "causes": causes,
        "notes": [],
    }


def test_sound_answers_do_not_contradict_themselves() -> None:
    for sound in (answer(0.9), answer(0.9, 0.5), answer(verdict="none", ratio=0.5), answer(verdict="unknown")):
        assert contradictions(sound) == []


def test_a_named_effect_explains_something() -> None:
    assert contradictions(answer(-0.09)) == ["effect_0 is named and explains nothing"]
    assert contradictions(answer(0.01)) == []


def test_explained_means_that_the_simulator_gets_better() -> None:
    assert contradictions(answer(0.9, after_deg=1.0)) == ["explained, and the simulator gets no better"]
    assert contradictions(answer(0.9, after_deg=0.99)) == []
    assert contradictions(answer(0.9, after_deg=1.0, verdict="partly_explained")) == []


def test_below_the_floor_something_else_must_stand_out() -> None:
    below = answer(0.9, ratio=0.8)
    assert len(contradictions(below)) == 1
    below["causes"][0]["judged_on"] = "pressures"
    assert contradictions(below) == []
    assert contradictions(answer(0.9, ratio=1.0)) == []


def test_the_first_cause_explains_most() -> None:
    assert contradictions(answer(0.5, 0.9)) == ["effect_0 stands first and explains less than another"]
    assert contradictions(answer(0.89, 0.9)) == []


@pytest.mark.parametrize(("confidence", "count"), [(0.9, 1), (0.3, 0)])
def test_a_note_does_not_take_a_stated_confidence_back(confidence: float, count: int) -> None:
    taken = answer(0.9)
    taken["causes"][0]["confidence"] = confidence
    taken["notes"] = ["Something in the answer is wrong; do not use the augmented model."]
    assert len(contradictions(taken)) == count
