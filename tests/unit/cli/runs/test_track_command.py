"""`pamrig track` and `tune`: what they write, what they say, and what they refuse before anything moves."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from support.records.mcap_files import contents

from rig.app import compose, shipped
from rig.app.runs import runner
from rig.app.runs.outcome import RunOutcome
from rig.app.runs.tracking import TrackOptions, prepare
from rig.cli.gap.group import gap
from rig.cli.runs.track import track, tune
from rig.errors import CheckFailed, RigError
from rig.excite.sweep import load_sweep
from rig.log.reader import read
from rig.model.parameters import AddedEffect, load_model, save_model
from rig.sample import pack
from rig.service.records.recorder_messages import RunResult

GAINS = "closed_loop: {kp_mpa_per_deg: 0.002, ki_mpa_per_deg_s: 0.04}\n"
TIMES = "settle_s: 0.5\nzero_s: 0.2\nramp_in_s: 0.5\nduration_s: 2.0\nramp_out_s: 0.2\n"
RECORDS = "records:\n  - sine: {frequency_hz: 0.5, amplitude_deg: 20}\n"
MODEL = str(shipped.configs() / "models" / "simulated.yaml")


def call(*words: object) -> Result:
    """With the virtual clock; errors that end the program are raised."""
    return CliRunner().invoke(track, [*map(str, words), "--clock", "virtual"], catch_exceptions=False)


@pytest.fixture
def wave(tmp_path: Path) -> Path:
    path = tmp_path / "wave.yaml"
    path.write_text(GAINS + TIMES + RECORDS, encoding="utf-8")
    return path


def test_the_inverse_follows_closer_and_the_json_says_so(tmp_path: Path, wave: Path) -> None:
    done = call(
        wave, "--model", MODEL, "--feedforward", "none", "--feedforward", "model", "-o", tmp_path / "out",
        "--json", tmp_path / "r.json", "--figure", tmp_path / "f.svg",
    )  # fmt: skip
    assert done.exit_code == 0
    runs = json.loads((tmp_path / "r.json").read_text())["runs"]
    assert [run["feedforward"] for run in runs] == ["none", "model"]
    assert {run["reference"] for run in runs} == {"sine_0.5hz_20deg"}
    alone, both = runs
    assert both["rmse_deg"] < 0.1 * alone["rmse_deg"]
    assert both["inverse_residual_max_deg"] < 0.5
    assert alone["lag_s"] > 0.05 > abs(both["lag_s"])
    assert alone["max_deg"] >= alone["rmse_deg"] > 0.0
    assert all(Path(run["file"]).is_file() and run["valid"] for run in runs)
    assert (tmp_path / "f.svg").stat().st_size > 1000
    record = read(Path(runs[0]["file"]))[0]
    assert record.facts["closed_loop"]["kp_mpa_per_deg"] == 0.002
    assert len(record.extra["reference_deg"]) == 400


def test_a_record_that_a_full_disk_did_not_take_is_told_as_that(
    tmp_path: Path, wave: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its sweep was whole: the missing file was read, and that it was not there was all that was said."""
    no_room = "cannot be written: No space left on device"
    lost = RunResult(1, tmp_path / "sine_0.5hz_20deg_none.mcap", complete=True, error=no_room)
    outcome = RunOutcome([lost], 1, error=f"the rig was stopped: {no_room}")
    monkeypatch.setattr(runner, "carry_out", lambda *_: outcome)
    with pytest.raises(CheckFailed, match=r"the rig was stopped: cannot be written: No space left"):
        call(wave, "-o", tmp_path / "out", "--json", tmp_path / "r.json")
    (run,) = json.loads((tmp_path / "r.json").read_text())["runs"]
    assert run["error"] == no_room


def test_one_seed_is_one_history(tmp_path: Path, wave: Path) -> None:
    samples = []
    for name in ("first", "again"):
        call(wave, "--model", MODEL, "--seed", 7, "-o", tmp_path / name)
        samples.append([pack(s) for s in contents(tmp_path / name / "sine_0.5hz_20deg_model.mcap").samples])
    assert samples[0] == samples[1]


