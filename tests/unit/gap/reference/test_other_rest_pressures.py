"""A simulator that says what the mean pressure does follows its rig to other rest pressures: what it says exactly is no
gap."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

from rig.app.model.simulating import commands_of
from rig.gap import diagnose
from rig.gap.diagnosis import diagnose_with_grounds
from rig.model.parameters import Model, load_model
from rig.model.simulation import simulate
from rig.record import Record

MODEL = load_model(ROOT / "configs" / "models" / "simulated.yaml")


def day(sweep: Path, model: Model = MODEL, seed: int = 4) -> list[Record]:
    """What the model says of a sweep, with the noise of a sensor of 0.02 deg and monitors of 0.3 kPa."""
    random, made = np.random.default_rng(seed), []
    for record in commands_of(sweep, model.sample_time_s):
        said = simulate(model, record)
        noise = {"angle_deg": 0.02, "p1_mpa": 3e-4, "p2_mpa": 3e-4}
        read = {name: said.columns()[name] + std * random.standard_normal(len(said)) for name, std in noise.items()}
        made.append(replace(record, **read))  # type: ignore[arg-type]
    return made


@pytest.mark.parametrize("rest", ["0.15", "0.25", "[0.15, 0.2, 0.25, 0.3]"])
def test_a_rig_that_its_simulator_says_exactly_has_no_gap_at_any_rest_pressure(tmp_path: Path, rest: str) -> None:
    sweep = tmp_path / "elsewhere.yaml"
    sweep.write_text(
        f"name: elsewhere\np0_mpa: {rest}\nsettle_s: 3.0\nduration_s: 10.0\nrecords:\n"
        "  - sine: {frequency_hz: 0.5, amplitude_mpa: 0.15}\n"
        "  - triangle: {frequency_hz: 0.2, amplitude_mpa: 0.1}\n"
        "  - sine: {frequency_hz: 1.0, amplitude_mpa: 0.1}\n"
    )
    found = diagnose(MODEL, day(sweep))
    assert found.verdict == "none", found.causes
    assert found.gap.rms_deg < 0.2


@pytest.mark.parametrize("says", ["a fact", "nothing"])
def test_nor_where_its_records_hold_the_difference_of_their_set_points_alone(tmp_path: Path, says: str) -> None:
    """All about one P0 they were: each record of another one was answered by regulators that are 50 kPa off."""
    sweep = tmp_path / "several.yaml"
    sweep.write_text(
        "name: several\np0_mpa: [0.15, 0.2, 0.25]\nsettle_s: 3.0\nduration_s: 10.0\nrecords:\n"
        "  - sine: {frequency_hz: 0.5, amplitude_mpa: 0.15}\n"
        "  - sine: {frequency_hz: 1.0, amplitude_mpa: 0.1}\n"
    )
    records = [
        replace(
            record,
            p1_cmd_mpa=None,
            p2_cmd_mpa=None,
            facts={name: value for name, value in record.facts.items() if name != "p0_mpa" or says == "a fact"},
        )
        for record in day(sweep)
    ]
    assert all(("p0_mpa" in record.facts) == (says == "a fact") for record in records)
    found = diagnose(MODEL, records)
    assert found.verdict == "none", found.causes
    assert found.gap.rms_deg < 0.2
    assert any(note.startswith("P0 stands in no record") for note in found.notes) == (says == "nothing")


@pytest.mark.parametrize(("rest", "law"), [("[0.15, 0.2, 0.25, 0.3]", 0.5), ("0.2", 1.0)])
def test_what_the_mean_pressure_does_is_taken_from_days_that_show_it(tmp_path: Path, rest: str, law: float) -> None:
    sweep = tmp_path / "several.yaml"
    sweep.write_text(
        f"name: several\np0_mpa: {rest}\nsettle_s: 3.0\nduration_s: 10.0\nrecords:\n"
        "  - sine: {frequency_hz: 0.5, amplitude_mpa: 0.1}\n"
        "  - triangle: {frequency_hz: 0.2, amplitude_mpa: 0.1}\n"
    )
    muscle = MODEL.muscle
    less = {**muscle.parameters, "mean_exponent": replace(muscle.parameters["mean_exponent"], value=0.5)}
    rig = replace(MODEL, muscle=replace(muscle, parameters=less))
    _, grounds = diagnose_with_grounds(None, day(sweep, rig), [day(sweep, rig, seed=5)])
    assert grounds.expected.response.exponent == pytest.approx(law, abs=0.1)
