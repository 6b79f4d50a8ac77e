"""A rig with further channels, tags and a channel map: from its YAML through a run into the record, and out again."""

import json
import subprocess
from pathlib import Path

import pytest
from support.run_command import PAMRIG

from rig.app.compose import load
from rig.app.records.logs import describe
from rig.cli.commands import cli
from rig.conditions import conditions
from rig.errors import ConfigError
from rig.gap.records.conditions import difference
from rig.log.reader import read
from rig.record import Record
from rig.report.log_figures import run_figure, terminal_picture

MODEL = Path(__file__).resolve().parents[3] / "configs/models/simulated.yaml"
RIG = """\
name: further
period_ms: {period_ms}
safe: {{p1_mpa: 0.2, p2_mpa: 0.2, return_mpa_s: 0.2}}
limits: {{misses_per_s: 200, stall_periods: 400}}
channels:
  input: {{name: set_point, unit: mm, range: [-50, 50]}}
  output: {{name: position, unit: mm, range: [-100, 100]}}
further:
  - {{name: load_n, unit: N, same_within: 5}}
  - {{name: supply_bar, unit: bar}}
tags: {{muscle: DMSP-10, load_kg: 0.5}}
devices:
  main: {{kind: simulated, model: {model}, seed: 1, further: {{load_n: {load_n}, supply_bar: 6.5}}}}
roles: {{valve_1: main, valve_2: main, monitor_1: main, monitor_2: main, angle: main}}
"""
SWEEP = """\
name: short
settle_s: 0.2
zero_s: 0.1
ramp_in_s: 0.2
duration_s: 2.0
ramp_out_s: 0.2
records:
  - sine: {frequency_hz: 1.0, amplitude_mpa: 0.1}
"""


def rig_file(folder: Path, *, load_n: float = 20.0, period_ms: float = 5.0) -> Path:
    path = folder / "rig.yaml"
    path.write_text(RIG.format(model=MODEL, load_n=load_n, period_ms=period_ms), encoding="utf-8")
    return path


def recorded(folder: Path, **rig: float) -> Record:
    folder.mkdir()
    (folder / "short.yaml").write_text(SWEEP, encoding="utf-8")
    call = ["run", folder / "short.yaml", "--rig", rig_file(folder, **rig), "--clock", "virtual", "--json", "-"]
    words = ["-o", folder / "out", "--tag", "who=ana", "--tag", "load_kg=0.7", "--note", "after the new hose"]
    done = subprocess.run([PAMRIG, *map(str, [*call, *words])], check=True, capture_output=True, text=True)
    (record,) = read(Path(json.loads(done.stdout)["runs"][0]["file"]))
    return record


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Record:
    return recorded(tmp_path_factory.mktemp("further") / "one")


def test_what_the_rig_reads_and_says_is_in_the_record(record: Record) -> None:
    assert set(record.extra["load_n"]) == {20.0}
    assert set(record.extra["supply_bar"]) == {6.5}
    assert record.channels.output.column == "position_mm"
    assert record.facts["tags"] == {"muscle": "DMSP-10", "load_kg": 0.7, "who": "ana"}
    assert record.source is not None
    assert describe(record.source)["facts"]["note"] == "after the new hose"


def test_figures_show_its_own_units_and_further_channels(record: Record) -> None:
    figure = run_figure(record)
    labels = {axes.get_ylabel() for axes in figure.axes}
    assert {"set point [mm]", "position [mm]", "load_n [N], supply_bar [bar]"} <= labels
    assert not any("deg" in label or "MPa" in label for label in labels)
    assert "position [mm] (left), .. command set point [mm] (right)" in terminal_picture(record, 100, 20)


def test_another_load_is_another_condition(record: Record, tmp_path: Path) -> None:
    near, far = (recorded(tmp_path / name, load_n=load_n) for name, load_n in (("near", 23.0), ("far", 27.0)))
    assert conditions(record)["load_n"] == 20.0
    assert conditions(record)["load_kg"] == 0.7
    assert difference(record, near) is None
    apart = difference(record, far)
    assert apart is not None
    assert "load_n is 20, not 27 (allowed: 5 off)" in apart.text


def test_another_period_is_recorded_as_it_is(tmp_path: Path) -> None:
    assert recorded(tmp_path / "slow", period_ms=20.0).period_s == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("supply_bar: 6.5", "", "supply_bar is read by none"),
        ("{name: supply_bar, unit: bar}", "{name: load_n}", "there already"),
        ("  - {name: supply_bar, unit: bar}\n", "", "'supply_bar' is not listed"),
        ("{name: supply_bar", "{name: p1_mpa", "there already"),
        ("range: [-100, 100]", "range: [100, 100]", "is empty"),
        ("load_kg: 0.5", "load_kg: [1]", "tags.load_kg: expected text"),
    ],
)
def test_a_rig_that_does_not_fit_itself_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = rig_file(tmp_path)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError, match=said):
        load(path)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--tag", "who"], "expected NAME=VALUE"),
        (["--tag", "a=1", "--tag", "a=2"], "twice"),
        (["--tag", "1=2"], "no name"),
    ],
)
def test_tags_that_are_none_are_refused_before_anything_moves(words: list[str], said: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=said):
        cli.main(["run", "quick", "--clock", "virtual", "-o", str(tmp_path / "out"), *words], standalone_mode=False)
    assert not (tmp_path / "out").exists()


def test_a_replay_is_told_in_its_own_units_and_refused_by_another_rig(record: Record, tmp_path: Path) -> None:
    words = ["replay", record.source, "--seed", "1", "-o", tmp_path / "again.mcap", "--json", "-"]
    call = [PAMRIG, *map(str, words), "--rig", str(rig_file(tmp_path))]
    done = subprocess.run(call, check=True, capture_output=True, text=True)
    (run,) = json.loads(done.stdout)["runs"]
    assert run["rmse_mm"] < 1.0
    assert "rmse_deg" not in run
    words[words.index("-o") + 1] = tmp_path / "elsewhere.mcap"
    elsewhere = subprocess.run([PAMRIG, *map(str, words)], check=False, capture_output=True, text=True)
    assert elsewhere.returncode == 2
    assert "different rigs" in elsewhere.stderr
