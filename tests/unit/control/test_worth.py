"""What finding a cause is worth to a feed-forward: as much as a run with it shows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.app import shipped
from rig.app.model.simulating import by_model, commands_of
from rig.control.frequency_response import best_linear_approximation
from rig.control.plant import plant_of
from rig.control.worth import mended, worth
from rig.gains import ClosedLoop
from rig.model.parameters import AddedEffect, Model, load_model, save_model
from rig.record import Record

GAINS = ClosedLoop(0.002, 0.04)
PERIOD_S = 0.005


@pytest.fixture(scope="module")
def model() -> Model:
    return load_model(shipped.configs() / "models" / "simulated.yaml")


def recorded(model: Model, folder: Path) -> list[Record]:
    """The first records of the diagnosis' sweep on a rig that is exactly that model."""
    save_model(model, folder / "rig.yaml")
    simulator = by_model(folder / "rig.yaml", from_pressures=False)
    return [simulator.answer(record, 0.0) for record in commands_of(Path("gap"), PERIOD_S)[:2]]


def test_the_right_cause_closes_everything_and_no_cause_nothing(model: Model, tmp_path: Path) -> None:
    changed = replace(model, effects=[AddedEffect("delay", {"delay_s": 0.03})])
    records = recorded(changed, tmp_path)
    assert worth(model, changed, records, GAINS).closer > 0.99
    assert worth(model, model, records, GAINS).closer == 0.0
    half = replace(model, effects=[AddedEffect("delay", {"delay_s": 0.015})])
    assert worth(model, half, records, GAINS).closer == pytest.approx(0.5, abs=0.05)
    assert worth(half, model, records, GAINS).closer == pytest.approx(-1.0, abs=0.1)


def test_feedback_mends_what_is_slow_and_leaves_what_is_fast(model: Model) -> None:
    plant = best_linear_approximation(plant_of(model, 0.2, 5_000_000), 0.1)
    t = PERIOD_S * np.arange(8000)
    for hz, low, high in ((0.05, 0.0, 0.1), (0.3, 0.1, 0.4), (10.0, 0.9, 1.1)):
        wave = np.sin(2 * np.pi * hz * t)
        left = mended(wave, plant, GAINS)[2000:6000]
        assert low < float(np.sqrt(np.mean(left**2) / np.mean(wave[2000:6000] ** 2))) < high
    without = mended(np.sin(t), plant, ClosedLoop(0.0, 0.0))
    np.testing.assert_allclose(without, np.sin(t), atol=1e-9)


@pytest.mark.parametrize("every", [2, 4])
def test_records_at_another_period_are_worth_the_same(model: Model, tmp_path: Path, every: int) -> None:
    changed = replace(model, effects=[AddedEffect("sensor_gain", {"gain": 0.2})])
    records = recorded(changed, tmp_path)
    seldom = [record.rows(slice(None, None, every)) for record in records]
    whole, thinned = worth(model, changed, records, GAINS), worth(model, changed, seldom, GAINS)
    assert thinned.before_deg == pytest.approx(whole.before_deg, rel=0.15)
