"""Gains from a model: the margins that are stated are those that the loop has, on the model and on plants 20 % off."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from hil.reference import families
from hil.reference.names import STEPPED
from rig.app import shipped
from rig.control.frequency_response import FrequencyResponse, best_linear_approximation
from rig.control.plant import plant_of
from rig.control.tuning import OFF, SENSITIVITY, Tuned, is_stable, margins, open_loop, responses, tune
from rig.errors import ModelError
from rig.gains import ClosedLoop
from rig.model.chain import Chain
from rig.model.parameters import AddedEffect, Model, load_model
from rig.realtime.closed_loop import Feedback

PERIOD_S = 0.005


def lagging(gain: float, tau_s: float, delay_s: float) -> FrequencyResponse:
    """A first-order lag with dead time, as its own best linear approximation."""
    frequency = np.geomspace(0.05, 99.9, 1000)
    s = 2j * np.pi * frequency
    return FrequencyResponse(frequency, gain * np.exp(-s * delay_s) / (1.0 + s * tau_s), PERIOD_S)


@pytest.fixture(scope="module")
def model() -> Model:
    return load_model(shipped.configs() / "models" / "simulated.yaml")


@pytest.fixture(scope="module")
def tuned(model: Model) -> Tuned:
    return tune(responses(plant_of(model, 0.2, 5_000_000)))


def test_margins_are_those_of_the_textbook() -> None:
    """An integrator k/s with dead time d: crossover k, phase margin 90 deg - k d, gain margin pi / (2 k d)."""
    gains = ClosedLoop(0.0, 0.05)
    found = margins([lagging(100.0, 0.0, 0.05)], gains)
    k = 100.0 * 0.05
    half_tick = k * PERIOD_S / 2  # the integral takes the newest error, half a tick ahead of the continuous one
    assert found.crossover_hz == pytest.approx(k / (2 * math.pi), rel=0.03)
    assert found.phase_deg == pytest.approx(90.0 - math.degrees(k * 0.05 - half_tick), abs=1.5)
    assert found.gain == pytest.approx(math.pi / (2 * k * (0.05 - PERIOD_S / 2)), rel=0.03)
    assert found.delay_s == pytest.approx(math.radians(found.phase_deg) / k, rel=0.03)


@pytest.mark.parametrize(("ki", "stable"), [(0.6, True), (0.66, False)])
def test_the_nyquist_criterion_finds_the_edge(ki: float, stable: bool) -> None:
    """The loop above is unstable from k = pi / (2 d) on, here ki = 0.628."""
    loop = open_loop(lagging(100.0, 0.0, 0.025 + PERIOD_S / 2), ClosedLoop(0.0, ki))
    assert is_stable(loop) is stable
    found = margins([lagging(100.0, 0.0, 0.025 + PERIOD_S / 2)], ClosedLoop(0.0, ki))
    assert (found.gain > 1.0) is stable


@pytest.mark.parametrize(
    "plant", [lagging(200.0, 0.1, 0.02), lagging(-50.0, 0.3, 0.05), lagging(200.0, 0.02, 0.1)], ids=str
)
@pytest.mark.parametrize("sensitivity", [1.3, 1.6, 2.0])
def test_the_bound_is_kept_and_used(plant: FrequencyResponse, sensitivity: float) -> None:
    found = tune([plant], sensitivity)
    assert found.worst.sensitivity == pytest.approx(sensitivity, rel=0.02)
    assert found.nominal.sensitivity <= found.worst.sensitivity
    assert found.worst.gain > sensitivity / (sensitivity - 1.0) * 0.97
    assert found.worst.phase_deg > math.degrees(2 * math.asin(0.5 / sensitivity)) * 0.97
    assert math.copysign(1.0, found.gains.ki_mpa_per_deg_s) == math.copysign(1.0, plant.response[0].real)


@pytest.mark.parametrize("late_s", [0.05, 0.15, 0.25])
def test_the_bound_holds_a_fifth_later_however_late_the_plant_is(late_s: float) -> None:
    """Half a turn at 3 Hz is 167 ms: a plant beyond it was taken for one that answers early, and nothing for later."""
    found = tune([lagging(100.0, 0.05, late_s)])
    harder = lagging((1.0 + OFF) * 100.0, 0.05, (1.0 + OFF) * late_s)
    assert margins([harder], found.gains).sensitivity <= 1.01 * SENSITIVITY


def test_no_gains_are_invented_for_a_plant_that_allows_none() -> None:
    with pytest.raises(ModelError, match="no PI controller"):
        tune([lagging(1e7, 0.1, 0.5)])


def test_the_response_of_a_model_is_its_own(model: Model) -> None:
    """At low frequency the gain of the simulated rig: some 200 deg/MPa; with a valve lag the phase falls as it must."""
    nominal = best_linear_approximation(plant_of(model, 0.2, 5_000_000), 0.1)
    assert abs(nominal.response[0]) == pytest.approx(214.0, rel=0.05)
    slower = replace(model, effects=[AddedEffect("delay", {"delay_s": 0.02})])
    delayed = best_linear_approximation(plant_of(slower, 0.2, 5_000_000), 0.1)
    at = int(np.argmin(np.abs(nominal.frequency_hz - 5.0)))
    turned = np.angle(delayed.response[at] / nominal.response[at])
    assert turned == pytest.approx(-2 * np.pi * 5.0 * 0.02, abs=0.05)


def test_the_simulated_rig_gets_the_margins_that_were_asked_for(tuned: Tuned) -> None:
    assert tuned.worst.sensitivity == pytest.approx(SENSITIVITY, rel=0.02)
    assert tuned.nominal.gain > 3.0
    assert tuned.nominal.phase_deg > 45.0


def off_by(model: Model, gain: float, lag: float) -> Model:
    """The simulated rig with its angle's gain and its regulators' time constants off."""
    muscle, valve = dict(model.muscle.parameters), dict(model.valve.parameters)
    muscle["y_unit_deg"] = replace(muscle["y_unit_deg"], value=gain)
    for name in ("valve1_tau_s", "valve2_tau_s"):
        valve[name] = replace(valve[name], value=lag * valve[name].value)
    return replace(model, muscle=replace(model.muscle, parameters=muscle), valve=replace(model.valve, parameters=valve))


def step_answer(model: Model, gains: ClosedLoop, wanted_deg: float) -> list[float]:
    """The angle under feedback alone after a step of the reference: the loop's own order, read and then write."""
    chain, feedback = Chain(model), Feedback(gains, PERIOD_S)
    chain.reset(0.2, 0.2)
    dp, angles = 0.0, []
    for tick in range(1, 1200):
        _, _, angle = chain.step(0.2 + dp / 2, 0.2 - dp / 2)
        dp = feedback.add(tick, wanted_deg if tick > 1 else 0.0, angle, 0, dp)
        angles.append(angle)
    return angles


