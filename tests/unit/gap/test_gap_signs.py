"""Friction, inertia and stiffness have signs: less than before is a finding, with its direction in the sentence."""

from functools import lru_cache

import numpy as np
import pytest
from support.plants.gap_rigs import session

from rig.gap import diagnose
from rig.gap.answer.result import Interval
from rig.gap.answer.words.effects import EFFECT_WORDS
from rig.gap.answer.words.sentences import headline
from rig.model.compiled.stages import compiled
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.equations.joint_balance import LOOP_RADII_DEG, kept_slip
from rig.model.parameters import AddedEffect
from rig.record import Column

DT_S = 0.005
NOMINAL = {"p0_mpa": 0.2, "viscous_time_s": 0.05, "inertia_time_s": 0.03, "loop_1": 0.5, "loop_2": 0.3}


def joint(stage: str, **numbers: float) -> Column:
    """The angle of a joint with friction and inertia, with this effect; `moved` without it."""
    known = EFFECT_STAGES[stage]
    angle, pressure = moved().copy(), np.full(len(moved()), 0.2)
    params = np.array([(known.neutral() | NOMINAL | numbers)[name] for name in known.parameters])
    compiled(known.stage)(pressure, pressure, angle, np.zeros(known.state_size), params, DT_S)
    return angle


@lru_cache
def moved() -> Column:
    """A slow and a fast motion."""
    t = np.arange(0.0, 6.0, DT_S)
    both: Column = 12.0 * np.sin(2 * np.pi * 0.5 * t) + 3.0 * np.sin(2 * np.pi * 2.0 * t)
    return both


def lag(angle: Column) -> float:
    """How far it lags behind the nominal motion, over its speed."""
    speed = np.gradient(moved(), DT_S)
    return -float((angle - moved()) @ speed / (speed @ speed))


@pytest.mark.parametrize(
    ("stage", "size", "value"),
    [("coulomb_friction", "width_deg", 0.3), ("viscous_friction", "tau_s", 0.02), ("stiffness", "stiffness", -0.4)],
)
def test_more_lags_and_less_leads(stage: str, size: str, value: float) -> None:
    more, less = lag(joint(stage, **{size: value})), lag(joint(stage, **{size: -value}))
    assert more > 0.002
    assert less < -0.002


def test_less_inertia_rings_less() -> None:
    fast = [float(np.std(joint("inertia", time_s=time_s))) for time_s in (-0.02, 0.0, 0.02)]
    assert fast == sorted(fast)


@pytest.mark.parametrize(
    ("stage", "size"), [("coulomb_friction", "width_deg"), ("viscous_friction", "tau_s"), ("inertia", "time_s")]
)
def test_no_more_is_taken_off_than_is_there(stage: str, size: str) -> None:
    bounds = next(number for number in EFFECT_STAGES[stage].numbers if number.name == size)
    assert bounds.low < 0.0
    angle = joint(stage, **{size: bounds.low})
    assert np.isfinite(angle).all()
    assert np.max(np.abs(angle)) < 2.0 * np.max(np.abs(moved()))


def test_dry_friction_is_taken_off_the_slipping_elements() -> None:
    weights = (0.5, 0.3, 0.0, 0.0, 0.0)
    whole = sum(weight * radius for weight, radius in zip(weights, LOOP_RADII_DEG, strict=True))
    params = [0.0] * 8 + list(weights)
    assert kept_slip(params, 1.0) == 1.0
    assert kept_slip([-0.5 * whole, *params[1:]], 1.0) == pytest.approx(0.5)
    assert kept_slip([-2.0 * whole, *params[1:]], 1.0) == 0.0
    assert kept_slip([0.7, *params[1:]], 1.0) == 1.0


def test_an_infinitely_stiff_joint_stands_at_its_equilibrium() -> None:
    far, near = (float(np.std(joint("stiffness", stiffness=k) - joint("stiffness", stiffness=4.0))) for k in (0.0, 3.0))
    assert near < 0.2 * far


STIFF = (AddedEffect("coulomb_friction", {"width_deg": 1.0}), AddedEffect("gravity_load", {"load_deg": 3.0}))
SOFT = (AddedEffect("coulomb_friction", {"width_deg": 2.0}), AddedEffect("gravity_load", {"load_deg": 6.0}))


@pytest.mark.parametrize(
    ("effect", "numbers", "size"),
    [("viscous_friction", {"tau_s": 0.04}, "tau_s"), ("inertia", {"time_s": 0.05}, "time_s")],
)
def test_less_than_on_the_earlier_day_is_found_with_its_sign(effect: str, numbers: dict[str, float], size: str) -> None:
    found = diagnose(None, session(202), [session(201, AddedEffect(effect, numbers))])
    assert [cause.effect for cause in found.causes] == [effect]
    assert found.causes[0].parameters[size].value < 0.0
    assert " less " in headline(found)[0]


@pytest.mark.parametrize(
    ("effect", "size", "words"),
    [
        ("coulomb_friction", "width_deg", ("more", "less")),
        ("viscous_friction", "tau_s", ("more", "less")),
        ("inertia", "time_s", ("more", "less")),
        ("stiffness", "stiffness", ("stiffer", "softer")),
    ],
)
def test_the_sentence_says_the_direction(effect: str, size: str, words: tuple[str, str]) -> None:
    for value, word in zip((0.5, -0.5), words, strict=True):
        said = EFFECT_WORDS[effect].sentence({size: Interval(value, value - 0.1, value + 0.1)})
        assert f" {word} " in f"{said} "
        assert "-" not in said.replace("over", "")