def test_without_gains_they_come_from_the_model(tmp_path: Path) -> None:
    path = tmp_path / "bare.yaml"
    path.write_text(TIMES + RECORDS, encoding="utf-8")
    done = call(path, "--model", MODEL, "-o", tmp_path / "out")
    assert "gains from the model" in done.output
    assert "phase margin" in done.output
    with pytest.raises(RigError, match="closed_loop: gains are missing"):
        call(path, "-o", tmp_path / "other")


def test_gains_hold_at_every_rest_pressure_of_the_reference(tmp_path: Path) -> None:
    """At low pressure the joint turns further: those of the first were three times what the last allows."""
    path = tmp_path / "bare.yaml"
    own = "records:\n  - {sine: {frequency_hz: 0.5, amplitude_deg: 5}, p0_mpa: 0.15}\n"
    for text, lowest in (
        ("p0_mpa: [0.35, 0.15]\n" + TIMES + RECORDS, "0.15"),
        ("p0_mpa: 0.35\n" + TIMES + own, "0.15"),
    ):
        path.write_text(text, encoding="utf-8")
        told = []
        for words in (["--reference", str(path), "-o", str(tmp_path / "t.yaml")], ["--p0", lowest]):
            done = CliRunner().invoke(tune, [MODEL, *words, "--json", str(tmp_path / "t.json")], catch_exceptions=False)
            assert done.exit_code == 0, done.output
            told.append(json.loads((tmp_path / "t.json").read_text()))
        both, low = told
        assert both["closed_loop"]["ki_mpa_per_deg_s"] == low["closed_loop"]["ki_mpa_per_deg_s"]
        assert both["margins_off"]["sensitivity"] < 1.65
    found = prepare(TrackOptions(path, model=Path(MODEL)), compose.load(None))
    assert found.gains.ki_mpa_per_deg_s == told[0]["closed_loop"]["ki_mpa_per_deg_s"]


def test_augmented_is_the_model_with_its_effects(tmp_path: Path, wave: Path) -> None:
    model = load_model(Path(MODEL))
    augmented = tmp_path / "augmented.yaml"
    save_model(replace(model, effects=[AddedEffect("delay", {"delay_s": 0.05})]), augmented)
    done = call(
        wave, "--model", augmented, "--feedforward", "model", "--feedforward", "augmented", "-o", tmp_path / "out",
        "--json", tmp_path / "r.json",
    )  # fmt: skip
    assert done.exit_code == 0
    nominal, late = json.loads((tmp_path / "r.json").read_text())["runs"]
    assert nominal["rmse_deg"] < 0.1 * late["rmse_deg"], "the simulated rig has no such delay"


def test_an_augmented_model_that_is_named_is_used(tmp_path: Path, wave: Path) -> None:
    """Without --feedforward it was passed over, or refused for want of --model where it was the only one."""
    augmented = tmp_path / "augmented.yaml"
    save_model(replace(load_model(Path(MODEL)), effects=[AddedEffect("delay", {"delay_s": 0.05})]), augmented)
    for more in ((), ("--model", MODEL)):
        out = tmp_path / f"out{len(more)}"
        assert call(wave, "--augmented", augmented, *more, "-o", out).exit_code == 0
        assert [record.name for record in out.iterdir()] == ["sine_0.5hz_20deg_augmented.mcap"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--feedforward", "model"), "needs --model"),
        (("--model", MODEL, "--feedforward", "augmented"), "needs a model with added effects"),
        (("--rig", "paper_myrio"), "a real rig runs in real time"),
    ],
)
def test_what_is_missing_is_told(tmp_path: Path, wave: Path, words: tuple[str, ...], said: str) -> None:
    with pytest.raises(RigError, match=said) as raised:
        call(wave, *words, "-o", tmp_path / "out")
    assert "\n" not in str(raised.value)
    assert not (tmp_path / "out").exists()


