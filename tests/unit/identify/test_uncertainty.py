"""How surely parameters are known: intervals hold the truth as often as they say, what no row shows is not exact."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import CONFIGS
from hypothesis import given
from hypothesis import strategies as st

from rig.columns import NORMAL_95
from rig.identify.fit import SearchSettings, identify
from rig.identify.records.data import prepare
from rig.identify.response.valves import identify_valves
from rig.identify.search.objective import make_objective
from rig.identify.search.one_search import Budget, search
from rig.identify.search.optimizers import polish
from rig.identify.search.space import Space
from rig.identify.search.swarm import SwarmSettings
from rig.identify.search.uncertainty import inverse_information, local_uncertainty
from rig.identify.templates import Template, template_model
from rig.model.parameters import Input, Model, load_model
from rig.model.simulation import simulate
from rig.record import Record

MODELS = CONFIGS / "models"
TRUTH = load_model(MODELS / "simulated.yaml")
SINE_S = np.arange(2000) * 0.005


def model(drive: Input = Input.PRESSURE, *, mean_exponent: float | None = 1.0) -> Model:
    return template_model(Template(drive=drive, mean_exponent=mean_exponent), 40.0)


def clean(frequency_hz: float) -> Record:
    dp_mpa = 0.2 * np.sin(2 * np.pi * frequency_hz * SINE_S)
    return simulate(TRUTH, Record("sine", SINE_S, dp_mpa, facts={"p0_mpa": 0.2}))


def misses(frequency_hz: float, noise_deg: float, seeds: range) -> np.ndarray:
    """By how many of its standard deviations each parameter of (11) is off, in records that differ by the noise of the
    angle: (records, parameters)."""
    start, shown = model(), clean(frequency_hz)
    space = Space(start)
    truth = (np.array([TRUTH.muscle.value(name) for name in space.names]) - space.low) / (space.high - space.low)
    off = []
    for seed in seeds:
        noise = np.random.default_rng(seed).normal(0.0, noise_deg, len(shown))
        objective = make_objective(
            start, space, [prepare(replace(shown, angle_deg=shown.angle_deg + noise), start)], None
        )
        point = search(objective, polish(truth, 100), Budget(100_000)).point
        off.append((point - truth) / local_uncertainty(objective, space, point).std)
    return np.array(off)


@pytest.mark.parametrize(("frequency_hz", "noise_deg"), [(0.5, 0.1), (0.8, 0.3)])
def test_intervals_of_95_percent_hold_the_truth_about_as_often(frequency_hz: float, noise_deg: float) -> None:
    within = np.abs(misses(frequency_hz, noise_deg, range(60))) <= NORMAL_95
    assert 0.90 <= np.mean(within) <= 0.99
    assert np.all(np.mean(within, axis=0) >= 0.85), "each parameter's by itself"


@given(seed=st.integers(0, 10**6), dimension=st.integers(2, 6), blind=st.booleans())
def test_a_direction_that_no_row_shows_is_said(seed: int, dimension: int, blind: bool) -> None:
    random = np.random.default_rng(seed)
    jacobian = random.normal(size=(40, dimension)) * 10.0 ** random.uniform(-3, 3)
    pair = random.choice(dimension, 2, replace=False)
    if blind:
        jacobian[:, pair[1]] = 0.5 * jacobian[:, pair[0]]
    inverse, flagged = inverse_information(jacobian)
    assert set(np.nonzero(flagged)[0]) == (set(pair) if blind else set())
    rest = ~flagged
    spread = np.sqrt(np.diag(inverse))
    if not blind:
        assert inverse == pytest.approx(np.linalg.inv(jacobian.T @ jacobian), rel=1e-6)
    assert np.all(spread[flagged] > 1e6 * np.max(spread[rest], initial=0.0))
    assert np.isfinite(inverse).all()


def test_no_row_at_all_determines_nothing() -> None:
    assert list(inverse_information(np.zeros((9, 3)))[1]) == [True] * 3
    assert inverse_information(np.zeros((9, 0)))[0].shape == (0, 0)


def test_a_parameter_that_no_record_shows_is_not_exact() -> None:
    """With both set-points about P0 their sum never moves: nothing is known of how the mean pressure counts."""
    shown = replace(clean(0.5), p1_mpa=None, p2_mpa=None)
    settings = SearchSettings(seeds=(1,), swarm=SwarmSettings(iterations=30), workers=1, bounded=False)
    start = model(Input.COMMAND, mean_exponent=None)
    free = {name: replace(one, free=name in ("lambda1", "xi1", "mean_exponent"))
            for name, one in start.muscle.parameters.items()}  # fmt: skip
    found = identify([shown], replace(start, muscle=replace(start.muscle, parameters=free)), settings)
    exponent, known = (found.model.muscle.parameters[name] for name in ("mean_exponent", "xi1"))
    assert exponent.std is None
    assert known.std is not None
    assert known.std > 0.0
    (told,) = [text for text in found.warnings if "not determined" in text]
    assert told.endswith("mean_exponent")


def test_a_regulator_that_only_stands_still_has_no_exact_lag() -> None:
    still = np.full(1000, 0.2) + 1e-4 * np.random.default_rng(1).normal(size=1000)
    record = Record("still", 0.005 * np.arange(1000), np.zeros(1000), p1_mpa=still, p2_mpa=still)
    fit = identify_valves([record], 0.005, 0.2)
    assert fit.stage.parameters["valve1_tau_s"].std is None
    assert fit.stage.parameters["valve1_gain"].std is None, "gain and offset are one at a single pressure"
    assert any("valve 1: tau_s is not determined" in note for note in fit.notes)
