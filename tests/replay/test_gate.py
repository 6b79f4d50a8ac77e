"""The replay gate: reference logs, replayed through the loop on the simulated rig, must come out as they are.

A change of the model, the simulated rig or the loop that moves an output fails here with the field, the tick and the
difference. When the change is meant, make new references as docs/how-to/replay.md says.
"""

from pathlib import Path

import pytest
import yaml

from rig.app import shipped
from rig.app.runs import replaying
from rig.log.convert import read_content

HERE = Path(__file__).resolve().parent
REFERENCES = sorted(HERE.glob("*.mcap"))


def replayed(reference: Path, folder: Path, model: Path | None = None) -> replaying.Replayed:
    job = replaying.prepare(reference, None, model, None, resample=False)
    options = replaying.ReplayOptions(out=folder / reference.name, tolerances=replaying.load_gate(HERE / "gate.yaml"))
    (result,) = replaying.replay_all(job, options)
    return result


def test_there_are_references() -> None:
    assert len(REFERENCES) >= 2


@pytest.mark.parametrize("reference", REFERENCES, ids=lambda path: path.stem)
def test_nothing_has_moved(reference: Path, tmp_path: Path) -> None:
    result = replayed(reference, tmp_path)
    assert not result.departures, "\n".join(result.departures)
    assert result.comparison["rmse_deg"] == pytest.approx(0.0, abs=1e-9)
    assert result.comparison["command_difference_mpa"] == 0.0
    content = read_content(result.file)
    assert (content.run_facts["name"], content.run_facts["replay_of"]) == (reference.stem, reference.name)
    assert content.result_facts["replay"]["compared_ticks"] == 600
    assert result.figure.read_text().lstrip().startswith("<?xml")
    assert sorted(file.suffix for file in tmp_path.iterdir()) == [".mcap", ".svg"]


def test_a_moved_parameter_of_the_model_is_caught(tmp_path: Path) -> None:
    """The gate itself can fail: a valve that answers a little more slowly is named by field, tick and difference."""
    changed = yaml.safe_load((shipped.configs() / "models" / "simulated.yaml").read_text())
    changed["valve"]["parameters"]["valve1_tau_s"]["value"] *= 1.5
    model = tmp_path / "changed.yaml"
    model.write_text(yaml.safe_dump(changed))
    result = replayed(REFERENCES[0], tmp_path, model)
    named = [finding.split(" at tick ")[0] for finding in result.departures]
    assert "p1_mpa" in named
    assert "angle_deg" in named
    assert "p1_cmd_mpa" not in named[: named.index("p1_mpa")]
    assert all("the reference has" in finding and "a difference of" in finding for finding in result.departures)
    assert result.comparison["rmse_deg"] > 0.1
