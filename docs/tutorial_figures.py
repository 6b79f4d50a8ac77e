"""The figures of the two tutorials on diagnosis, and of the page on what a rig can tell.

`python docs/tutorial_figures.py` makes the latter and those of the practice case, `python docs/tutorial_figures.py
FOLDER` those of the real joint; both print what was found.

`python docs/tutorial_figures.py FOLDER HERE` makes no figures and leaves the files of the real joint, quiet.csv and
sweep.csv, in HERE. FOLDER holds `real`, records that are no part of this project. What it does for the
real joint is what docs/tutorial/diagnose_real_joint.md tells: two files of clean rows, a model from the quiet one, a
diagnosis of the other.
"""

import csv
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from rig.gap.answer.words.sentences import answers
from rig.gap.diagnosis import diagnose_with_grounds
from rig.log.reader import read
from rig.model.parameters import Model, load_model
from rig.record import Record
from rig.report.gap_figures import figures

ROOT = Path(__file__).resolve().parent.parent
IMAGES = ROOT / "docs" / "images"
REST_DEG = 36.0
"""The wrist's angle at rest, by its own encoder."""
PARTS = {"quiet": (0.5, 8.0), "sweep": (8.0, 16.4)}
"""Seconds of the chirp: up to 2.1 Hz; from there to where the swing jumps down."""


def practice_records(place: Path) -> None:
    """What the page of the practice case records, by its own file and lines, in the folder `place`."""
    page = (ROOT / "docs/tutorial/diagnose_practice.md").read_text(encoding="utf-8")
    (rig,) = re.findall(r"```yaml file=bad_day.yaml\n(.*?)```", page, re.DOTALL)
    (place / "bad_day.yaml").write_text(rig, encoding="utf-8")
    for line in re.findall(r"^pamrig (run .*)$", page, re.MULTILINE):
        subprocess.run([sys.executable, "-m", "rig.cli.main", *line.split()], cwd=place, check=True)


def practice() -> None:
    """A delay and a backlash on the simulated rig."""
    with tempfile.TemporaryDirectory() as place:
        practice_records(Path(place))
        days = [read(day) for day in sorted(Path(place).glob("healthy/*"))]
        draw("practice", load_model(ROOT / "configs/models/simulated.yaml"), read(Path(place) / "bad_day"), days)


def capability() -> None:
    """The matrix of what can be told from what, by the page's own line."""
    page = (ROOT / "docs/how-to/capability.md").read_text(encoding="utf-8")
    (line,) = re.findall(r"^\$ pamrig (gap capability .*)$", page, re.MULTILINE)
    with tempfile.TemporaryDirectory() as place:
        subprocess.run([sys.executable, "-m", "rig.cli.main", *line.split()], cwd=place, check=True)
        (IMAGES / "capability_matrix.svg").write_bytes((Path(place) / "matrix.svg").read_bytes())


def real(folder: Path) -> None:
    """The wrist: a model from the quiet part, a diagnosis of the sweep."""
    with tempfile.TemporaryDirectory() as place:
        write_parts(folder, Path(place))
        call = ["identify", "quiet.csv", "-o", "wrist.yaml", "--input", "pressure", "--resample"]
        subprocess.run([sys.executable, "-m", "rig.cli.main", *call], cwd=place, check=True)
        draw("wrist", load_model(Path(place) / "wrist.yaml"), read(Path(place) / "sweep.csv"), [], "simulator")


def write_parts(folder: Path, place: Path) -> None:
    """The two files that the page works on."""
    (source,) = (folder / "real" / "porcaro_wrist").glob("exp3_sweep_*.csv")
    for name, (start_s, end_s) in PARTS.items():
        _write_part(source, place / f"{name}.csv", start_s, end_s)


def _write_part(source: Path, target: Path, start_s: float, end_s: float) -> None:
    """Rows that are no repeated packet, in our columns: DF is muscle 1, F is muscle 2."""
    with source.open(newline="") as lines, target.open("w", newline="") as out:
        rows = csv.writer(out)
        rows.writerow(["t_s", "p1_cmd_mpa", "p2_cmd_mpa", "p1_mpa", "p2_mpa", "angle_deg"])
        for row in csv.DictReader(lines):
            if row["is_repeat_of_previous_packet"] == "0" and start_s <= float(row["t_s"]) < end_s:
                pressures = [row[name] for name in ("u_cmd_DF_MPa", "u_cmd_F_MPa", "y_meas_DF_MPa", "y_meas_F_MPa")]
                rows.writerow([row["t_s"], *pressures, f"{float(row['y_wrist_angle_deg']) - REST_DEG:.2f}"])


def draw(name: str, model: Model, records: list[Record], days: list[list[Record]], reference: str = "auto") -> None:
    """Diagnose, say what was found, keep the figures that the tutorials show."""
    diagnosis, findings = diagnose_with_grounds(model, records, days, reference=reference)
    print(name, *(f"{question} {answer}" for question, answer in answers(diagnosis).items()), sep="\n  ")
    for caption, svg in figures(diagnosis, findings):
        kept = {"Loops": "loops", "Residual over frequency": "spectrum", "Ranking": "ranking"}
        for start, suffix in kept.items():
            if caption.startswith(start):
                (IMAGES / f"diagnose_{name}_{suffix}.svg").write_text(svg, encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) > 2:
        write_parts(Path(sys.argv[1]), Path(sys.argv[2]))
    elif len(sys.argv) > 1:
        real(Path(sys.argv[1]))
    else:
        capability()
        practice()
