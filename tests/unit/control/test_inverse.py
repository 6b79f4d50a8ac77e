"""The feed-forward: the model follows with it, it looks ahead, and it never asks for more than the envelope."""

from dataclasses import replace

import numpy as np
import pytest

from rig.app import shipped
from rig.control.feedforward import Inverter, envelope_box
from rig.control.frequency_response import best_linear_approximation
from rig.control.inverse import ANYTHING, DpBounds, Inverse, invert
from rig.control.plant import Plant, plant_of
from rig.errors import EnvelopeError
from rig.excite.reference import AngleReference, tracking
from rig.excite.run_plan import RunPlan
from rig.excite.signals import Mixed, Signal, Sine, Triangle
from rig.gains import ClosedLoop
from rig.model.parameters import AddedEffect, Model, load_model
from rig.realtime.guard import Limits

PERIOD_NS = 5_000_000
LEAD, TICKS = 200, 1000
EFFECTS = {
    "delay": {"delay_s": 0.02},
    "valve_lag": {"tau_s": 0.03},
    "valve_gain": {"gain": -0.2, "balance": 1.0},
    "muscle_mismatch": {"mismatch": 0.2},
    "sensor_lag": {"tau_s": 0.05},
}


@pytest.fixture(scope="module")
def model() -> Model:
    return load_model(shipped.configs() / "models" / "simulated.yaml")


def plan_of(shape: Signal, amplitude_deg: float) -> RunPlan:
    made = tracking(AngleReference(shape, amplitude_deg), LEAD, TICKS, PERIOD_NS, ClosedLoop(0.001))
    return RunPlan("wanted", 0.2, made.feedforward_mpa[LEAD:], 0, 100, LEAD, 0, tracking=made)


def inverse_of(plant: Plant, shape: Signal, amplitude_deg: float = 25.0, box: DpBounds = ANYTHING) -> Inverse:
    followed = plan_of(shape, amplitude_deg).tracking
    assert followed is not None
    response = best_linear_approximation(plant, 0.2)
    return invert(plant, response, np.array(followed.reference_deg), np.array(followed.beyond_deg), box)


@pytest.mark.parametrize("shape", [Sine(0.2, 1.0), Sine(0.8, 1.0), Triangle(0.5, 1.0), Mixed(0.5, 0.5)])
def test_the_model_follows_with_its_inverse(model: Model, shape: Signal) -> None:
    found = inverse_of(plant_of(model, 0.2, PERIOD_NS), shape)
    assert found.rms_deg < 0.05
    assert found.max_deg < 1.0
    assert found.dp_mpa[0] == pytest.approx(0.0, abs=0.002)


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_added_effect_is_inverted_with_it(model: Model, effect: str) -> None:
    changed = replace(model, effects=[AddedEffect(effect, EFFECTS[effect])])
    plant = plant_of(changed, 0.2, PERIOD_NS)
    with_it, without = inverse_of(plant, Sine(0.5, 1.0)), inverse_of(plant_of(model, 0.2, PERIOD_NS), Sine(0.5, 1.0))
    followed = plan_of(Sine(0.5, 1.0), 25.0).tracking
    assert followed is not None
    left = np.array(followed.reference_deg) - plant.angle_deg(without.dp_mpa)
    assert with_it.rms_deg < 0.1 * float(np.sqrt(np.mean(left**2)))


def test_a_dead_time_is_met_by_preview(model: Model) -> None:
    later = replace(model, effects=[AddedEffect("delay", {"delay_s": 0.05})])
    early, usual = (inverse_of(plant_of(one, 0.2, PERIOD_NS), Sine(0.5, 1.0)).dp_mpa for one in (later, model))
    ahead = [float(np.mean((early[100:900] - usual[100 + k : 900 + k]) ** 2)) for k in range(20)]
    assert int(np.argmin(ahead)) == 10


def test_what_no_command_changes_is_left_out(model: Model) -> None:
    noisy = [AddedEffect("sensor_noise", {"std_deg": 3.0}), AddedEffect("valve_gain", {"gain": 0.1})]
    plant = plant_of(replace(model, effects=noisy), 0.2, PERIOD_NS)
    assert [one.effect for one in plant.model.effects] == ["valve_gain"]
    assert plant_of(replace(model, effects=noisy), 0.2, PERIOD_NS, effects=False).model.effects == []


def test_the_error_never_grows(model: Model) -> None:
    """A backlash has no smooth inverse: what is left is told, and is less than without any feed-forward."""
    worn = replace(model, effects=[AddedEffect("backlash", {"width_deg": 2.0})])
    found = inverse_of(plant_of(worn, 0.2, PERIOD_NS), Sine(0.5, 1.0))
    assert found.rms_deg < 0.1 * 25.0 / np.sqrt(2)


def test_set_points_outside_the_box_are_never_proposed(model: Model) -> None:
    box = DpBounds(-0.08, 0.08, 0.002)
    found = inverse_of(plant_of(model, 0.2, PERIOD_NS), Sine(0.5, 1.0), box=box)
    assert box.holds(found.dp_mpa)
    assert found.rms_deg > 1.0


def test_the_envelope_leaves_twice_what_the_nearer_limit_leaves() -> None:
    assert envelope_box(Limits(pressure_mpa=(0.0, 0.5), slew_mpa_s=5.0), 0.2, PERIOD_NS) == DpBounds(-0.4, 0.4, 0.05)
    assert envelope_box(Limits(pressure_mpa=(0.0, 0.5), slew_mpa_s=5.0), 0.3, PERIOD_NS).high_mpa == pytest.approx(0.4)


@pytest.mark.parametrize(("amplitude_deg", "fits"), [(25.0, True), (60.0, False)])
def test_a_reference_that_cannot_be_followed_is_refused_with_what_can(
    model: Model, amplitude_deg: float, fits: bool
) -> None:
    box = DpBounds(-0.2, 0.2, 0.05)
    inverter = Inverter(plant_of(model, 0.2, PERIOD_NS), box)
    plan = plan_of(Sine(0.5, 1.0), amplitude_deg)
    if fits:
        made = inverter.feedforward(plan)
        assert made.plan.tracking is not None
        assert box.holds(np.array(made.plan.tracking.feedforward_mpa))
        return
    with pytest.raises(
        EnvelopeError, match=r"cannot be followed .* needs p1 - p2 = .* What can: .* % of its size"
    ) as e:
        inverter.feedforward(plan)
    share = float(str(e.value).rpartition("the same at ")[2].partition(" %")[0]) / 100
    inverter.feedforward(plan_of(Sine(0.5, 1.0), share * amplitude_deg))
    with pytest.raises(EnvelopeError):
        inverter.feedforward(plan_of(Sine(0.5, 1.0), 1.15 * share * amplitude_deg))
