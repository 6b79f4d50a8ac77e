"""`pamrig gap`: files in, diagnosis, page, augmented model and next sweep out; one clear line for what is wrong."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from support.plants.gap_rigs import MODEL, session

from rig.app.gap.baselines import sessions_of
from rig.cli.gap.group import gap
from rig.errors import RecordError, RigError
from rig.excite.signals import Sine
from rig.excite.sweep import Entry, Timing, load_sweep
from rig.gap import pipeline
from rig.gap.answer.words.sizes import degrees
from rig.gap.plan.experiment import Experiment
from rig.gap.plan.settings import SETTLE_S
from rig.model.parameters import AddedEffect, load_model
from rig.model.simulation import simulate
from rig.record import Record


def write(folder: Path, records: list[Record]) -> Path:
    folder.mkdir()
    for record in records:
        with (folder / f"{record.name}.csv").open("w", newline="") as file:
            rows = csv.writer(file)
            columns = record.columns()
            rows.writerow(columns)
            rows.writerows(zip(*columns.values(), strict=True))
    return folder


@pytest.fixture(scope="module")
def days(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("days")
    for k in (1, 2, 3):
        write(root / f"healthy_{k}", session(k))
    write(root / "late", session(70, AddedEffect("delay", {"delay_s": 0.04})))
    return root


def call(*arguments: object) -> str:
    found = CliRunner().invoke(gap, [str(argument) for argument in arguments], catch_exceptions=False)
    assert found.exit_code == 0, found.output
    return found.output


def healthy(days: Path) -> list[object]:
    return [part for k in (1, 2, 3) for part in ("--baseline", days / f"healthy_{k}")]


def test_everything_that_it_writes_can_be_used(days: Path, tmp_path: Path) -> None:
    files = {name: tmp_path / name for name in ("out.json", "page.html", "augmented.yaml")}
    shown = call(
        "diagnose", "--model", MODEL, "--log", days / "late", *healthy(days), "--json", files["out.json"],
        "--html", files["page.html"], "--augmented-model", files["augmented.yaml"],
    )  # fmt: skip
    assert "Where:" in shown
    said = json.loads(files["out.json"].read_text())
    assert said["verdict"] == "explained"
    assert said["causes"][0]["effect"] == "delay"
    augmented = load_model(files["augmented.yaml"])
    assert augmented.effects[-1].effect == "delay"
    record = session(71)[1]
    before, after = simulate(load_model(MODEL), record), simulate(augmented, record)
    assert before.angle_deg is not None
    assert after.angle_deg is not None
    assert abs(before.angle_deg - after.angle_deg).max() > 1.0
    page = files["page.html"].read_text()
    assert page.count("<svg") >= 5
    assert not re.search(r"""(src|href)=["']https?:""", page)


def test_recommended_sweep_is_one_that_run_accepts(days: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sine = Entry(Sine(frequency_hz=0.5, amplitude_mpa=0.1), Timing(settle_s=SETTLE_S, duration_s=10.0))
    wanted = Experiment((replace(sine, p0_mpa=(0.2,)),), 0.5, 0.7, 0.9, ("creep", "delay"), 4.0)
    monkeypatch.setattr(pipeline, "what_next", lambda *_, **__: wanted)
    call(
        "diagnose", "--model", MODEL, "--log", days / "late", *healthy(days), "--next-experiment",
        tmp_path / "next.yaml",
    )  # fmt: skip
    found = load_sweep(tmp_path / "next.yaml")
    assert (found.entries, found.p0_mpa) == ((sine,), (0.2,))


def test_campaign_of_days_is_diagnosed_day_by_day(days: Path, tmp_path: Path) -> None:
    root = tmp_path / "campaign"
    root.mkdir()
    write(root / "monday", session(73))
    write(root / "tuesday", session(74, AddedEffect("delay", {"delay_s": 0.04})))
    write(root / "wednesday", [replace(one, angle_deg=-np.asarray(one.angle_deg)) for one in session(75)])
    turned = r"^1 of 3 days could not be diagnosed: wednesday: the angle runs against the earlier days'"
    with pytest.raises(RigError, match=turned):
        call(
            "diagnose", "--model", MODEL, "--log", root, *healthy(days), "--json", tmp_path / "days.json",
            "--html", tmp_path / "day.html",
        )  # fmt: skip
    report = json.loads((tmp_path / "days.json").read_text())["days"]
    assert {day: told["verdict"] for day, told in report.items()} == {"monday": "none", "tuesday": "explained"}
    pages = sorted(path.name for path in tmp_path.glob("*.html"))
    assert pages == ["day.html", "day_monday.html", "day_tuesday.html"]
    assert f">{degrees(report['tuesday']['gap']['after_deg'])}<" in (tmp_path / "day.html").read_text()


def test_a_folder_of_sessions_is_several_baselines_and_not_one(days: Path, tmp_path: Path) -> None:
    inside = [days / name for name in ("healthy_1", "healthy_2", "healthy_3", "late")]
    assert sessions_of((days,)) == inside
    assert sessions_of((days / "late", days)) == [days / "late", *inside]
    assert sessions_of((tmp_path / "missing",)) == [tmp_path / "missing"]


def test_a_place_that_cannot_be_written_is_refused_before_the_work(days: Path, tmp_path: Path) -> None:
    with pytest.raises(RigError, match=r"page\.html: cannot be written: no such folder"):
        call("diagnose", "--model", MODEL, "--log", days / "nowhere", "--html", tmp_path / "missing" / "page.html")


@pytest.mark.parametrize(
    ("outputs", "said"),
    [
        (("--augmented-model", "m.yaml"), r"--augmented-model \(late\) .*m_late\.yaml: .* which --model reads"),
        (("--html", "notes.html"), r"notes_late\.html: exists already and is not an HTML page"),
        (("--retuned", f"{'m' * 249}.yaml"), "cannot be written: no file can have that name"),
    ],
)
def test_a_file_of_one_of_several_days_is_refused_before_the_work(
    days: Path, tmp_path: Path, outputs: tuple[str, str], said: str
) -> None:
    """The day's name is put behind that of the option: the model itself was written over, by a model."""
    (tmp_path / "m_late.yaml").write_bytes(Path("configs/models/simulated.yaml").read_bytes())
    (tmp_path / "notes_late.html").write_text("mine")
    model, (option, place) = tmp_path / "m_late.yaml", outputs
    with pytest.raises(RigError, match=said):
        call("diagnose", "--model", model, "--log", days, option, tmp_path / place)
    assert model.read_bytes() == Path("configs/models/simulated.yaml").read_bytes()


def test_effects_lists_the_library(tmp_path: Path) -> None:
    call("effects", "--json", tmp_path / "effects.json")
    report = json.loads((tmp_path / "effects.json").read_text())["effects"]
    assert report["delay"]["parameters"]["delay_s"]["unit"] == "s"
    assert "muscle_mismatch" in report["leak"]["alike_with_pressures"]


def test_missing_file_is_one_clear_line(days: Path) -> None:
    with pytest.raises(RecordError, match="nowhere"):
        call("diagnose", "--model", MODEL, "--log", days / "nowhere")


def test_an_option_before_a_step_of_the_check_is_refused_and_not_passed_over(tmp_path: Path) -> None:
    done = CliRunner().invoke(gap, ["check", "--cases", "8", "make", str(tmp_path / "here")])
    assert done.exit_code == 2
    assert "--cases stands before make; options stand behind the step" in done.output
    assert not (tmp_path / "here").exists()
    assert CliRunner().invoke(gap, ["check", "make", "--help"]).exit_code == 0
