"""Simulators that are not ours: Python functions and FMUs as models, with effects around them, and what goes wrong."""

import time
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from support.plants.fmu_plant import DEG_PER_MPA, LAG_S, PLAY_DEG, make_fmu

from rig.app import compose
from rig.app.model.simulating import commands_of
from rig.app.runs import replaying
from rig.app.shipped import find_config
from rig.errors import ConfigError, ModelError
from rig.gap.diagnosis import diagnose
from rig.identify.search.stability import SweepRange
from rig.identify.validate import validate
from rig.log.convert import write_record
from rig.model.chain import Chain
from rig.model.parameters import AddedEffect, load_model, save_model
from rig.model.simulation import simulate
from rig.record import Record

PLANT = f"""
import math, time
import numpy as np

calls = []

def plant(time_s, p1_cmd_mpa, p2_cmd_mpa, start_deg=0.0):
    calls.append(len(time_s))
    share = 1.0 - math.exp(-(time_s[1] - time_s[0]) / {LAG_S})
    x = y = start_deg
    angle = np.empty(len(time_s))
    for row, dp in enumerate(p1_cmd_mpa - p2_cmd_mpa):
        x += share * ({DEG_PER_MPA} * dp - x)
        y = min(max(y, x - {PLAY_DEG}), x + {PLAY_DEG})
        angle[row] = y
    return angle

def raises(time_s, p1_cmd_mpa, p2_cmd_mpa):
    raise ValueError("the solver\\nfailed")

def not_a_number(time_s, p1_cmd_mpa, p2_cmd_mpa):
    return np.where(time_s > 1.0, np.nan, 0.0)

def short(time_s, p1_cmd_mpa, p2_cmd_mpa):
    return time_s[1:]

def words(time_s, p1_cmd_mpa, p2_cmd_mpa):
    return "a lot"

def slow(time_s, p1_cmd_mpa, p2_cmd_mpa):
    while True:
        time.sleep(0.01)

def leaves(time_s, p1_cmd_mpa, p2_cmd_mpa):
    raise SystemExit(0)

value = 3
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the simulators lie: a module of a user, and the same plant as an FMU of both versions."""
    place = tmp_path_factory.mktemp("simulators")
    (place / "users_plant.py").write_text(PLANT)
    (place / "users_ruin.py").write_text("import nowhere_at_all\n")
    for version in (2, 3):
        make_fmu(place / f"plant{version}.fmu", version)
    return place


