"""Devices and effects from outside: the example package, installed beside pamrig, is found by its names."""

import json
import math
import os
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
import yaml
from conftest import ROOT

from rig import plugins
from rig.errors import ConfigError
from rig.log.reader import read

EXAMPLE = ROOT / "docs" / "examples" / "pamrig_example"
PAGE = ROOT / "docs" / "how-to" / "add_a_device.md"
SWEEP = {"name": "short", "settle_s": 0.2, "zero_s": 0.1, "ramp_in_s": 0.1, "duration_s": 1.0, "ramp_out_s": 0.1}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the example package and its entry points, as pip leaves it."""
    folder = tmp_path_factory.mktemp("outside")
    source = shutil.copytree(EXAMPLE, folder / "source", ignore=shutil.ignore_patterns("__pycache__"))
    call = [
        "install",
        "-q",
        "--no-deps",
        "--no-index",
        "--no-build-isolation",
        "--target",
        str(folder / "site"),
        str(source),
    ]
    subprocess.run([sys.executable, "-m", "pip", *call], check=True, capture_output=True)
    return folder / "site"


def pamrig(installed: Path, where: Path, *words: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(installed)}
    call = [sys.executable, "-m", "rig.cli.main", *words]
    return subprocess.run(call, cwd=where, env=environment, capture_output=True, text=True, check=False)


def test_a_rig_runs_on_a_device_from_outside(installed: Path, tmp_path: Path) -> None:
    rig = PAGE.read_text().partition("```yaml\n")[2].partition("```")[0]
    (tmp_path / "springs.yaml").write_text(rig)
    (tmp_path / "short.yaml").write_text(
        yaml.safe_dump(SWEEP | {"records": [{"sine": {"frequency_hz": 1.0, "amplitude_mpa": 0.1}}]})
    )
    listed = pamrig(installed, tmp_path, "devices", "list", "--rig", "springs.yaml", "--json", "-")
    assert listed.returncode == 0, listed.stderr
    assert "spring_rig" in json.loads(listed.stdout)["kinds"]
    code = (
        "from pathlib import Path; from rig.app import compose; from rig.realtime.clock import VirtualClock\n"
        "device = compose.make_device(compose.load(Path('springs.yaml')), VirtualClock())\n"
        "device.open(); device.write(0.3, 0.2); print(device.read().angle_deg)"
    )
    call = [sys.executable, "-c", code]
    moved = subprocess.run(
        call, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(installed)}, capture_output=True, text=True, check=True
    )
    assert float(moved.stdout) == pytest.approx(12.0)


@pytest.mark.real_time
def test_a_rig_in_mm_runs_live_on_its_own_device(installed: Path, tmp_path: Path) -> None:
    rig = PAGE.read_text().split("```yaml\n")[2].partition("```")[0]
    patient = (
        "limits: {misses_per_s: 200, stall_periods: 400, "  # a machine that stands still is not what is tried here
    )
    (tmp_path / "slide.yaml").write_text(rig.replace("limits: {", patient))
    sine = {"sine": {"frequency_hz": 1.0, "amplitude_mpa": 0.16}}
    (tmp_path / "short.yaml").write_text(yaml.safe_dump(SWEEP | {"records": [sine]}))
    words = ("run", "short.yaml", "--rig", "slide.yaml", "--clock", "real", "--force", "-o", "out", "--json", "-")
    done = pamrig(installed, tmp_path, *words)
    assert done.returncode == 0, done.stderr
    (record,) = read(tmp_path / json.loads(done.stdout)["runs"][0]["file"])
    assert record.period_s == pytest.approx(0.01)
    own = record.own_columns()
    assert own.keys() >= {"set_point_mm", "position_mm"}
    assert own["set_point_mm"].max() == pytest.approx(70.0, abs=0.5)
    assert own["position_mm"].max() == pytest.approx(30.0 + 40.0 / (1.0 + (2 * math.pi * 0.05) ** 2) ** 0.5, abs=1.5)


def test_the_simulator_knows_an_effect_from_outside(installed: Path, tmp_path: Path) -> None:
    model = yaml.safe_load((ROOT / "configs" / "models" / "simulated.yaml").read_text())
    model["effects"] = [{"effect": "sticky_display", "parameters": {"threshold_deg": 1.0}}]
    (tmp_path / "sticky.yaml").write_text(yaml.safe_dump(model))
    words = ("simulate", str(ROOT / "configs" / "sweeps" / "quick.yaml"), "--model", "sticky.yaml", "-o", "out")
    made = pamrig(installed, tmp_path, *words)
    assert made.returncode == 0, made.stderr
    code = "import sys, numpy as np; from rig.log.reader import read_all; from pathlib import Path\n"
    code += "y = read_all([Path('out')])[0].angle_deg; d = np.abs(np.diff(y)); print(d[d > 0].min(), (d == 0).mean())"
    found = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    smallest, still = map(float, found.stdout.split())
    assert smallest >= 1.0
    assert still > 0.5


def test_a_name_that_nobody_registered_is_said(installed: Path, tmp_path: Path) -> None:
    rig = (
        PAGE.read_text().partition("```yaml\n")[2].partition("```")[0].replace("kind: spring_rig", "kind: spring_rigg")
    )
    (tmp_path / "springs.yaml").write_text(rig)
    done = pamrig(installed, tmp_path, "devices", "list", "--rig", "springs.yaml")
    assert done.returncode == 2
    assert "did you mean 'spring_rig'" in done.stderr


def test_our_own_names_cannot_be_taken_and_what_is_no_entry_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plugins, "names", lambda group: ("ours", "theirs", "other"))
    monkeypatch.setattr(plugins, "load", lambda group, key: {"theirs": 2, "ours": 3}.get(key))
    table = plugins.Registered({"ours": 1}, plugins.EFFECTS, lambda key, found: found)
    assert dict(table) == {"ours": 1, "theirs": 2}
    assert "other" not in table


def test_a_package_that_cannot_be_imported_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    point = metadata.EntryPoint("broken", "no_such_package.here:Device", plugins.DEVICES)
    monkeypatch.setattr(metadata, "entry_points", lambda group: [point])
    with pytest.raises(ConfigError, match=r"broken: registered as no_such_package\.here:Device .* cannot be imported"):
        plugins.load(plugins.DEVICES, "broken")