def test_a_sweep_of_pressures_is_no_reference(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text("records: [{sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}}]", encoding="utf-8")
    with pytest.raises(RigError, match="expected angles to follow"):
        call(path)


def test_what_cannot_be_followed_is_refused_before_anything_moves(tmp_path: Path, wave: Path) -> None:
    narrow = tmp_path / "narrow.yaml"
    rig = (shipped.configs() / "rigs" / "simulated.yaml").read_text(encoding="utf-8")
    narrow.write_text(
        rig.replace("pressure_mpa: [0.0, 0.5]", "pressure_mpa: [0.18, 0.22]").replace(
            "../models/simulated.yaml", MODEL
        ),
        encoding="utf-8",
    )
    with pytest.raises(RigError, match=r"cannot be followed inside the envelope: it needs .* What can: "):
        call(wave, "--rig", narrow, "--model", MODEL, "-o", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_tune_writes_the_reference_with_its_gains(tmp_path: Path, wave: Path) -> None:
    words = [MODEL, "--reference", str(wave), "-o", str(tmp_path / "tuned.yaml"), "--json", str(tmp_path / "t.json")]
    done = CliRunner().invoke(tune, words, catch_exceptions=False)
    assert done.exit_code == 0
    told = json.loads((tmp_path / "t.json").read_text())
    gains = load_sweep(tmp_path / "tuned.yaml").closed_loop
    assert gains is not None
    assert gains.ki_mpa_per_deg_s == told["closed_loop"]["ki_mpa_per_deg_s"]
    assert told["margins_off"]["gain"] < told["margins"]["gain"]
    assert told["margins_off"]["sensitivity"] == pytest.approx(1.6, abs=0.05)
    careful = CliRunner().invoke(tune, [MODEL, "--sensitivity", "1.3", "--json", str(tmp_path / "c.json")])
    assert careful.exit_code == 0
    slower = json.loads((tmp_path / "c.json").read_text())["closed_loop"]
    assert slower["ki_mpa_per_deg_s"] < gains.ki_mpa_per_deg_s


def test_a_tuned_reference_finds_its_table_from_where_it_lies(tmp_path: Path) -> None:
    (tmp_path / "a" / "tables").mkdir(parents=True)
    (tmp_path / "b").mkdir()
    for name in ("way", "back"):
        (tmp_path / "a" / "tables" / f"{name}.csv").write_text("t_s,angle_deg\n0,0\n1,10\n2,0\n", encoding="utf-8")
    far = (tmp_path / "a" / "tables" / "back.csv").resolve()
    records = f"records: [{{waveform: {{file: tables/way.csv}}}}, {{waveform: {{file: {far}}}}}]\n"
    (tmp_path / "a" / "r.yaml").write_text(GAINS + TIMES + records, encoding="utf-8")
    words = [MODEL, "--reference", f"{tmp_path}/a/r.yaml", "-o", f"{tmp_path}/b/tuned.yaml"]
    assert CliRunner().invoke(tune, words, catch_exceptions=False).exit_code == 0
    tables = [entry.signal.signal.file for entry in load_sweep(tmp_path / "b" / "tuned.yaml").entries]
    assert [table.resolve() for table in tables] == [far.with_name("way.csv"), far]
    assert "file: ../a/tables/way.csv" in (tmp_path / "b" / "tuned.yaml").read_text()


def test_tune_with_only_one_of_reference_and_output_is_refused(wave: Path) -> None:
    done = CliRunner().invoke(tune, [MODEL, "--reference", str(wave)])
    assert done.exit_code == 2
    assert "go together" in done.output


def test_the_diagnosis_asks_for_gains_before_it_begins(tmp_path: Path) -> None:
    path = tmp_path / "bare.yaml"
    path.write_text(TIMES + RECORDS, encoding="utf-8")
    words = ["diagnose", "--model", MODEL, "--log", str(tmp_path / "none.mcap"), "--tracking", str(path)]
    with pytest.raises(RigError, match="closed_loop: gains are missing"):
        CliRunner().invoke(gap, words, catch_exceptions=False)
