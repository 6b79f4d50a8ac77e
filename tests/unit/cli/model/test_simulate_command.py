"""`pamrig simulate`: a sweep through a model, a log through a model, a sweep through the physics rig."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from rig.cli.model.simulate import simulate
from rig.log.reader import read

SWEEP = """
name: short
settle_s: 1.0
duration_s: 4.0
records:
  - sine: {frequency_hz: [0.5, 0.8], amplitude_mpa: 0.2}
"""


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    file = tmp_path / "short.yaml"
    file.write_text(SWEEP, encoding="utf-8")
    return file


def call(*words: object) -> Result:
    return CliRunner().invoke(simulate, [str(word) for word in words], catch_exceptions=False)


def test_a_sweep_through_a_model_and_its_log_again(sweep: Path, tmp_path: Path) -> None:
    done = call(sweep, "--model", "simulated", "-o", tmp_path / "out", "--figure", tmp_path / "loops.png")
    assert done.exit_code == 0
    records = read(tmp_path / "out")
    assert [record.name for record in records] == ["sine_0.5hz_0.20mpa", "sine_0.8hz_0.20mpa"]
    assert all(record.has_pressures and 30.0 < np.max(record.angle_deg) < 45.0 for record in records)
    assert (tmp_path / "loops.png").stat().st_size > 10_000
    again = call(
        tmp_path / "out" / "sine_0.5hz_0.20mpa.mcap",
        "--model",
        "simulated",
        "-o",
        tmp_path / "b.mcap",
        "--json",
        tmp_path / "j",
    )
    assert again.exit_code == 0
    (run,) = json.loads((tmp_path / "j").read_text(encoding="utf-8"))["runs"]
    assert run["rmse_deg"] < 1e-9
    assert run["ticks"] == 800


def test_the_physics_rig_is_a_source_of_records(sweep: Path, tmp_path: Path) -> None:
    for day in (1, 2):
        assert call(sweep, "--plant", 1, "--session", day, "-o", tmp_path / f"day{day}").exit_code == 0
    first, second = (read(tmp_path / f"day{day}")[0] for day in (1, 2))
    assert 20.0 < np.max(first.angle_deg) < 90.0
    assert 0.0 < np.max(np.abs(first.angle_deg - second.angle_deg)) < 10.0, "days differ a little"


def test_one_source_must_be_named(sweep: Path, tmp_path: Path) -> None:
    assert call(sweep, "-o", tmp_path / "x").exit_code == 2
    assert call(sweep, "--model", "simulated", "--plant", 1, "-o", tmp_path / "x").exit_code == 2
