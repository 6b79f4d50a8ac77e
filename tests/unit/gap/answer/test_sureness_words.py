"""How sure an answer is, in words: what the rest is given to, and that is no part of the answer."""

from dataclasses import replace

import pytest
from support.records.told_answers import cause, told

from rig.gap.answer.facts import Evidence, Judged
from rig.gap.answer.words.sentences import answers


@pytest.mark.parametrize(
    ("confidence", "chances", "beside", "notes", "said"),
    [
        (
            0.5,
            {"none": 1.0},
            0.0,
            ("something small may act",),
            "(verdict: none); the notes say what it may be otherwise.",
        ),
        (0.6, {"none": 0.6, "unknown": 0.39}, 0.0, (), "(verdict: none); 39 % are for something unknown."),
        (0.6, {"none": 0.6, "delay": 0.39}, 0.0, (), "(verdict: none); 39 % are for a dead time (delay)."),
        (0.63, {"none": 0.9, "delay": 0.1}, 0.3, (), "(verdict: none); 27 % are for something unknown beside it."),
        (0.63, {"none": 0.9, "delay": 0.1}, 0.7, (), "(verdict: none); 10 % are for a dead time (delay)."),
        (0.95, {"none": 0.95, "delay": 0.05}, 0.0, (), "(verdict: none)."),
    ],
)
def test_an_answer_that_is_not_sure_says_where_the_rest_goes(
    confidence: float, chances: dict[str, float], beside: float, notes: tuple[str, ...], said: str
) -> None:
    right = chances["none"] * max(beside, 1.0 - beside)
    seen = Evidence({"angle": Judged(0.1, 0.1, "deg", False, chances, [], beside, {}, right)})
    made = replace(told(verdict="none", rms_deg=0.09), confidence=confidence, evidence=seen, notes=notes)
    assert answers(made)["How sure:"].endswith(said)


def test_what_is_answered_is_no_rival_of_itself() -> None:
    """Effects are likelier than nothing together, and the likeliest of them a little less by itself."""
    chances = {"none": 0.32, "sensor_gain": 0.31, "gravity_load": 0.2, "stiffness": 0.17}
    seen = Evidence({"angle": Judged(0.1, 0.1, "deg", True, chances, [], 0.0, {}, 0.31)})
    gain = cause("sensor_gain", "angle", gain=(0.01, 0.005, 0.015, "1"))
    made = replace(told(gain), confidence=0.31, evidence=seen)
    assert answers(made)["How sure:"].endswith("(verdict: explained); 32 % are for nothing at all.")


def test_the_first_line_calls_nothing_likeliest_that_has_a_likelier_rival() -> None:
    gain = cause("sensor_gain", "angle", gain=(0.01, 0.005, 0.015, "1"))

    def said(nothing: float) -> dict[str, str]:
        chances = {"none": nothing, "sensor_gain": 0.31, "stiffness": 0.69 - nothing}
        seen = Evidence({"angle": Judged(0.1, 0.1, "deg", True, chances, [], 0.0, {}, 0.31)})
        return answers(replace(told(gain), confidence=0.31, evidence=seen))

    assert said(0.39)["Answer:"].startswith("Not sure (31 %; 39 % are for nothing at all): the ")
    assert said(0.3)["Answer:"].startswith("Not sure (31 %; 39 % are for another stiffness or loop gain")
    chances = {"none": 0.3, "sensor_gain": 0.31, "stiffness": 0.2, "creep": 0.19}
    least = Evidence({"angle": Judged(0.1, 0.1, "deg", True, chances, [], 0.0, {}, 0.31)})
    first = answers(replace(told(gain), confidence=0.31, evidence=least))
    assert first["Answer:"].startswith("Likeliest, but not sure (31 %): the ")
    assert first["Where:"].endswith(", if the answer is right.")
    assert "if the answer is right" not in answers(told(gain))["Where:"]


def test_what_a_rival_is_given_is_no_more_than_what_is_left() -> None:
    """Half for something unknown that has no probability of its own: the angle's 0.93 for nothing stood there."""
    seen = Evidence({
        "pressures": Judged(0.01, 0.001, "MPa", True, {"none": 0.0, "valve_gain": 1.0}, [], 0.0, {}, 1.0),
        "angle": Judged(0.9, 0.2, "deg", False, {"none": 0.93, "delay": 0.07}, [], 0.0, {}, 0.93),
    })  # fmt: skip
    gain = cause("valve_gain", "pressures", gain=(0.02, 0.015, 0.025, "1"))
    made = told(gain, cause("unknown", "angle"), verdict="partly_explained")
    said = answers(replace(made, confidence=0.465, evidence=seen))["How sure:"]
    assert said.endswith("(verdict: partly explained); 46 % are for nothing more.")


def test_a_second_effect_of_the_angle_is_no_rival_of_itself() -> None:
    """What was judged beside the first stands under a name of its own, and so did not count as answered."""
    seen = Evidence({
        "angle": Judged(13.0, 0.2, "deg", True, {"gravity_load": 0.97, "creep": 0.03}, [], 0.0, {}, 0.97),
        "angle beside gravity_load": Judged(
            11.0, 0.2, "deg", True, {"none": 0.05, "muscle_mismatch": 0.7, "thermal_drift": 0.25}, [], 0.0, {}, 0.7
        ),
    })  # fmt: skip
    load = cause("gravity_load", "angle", k_deg=(20.0, 18.0, 22.0, "deg"))
    mismatch = cause("muscle_mismatch", "angle", mismatch=(0.6, 0.5, 0.7, "1"))
    made = replace(told(load, mismatch), confidence=0.68, evidence=seen)
    said = answers(made)["How sure:"]
    assert said.endswith("(verdict: explained); 24 % are for a rig that changes as it warms (thermal_drift)."), said
    alone = {
        **seen.factors,
        "angle beside gravity_load": replace(seen.factors["angle beside gravity_load"], right=0.05),
    }
    only = answers(replace(told(load), confidence=0.0485, evidence=Evidence(alone)))["How sure:"]
    assert only.endswith("68 % are for muscles of unequal strength (muscle_mismatch)."), only


def test_a_rival_of_one_side_is_as_probable_as_the_whole_answer_with_it() -> None:
    """40 % for dry friction whatever ails the pressures are 36 % for it and what the answer says of them."""
    seen = Evidence({
        "pressures": Judged(0.01, 0.001, "MPa", True, {"delay": 0.9, "valve_lag": 0.1}, [], 0.0, {}, 0.9),
        "angle": Judged(0.9, 0.2, "deg", True, {"backlash": 0.6, "coulomb_friction": 0.4}, [], 0.15, {}, 0.51),
    })  # fmt: skip
    late = cause("delay", "pressures", delay_s=(0.025, 0.02, 0.03, "s"))
    play = cause("backlash", "angle", width_deg=(0.8, 0.7, 0.9, "deg"))
    said = answers(replace(told(late, play), confidence=0.459, evidence=seen))["How sure:"]
    assert said.startswith("46 % that this is right as a whole"), said
    assert said.endswith("36 % are for dry friction (coulomb_friction)."), said
