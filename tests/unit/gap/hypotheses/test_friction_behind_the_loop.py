"""Friction of a joint behind the muscles' own hysteresis cannot be told from a play or a sensor's lag, and is not."""

import pytest
from support.plants.gap_rigs import asked, session

from rig.gap.hypotheses.library import LIBRARY
from rig.gap.settings import Prior
from rig.model.parameters import AddedEffect


@pytest.mark.parametrize(
    ("effect", "parameters", "either"),
    [
        ("coulomb_friction", {"width_deg": 1.0}, {"coulomb_friction", "backlash"}),
        ("backlash", {"width_deg": 1.0}, {"coulomb_friction", "backlash"}),
        ("viscous_friction", {"tau_s": 0.02}, {"viscous_friction", "sensor_lag"}),
    ],
)
def test_the_answer_names_both(effect: str, parameters: dict[str, float], either: set[str]) -> None:
    (cause,) = asked(session(40, AddedEffect(effect, parameters))).causes
    assert {cause.effect, *cause.ambiguous_with} == either
    assert cause.confidence < 0.95


def test_a_law_that_acts_like_another_effect_is_as_rough_as_that() -> None:
    prior = Prior(laws={"viscous_friction": 0.3, "sensor_lag": 0.02})
    effect = LIBRARY["viscous_friction"]
    assert {effect.roughness(prior, law) for law in effect.laws} == {0.3, 0.02}
    assert effect.roughness(prior) == 0.3
