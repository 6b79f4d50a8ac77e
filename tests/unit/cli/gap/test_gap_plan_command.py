"""`pamrig gap capability` and `design` as a user calls them."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from support.rigs.narrow_rig import narrow_rig, rig_of_few_effects

from rig.app.model.simulating import commands_of
from rig.cli.commands import cli
from rig.errors import RigError
from rig.excite.sweep import load_sweep
from rig.model.parameters import load_model
from rig.model.simulation import simulate

MODEL = "configs/models/simulated.yaml"


def call(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(cli, ["gap", *words])
    return done.exit_code, done.output


def test_capability_says_sizes_units_and_what_cannot_be_told_apart(tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text(rig_of_few_effects())
    code, text = call(
        "capability", MODEL, "--rig", f"{rig}", "--sweep", "gap", "--sweep", "quick",
        "--json", f"{tmp_path / 'c.json'}", "-o", f"{tmp_path / 'matrix.svg'}",
    )  # fmt: skip
    assert code == 0, text
    sizes, _, apart = text.partition("Records of the sweep quick")[0].partition("not told apart at usual sizes")
    rows = {line.split()[0]: line for line in sizes.splitlines() if line.strip()}
    lines = re.sub(r"\n +", " ", apart).splitlines()  # a long list goes on below itself
    rivals = {line.split()[0]: line for line in lines[1:] if line.strip()}
    assert re.search(r"^valve_gain +\S+ % +\S+ % .* 1.0 %, seen", rows["valve_gain"])
    assert re.search(r"^delay +\S+ ms ", rows["delay"])
    assert re.search(r"^fill_exhaust_asym.* times ", rows["fill_exhaust_asymmetry"])
    said = json.loads((tmp_path / "c.json").read_text())
    assert said["sweep"] == "gap"
    assert said["false_alarm_rate"] == 0.01
    assert {"detectable", "nameable", "unit"} <= said["effects"]["delay"].keys()
    assert said["effects"]["delay"]["unit"] == "s"
    assert all(len(pair) == 2 for pair in said["confusable"])
    assert said["sweeps"]["quick"]["effects"]["delay"]["detectable"] > said["effects"]["delay"]["detectable"]
    assert said["confusable"]
    assert all(second in rivals[first] and first in rivals[second] for first, second in said["confusable"])
    assert "<svg" in (tmp_path / "matrix.svg").read_text()[:2000]


def test_design_writes_a_sweep_that_fits_the_time(tmp_path: Path) -> None:
    code, text = call(
        "design", MODEL, "--minutes", "0.5", "--family", "none", "--rig", f"{narrow_rig(tmp_path)}",
        "-o", f"{tmp_path / 's.yaml'}", "--json", f"{tmp_path / 'd.json'}",
    )  # fmt: skip
    assert code == 0, text
    said = json.loads((tmp_path / "d.json").read_text())
    assert said["minutes"] <= 0.5
    assert 0.0 < said["seen"] <= 1.0
    assert load_sweep(tmp_path / "s.yaml").entries


def test_a_design_keeps_the_joint_inside_the_rig_s_angles(tmp_path: Path) -> None:
    rig, sweep = tmp_path / "rig.yaml", tmp_path / "s.yaml"
    text = rig_of_few_effects()
    for most in (15.0, 40.0):
        rig.write_text(text.replace("angle_deg: [-90.0, 90.0]", f"angle_deg: [-{most}, {most}]"))
        code, said = call("design", MODEL, "--minutes", "2.5", "--family", "none", "--rig", f"{rig}", "-o", f"{sweep}")
        assert code == 0, said
        answers = [simulate(load_model(Path(MODEL)), record) for record in commands_of(sweep, 0.005)]
        assert len(answers) > 5
        assert all(np.abs(answer.angle_deg).max() < most for answer in answers)
    rig.write_text(text.replace("angle_deg: [-90.0, 90.0]", "angle_deg: [-0.1, 0.1]"))
    assert "no room" in refused("design", MODEL, "--family", "none", "--rig", f"{rig}", "-o", f"{sweep}")


def test_a_sweep_is_asked_about_that_the_rig_s_own_limits_allow_and_no_other(tmp_path: Path) -> None:
    sweep, rig = tmp_path / "high.yaml", tmp_path / "rig.yaml"
    sweep.write_text(
        "name: high\np0_mpa: 0.38\nsettle_s: 2.0\nduration_s: 6.0\nrecords:\n"
        "  - sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}\n"
    )
    code, said = call("capability", MODEL, "--rig", "simulated", "--sweep", f"{sweep}")
    assert code == 0, said
    text = Path("configs/rigs/simulated.yaml").read_text()
    rig.write_text(text.replace("pressure_mpa: [0.0, 0.5]", "pressure_mpa: [0.0, 0.47]"))
    assert "allowed is 0 .. 0.47 MPa" in refused("capability", MODEL, "--rig", f"{rig}", "--sweep", f"{sweep}")


def held(folder: Path, more: str = "") -> str:
    sweep = folder / "held.yaml"
    sweep.write_text(
        "name: held\np0_mpa: 0.2\nsettle_s: 2.0\nduration_s: 6.0\nrecords:\n  - hold: {amplitude_mpa: 0.1}\n" + more
    )
    return str(sweep)


def test_a_record_that_a_diagnosis_would_leave_out_is_left_out_and_said(tmp_path: Path) -> None:
    said = refused("capability", MODEL, "--sweep", held(tmp_path))
    assert said.startswith("hold_0.10mpa: no excitation")
    sine = "  - sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}\n"
    code, text = call("capability", MODEL, "--sweep", held(tmp_path, sine))
    assert code == 0, text
    assert "left out, as by a diagnosis: hold_0.10mpa: no excitation" in text


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("capability", MODEL, "--sweep", "configs/references/tracking.yaml"), "an angle to follow, no command"),
        (("capability", "configs/models/none.yaml"), "no such file"),
        (("capability", MODEL, "--sweep", "configs/sweeps/none.yaml"), "no such file"),
        (("capability", MODEL, "--reference", "fingerprint"), "the model file has none"),
    ],
)
def test_bad_input_is_one_line(words: tuple[str, ...], said: str) -> None:
    assert said in refused(*words)


def refused(*words: str) -> str:
    """The line with which a call is refused."""
    done = CliRunner().invoke(cli, ["gap", *words])
    assert isinstance(done.exception, RigError), done.output
    assert "\n" not in str(done.exception)
    return str(done.exception)


def test_a_sweep_beyond_the_rig_s_limits_is_refused(tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    text = Path("configs/rigs/simulated.yaml").read_text()
    rig.write_text(text.replace("pressure_mpa: [0.0, 0.5]", "pressure_mpa: [0.19, 0.21]"))
    assert "allowed is" in refused("capability", MODEL, "--rig", f"{rig}")
