"""The real wrist joint from its simulator alone: what it lacks, and that its quiet part is no gap."""

import csv
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from conftest import ROOT

from rig.gap import diagnose
from rig.gap.answer.consistency import contradictions
from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.sizes import size
from rig.log.reader import read
from rig.model.parameters import load_model

PARTS = {"quiet": (0.5, 8.0), "sweep": (8.0, 16.4)}
COLUMNS = {
    "p1_cmd_mpa": "u_cmd_DF_MPa", "p2_cmd_mpa": "u_cmd_F_MPa", "p1_mpa": "y_meas_DF_MPa", "p2_mpa": "y_meas_F_MPa",
}  # fmt: skip
REST_DEG = 36.0


@pytest.fixture(scope="module")
def wrist(shared: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the two parts and the model that was identified from the quiet one."""
    place = tmp_path_factory.mktemp("wrist")
    (source,) = (shared / "real" / "porcaro_wrist").glob("exp3_sweep_*.csv")
    for name, (start_s, end_s) in PARTS.items():
        with source.open(newline="") as lines, (place / f"{name}.csv").open("w", newline="") as out:
            rows = csv.writer(out)
            rows.writerow(["t_s", *COLUMNS, "angle_deg"])
            for row in csv.DictReader(lines):
                if row["is_repeat_of_previous_packet"] == "0" and start_s <= float(row["t_s"]) < end_s:
                    angle_deg = float(row["y_wrist_angle_deg"]) - REST_DEG
                    rows.writerow([row["t_s"], *(row[column] for column in COLUMNS.values()), f"{angle_deg:.2f}"])
    call = ["identify", "quiet.csv", "-o", "wrist.yaml", "--input", "pressure", "--resample"]
    subprocess.run([sys.executable, "-m", "rig.cli.main", *call], cwd=place, check=True, capture_output=True)
    return place


@cache
def found(wrist: Path, part: str, reference: str) -> Diagnosis:
    return diagnose(load_model(wrist / "wrist.yaml"), read(wrist / f"{part}.csv"), reference=reference)


@pytest.mark.parametrize("reference", ["auto", "simulator"])
def test_the_quiet_part_is_no_gap(wrist: Path, reference: str) -> None:
    said = found(wrist, "quiet", reference)
    assert said.verdict == "none"
    assert contradictions(said.to_json()) == []


def test_the_simulator_lacks_the_mass_of_the_joint(wrist: Path) -> None:
    said = found(wrist, "sweep", "simulator")
    first = said.causes[0]
    assert first.effect == "inertia"
    assert 0.024 < first.parameters["time_s"].value < 0.045  # 3.5 to 6.6 Hz; the record rings near 4
    assert said.gap.after_deg < 0.8 * said.gap.rms_deg
    assert contradictions(said.to_json()) == []


def test_a_description_that_has_a_mass_of_its_own_lacks_something_behind_the_valves(wrist: Path) -> None:
    said = found(wrist, "sweep", "auto")
    assert said.reference == "fingerprint"
    assert "unknown" in {cause.effect for cause in said.causes}
    assert said.where.shares["downstream"] > 0.7
    assert {one.test for one in said.observations} == {"time stamps"}


def test_the_tutorial_tells_what_comes_out(wrist: Path) -> None:
    page = (ROOT / "docs/tutorial/diagnose_real_joint.md").read_text(encoding="utf-8")
    quiet, lacks, changed = (
        found(wrist, *one) for one in (("quiet", "auto"), ("sweep", "simulator"), ("sweep", "auto"))
    )
    for said in (
        f'answers "none", with a probability of {100 * quiet.confidence:.0f} %: {quiet.gap.rms_deg:.1f} degrees off,',
        f"where {quiet.gap.floor_deg:.1f} are usual beside the fingerprint",
        f"*{lacks.verdict.replace('_', ' ')}* with {100 * lacks.confidence:.0f} %",
        f"inertia over stiffness of {size(lacks.causes[0].parameters['time_s'])}",
        f"falls from {lacks.gap.rms_deg:.0f} to {lacks.gap.after_deg:.0f} degrees",
        f"is *{changed.verdict.replace('_', ' ')}* with {100 * changed.confidence:.0f} %",
    ):
        assert said in page
