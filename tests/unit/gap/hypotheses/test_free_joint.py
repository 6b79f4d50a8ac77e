"""What acts on a joint behind the muscles' own hysteresis: friction cannot be told from a play or a sensor's lag, and
is not; a mass and a weight can."""

from dataclasses import replace

import pytest
from support.plants.gap_rigs import asked, session

from rig.gap.hypotheses.library import FREE_JOINT, LIBRARY
from rig.gap.priors import fitted
from rig.model.effect_stages import EFFECT_STAGES
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


@pytest.mark.parametrize(
    ("effect", "numbers", "size"),
    [("inertia", {"time_s": 0.04}, "time_s"), ("gravity_load", {"load_deg": 3.0, "phase_deg": 30.0}, "load_deg")],
)
def test_a_mass_and_a_weight_on_it_are_named_with_their_size(effect: str, numbers: dict[str, float], size: str) -> None:
    first = asked(session(40, AddedEffect(effect, numbers))).causes[0]
    assert first.effect == effect
    assert first.confidence > 0.6
    assert first.parameters[size].value == pytest.approx(numbers[size], rel=0.1)
    assert not FREE_JOINT.keys() & first.parameters.keys()


def test_a_weight_that_pulls_straight_down_on_it_may_be_a_gain_of_the_sensor() -> None:
    (cause,) = asked(session(40, AddedEffect("gravity_load", {"load_deg": 3.0}))).causes
    assert {"gravity_load", "sensor_gain"} <= {cause.effect, *cause.ambiguous_with}


def test_a_supply_that_sags_without_a_tank_is_found_with_its_size() -> None:
    cause = asked(session(40, AddedEffect("supply_droop", {"droop_s": 0.1}))).causes[0]
    assert "supply_droop" in {cause.effect, *cause.ambiguous_with}
    if cause.effect == "supply_droop":
        assert cause.parameters["droop_s"].value == pytest.approx(0.1, rel=0.1)


@pytest.mark.parametrize("integral_s", [0.0, 0.8])
def test_a_receiver_that_empties_is_found_with_what_its_supply_delivers(integral_s: float) -> None:
    numbers = {"capacity_mpa_s": 0.15, "fall": 3.0, "integral_s": integral_s}
    cause = asked(session(40, AddedEffect("emptied_receiver", numbers))).causes[0]
    assert cause.effect == "supply_droop"
    assert cause.confidence > 0.9
    assert cause.parameters["capacity_mpa_s"].value == pytest.approx(0.15, rel=0.1)


def test_a_ceiling_of_regulators_that_integrate_is_found_with_both() -> None:
    cause = asked(session(40, AddedEffect("pressure_ceiling", {"ceiling_mpa": 0.25, "integral_s": 0.8}))).causes[0]
    assert cause.effect == "pressure_ceiling"
    assert cause.parameters["ceiling_mpa"].value == pytest.approx(0.25, rel=0.02)
    assert cause.parameters["integral_s"].value == pytest.approx(0.8, rel=0.2)


def test_a_law_that_acts_like_another_effect_is_as_rough_as_that() -> None:
    prior = replace(fitted().prior, laws={"viscous_friction": 0.3, "sensor_lag": 0.02})
    effect = LIBRARY["viscous_friction"]
    assert {effect.roughness(prior, law) for law in effect.laws} == {0.3, 0.02}


def test_an_answer_s_numbers_tell_by_which_law_it_was_found() -> None:
    effect = LIBRARY["viscous_friction"]
    for law in effect.laws:
        for shape in law.shapes:
            numbers = EFFECT_STAGES[law.stage].neutral() | {"viscous_time_s": 0.02, "loop_1": 1.5} | dict(shape)
            assert effect.law_of(law.stage, numbers | {"tau_s": 0.01}).like == law.like