@pytest.fixture(autouse=True)
def _called_there(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(folder)


@pytest.fixture(scope="module")
def command() -> Record:
    (record,) = commands_of(Path("quick"), 0.005)
    return record


def test_function_and_fmus_say_the_same(command: Record) -> None:
    said = [
        simulate(load_model(Path(source)), command).angle_deg
        for source in ("python:users_plant:plant", "plant2.fmu", "plant3.fmu")
    ]
    assert np.ptp(said[0]) > 50.0
    for other in said[1:]:
        assert np.max(np.abs(said[0] - other)) < 1e-9


def test_it_starts_where_the_record_starts(command: Record) -> None:
    for source in ("python:users_plant:plant", "plant2.fmu", "plant3.fmu"):
        said = simulate(load_model(Path(source)), command, start_deg=7.0)
        assert said.angle_deg[0] == pytest.approx(7.0, abs=PLAY_DEG)


def test_effects_stand_before_it_behind_it_and_at_the_sensor(command: Record) -> None:
    model = load_model(Path("python:users_plant:plant"))
    plain = simulate(model, command).angle_deg
    late = simulate(replace(model, effects=[AddedEffect("delay", {"delay_s": 0.02})]), command).angle_deg
    assert np.max(np.abs(late[4:] - plain[:-4])) < 1e-6
    turned = simulate(replace(model, effects=[AddedEffect("sensor_gain", {"gain": 0.1})]), command).angle_deg
    assert np.allclose(turned, 1.1 * plain)


def test_what_was_asked_before_is_not_asked_again(command: Record) -> None:
    users_plant = import_module("users_plant")
    model = load_model(Path("python:users_plant:plant"))
    simulate(model, command)
    before = len(users_plant.calls)
    simulate(replace(model, effects=[AddedEffect("sensor_gain", {"gain": 0.2})]), command)
    assert len(users_plant.calls) == before
    simulate(replace(model, effects=[AddedEffect("delay", {"delay_s": 0.017})]), command)
    assert len(users_plant.calls) == before + 1


def test_a_model_file_around_it_keeps_effects_and_names(command: Record, tmp_path: Path, folder: Path) -> None:
    changed = replace(load_model(folder / "plant2.fmu"), effects=[AddedEffect("sensor_gain", {"gain": 0.1})])
    save_model(changed, tmp_path / "around.yaml")
    again = load_model(tmp_path / "around.yaml")
    assert again == changed
    assert np.array_equal(simulate(again, command).angle_deg, simulate(changed, command).angle_deg)
    text = (tmp_path / "around.yaml").read_text().replace(str(folder / "plant2.fmu"), "plant2.fmu")
    (folder / "beside.yaml").write_text(text)
    assert load_model(folder / "beside.yaml").muscle.source == str(folder / "plant2.fmu")


@pytest.mark.parametrize(
    ("function", "said"),
    [
        ("raises", r"raised ValueError: the solver failed \(users_plant.py, line 19\)"),
        ("leaves", r"raised SystemExit: 0 \(users_plant.py, line 35\)"),
        ("not_a_number", "the angle is nan at 1.005 s"),
        ("short", r"answered with the shape \(1199,\); expected \(1200,\)"),
        ("words", "answered with str; expected 1200 numbers"),
    ],
)
def test_an_answer_that_is_none_is_one_line(command: Record, function: str, said: str) -> None:
    with pytest.raises(ModelError, match=said) as error:
        simulate(load_model(Path(f"python:users_plant:{function}")), command)
    assert "\n" not in str(error.value)


def test_a_script_that_ends_where_it_is_imported_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command ended with it, without a word and with its exit status 0."""
    (tmp_path / "whole_script.py").write_text("import sys\nsys.exit()\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModelError, match=r"importing whole_script raised SystemExit:  \(whole_script\.py, line 2\)"):
        load_model(Path("python:whole_script:simulate"))


def test_one_that_is_slow_is_ended(command: Record) -> None:
    model = load_model(Path("python:users_plant:slow"))
    hurried = replace(model, muscle=replace(model.muscle, patience_s=0.2))
    began = time.monotonic()
    with pytest.raises(ModelError, match=r"no answer within 0\.2 s for a record of 6 s"):
        simulate(hurried, command)
    assert time.monotonic() - began < hurried.muscle.patience_s * 50


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("python:users_plant:plnt", "no function of that name; did you mean 'plant'"),
        ("python:users_plant:value", "'value' is no function"),
        ("python:users_plant", "expected python:MODULE:FUNCTION"),
        ("python:no_such_module:plant", "no module 'no_such_module'; looked for in"),
        ("python:users_ruin:plant", "no module 'nowhere_at_all'"),
        ("nowhere.fmu", "no such file"),
    ],
)
def test_a_simulator_that_is_not_there_is_one_line(source: str, said: str) -> None:
    with pytest.raises(ModelError, match=said) as error:
        load_model(Path(source))
    assert "\n" not in str(error.value)


def test_an_fmu_for_another_machine_another_kind_or_with_other_names(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="is for win64; this machine is"):
        load_model(make_fmu(tmp_path / "windows.fmu", platform="win64"))
    (tmp_path / "text.fmu").write_text("no archive")
    with pytest.raises(ModelError, match="is no FMU"):
        load_model(tmp_path / "text.fmu")
    (tmp_path / "named.yaml").write_text(
        f"muscle: {{kind: external, input: command, source: {folder / 'plant2.fmu'}, names: {{angle_deg: joint}}}}\n"
    )
    with pytest.raises(ModelError, match="no output joint; its outputs are angle_deg"):
        load_model(tmp_path / "named.yaml")


def test_other_models_have_no_source_and_the_simulated_rig_needs_one_that_steps(tmp_path: Path) -> None:
    (tmp_path / "none.yaml").write_text("muscle: {kind: external, input: command}\n")
    with pytest.raises(ModelError, match="the kind external has a source"):
        load_model(tmp_path / "none.yaml")
    with pytest.raises(ModelError, match="goes tick by tick"):
        Chain(load_model(Path("python:users_plant:plant")))
    with pytest.raises(ConfigError):
        find_config(Path("users_plant"), "models")


def test_validation_and_replay(command: Record, tmp_path: Path) -> None:
    source = Path("plant2.fmu")
    made = simulate(load_model(source), command)
    (score,) = validate(load_model(source), [made], SweepRange()).scores
    assert score.rmse_deg < 1e-9
    log = write_record(made, tmp_path / "made.mcap", {"p0_mpa": 0.2})
    job = replaying.prepare(log, compose.load(None), source, None, resample=False)
    (again,) = replaying.replay_all(job, replaying.ReplayOptions(out=tmp_path / "again.mcap"))
    # the recording began at 0 deg in the middle of a sweep, the replay ramps into it: its start differs
    settled = again.beside.residual_deg[100:]
    assert np.max(np.abs(settled - settled[0])) < 1e-6


def test_the_diagnosis_names_what_an_fmu_lacks(tmp_path: Path) -> None:
    model = load_model(Path("plant2.fmu"))
    worn = replace(model, effects=[AddedEffect("delay", {"delay_s": 0.03})])
    noise = np.random.default_rng(5)
    records = []
    for record in commands_of(Path("identify"), 0.005)[:4]:
        said = simulate(worn, record)
        records.append(replace(said, angle_deg=said.angle_deg + noise.normal(0.0, 0.03, len(said))))
    said = diagnose(model, records)
    assert said.verdict == "explained"
    lateness = {said.causes[0].effect, *said.causes[0].ambiguous_with}
    assert "delay" in lateness <= {"delay", "valve_lag", "viscous_friction", "sensor_lag"}, (
        "where, the angle alone does not tell"
    )
    assert said.retuning is None, "it has no parameters of pamrig's"