@pytest.mark.parametrize(("gain", "lag"), [*itertools.product((1 - OFF, 1.0, 1 + OFF), repeat=2)])
@pytest.mark.parametrize("wanted_deg", [1.0, 15.0])
def test_plants_20_percent_off_settle(model: Model, tuned: Tuned, gain: float, lag: float, wanted_deg: float) -> None:
    angles = step_answer(off_by(model, gain, lag), replace(tuned.gains, error_deg=180.0), wanted_deg)
    assert max(angles) < 1.4 * wanted_deg
    assert all(abs(angle - wanted_deg) < 0.02 * wanted_deg for angle in angles[-400:])


def test_the_stated_gain_margin_is_where_the_loop_breaks(model: Model, tuned: Tuned) -> None:
    """Both sides: well within it settles, well beyond it does not."""
    gains, margin = replace(tuned.gains, error_deg=180.0, limit_mpa=1.0), tuned.nominal.gain
    spread = []
    for factor in (0.5 * margin, 2.5 * margin):
        angles = step_answer(off_by(model, factor, 1.0), gains, 1.0)
        spread.append(max(angles[-200:]) - min(angles[-200:]))
    assert spread[0] < 0.1
    assert spread[1] > 0.5


@pytest.mark.parametrize("family", STEPPED)
@pytest.mark.parametrize("effects", [{}, {"valve_lag": 0.03}, {"delay": 0.03}], ids=str)
def test_rigs_of_another_physics_settle_healthy_or_changed(
    tuned: Tuned, family: str, effects: dict[str, float]
) -> None:
    """Gains of the simulated rig's model on rigs that share no law with it."""
    rig = families.stepped(family, 2, PERIOD_S, (1, 0.01), families.disturbance(family, effects))
    feedback, dp, angles = Feedback(replace(tuned.gains, error_deg=180.0), PERIOD_S), 0.0, []
    for tick in range(1, 1600):
        _, _, angle = rig.step(0.2 + dp / 2, 0.2 - dp / 2)
        dp = feedback.add(tick, 15.0 if tick > 1 else 0.0, angle, 0, dp)
        angles.append(angle)
    assert max(angles) < 1.4 * 15.0
    assert all(abs(angle - 15.0) < 1.0 for angle in angles[-400:])


def test_a_model_with_an_effect_that_nobody_knows_is_told_in_words(model: Model) -> None:
    with pytest.raises(ModelError, match="unknown effect 'backlahs'; did you mean 'backlash'"):
        plant_of(replace(model, effects=[AddedEffect("backlahs", {"width_deg": 1.0})]), 0.2, 5_000_000)
