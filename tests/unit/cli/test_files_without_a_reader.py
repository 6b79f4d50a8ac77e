"""A reader who closes the pipe (`| head`) ends the text of a command: its files stand, and its status is its own."""

import json
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from support.click_tree import parameters
from support.plants.gap_rigs import MODEL, session
from support.records.made_logs import made_log
from support.rigs.narrow_rig import narrow_rig, rig_of_few_effects
from support.run_command import SWEEP
from support.warm import Warm

from rig.cli.commands import cli
from rig.cli.outputs import Output
from rig.log.convert import write_record
from rig.model.parameters import AddedEffect

REFERENCE = f"""\
{SWEEP.partition("records:")[0]}closed_loop: {{kp_mpa_per_deg: 0.002, ki_mpa_per_deg_s: 0.04}}
records:
  - sine: {{frequency_hz: 0.5, amplitude_deg: 20}}
"""
POINTS = "monitor_1: {raw_unit: V, points: [[1.0, 0.0], [3.0, 0.251], [5.0, 0.5]]}\n"
CALLS = {
    "run": "SWEEP --clock virtual -o out/run --json out/x.json",
    "simulate": "SWEEP --model MODEL -o out/x.mcap --figure out/x.svg --json out/x.json",
    "identify": "LOG -o out/x.yaml --figures out/figures --json out/x.json --seeds 1 --particles 4 --iterations 3 "
    "--no-polish --unbounded",
    "validate": "MODEL LOG --figures out/figures --json out/x.json",
    "replay": "RUN -o out/x.mcap --figure out/x.svg --json out/x.json",
    "track": "REFERENCE --clock virtual -o out/track --figure out/x.svg --json out/x.json",
    "tune": "--model MODEL --tracking REFERENCE -o out/x.yaml --json out/x.json",
    "gap capability": "--model MODEL --rig FEW --sweep quick --figure out/x.svg --json out/x.json",
    "gap design": "--model MODEL --rig NARROW --minutes 0.5 --family none -o out/x.yaml --json out/x.json",
    "gap diagnose": "--model MODEL --rig FEW --log DAYS/late --baseline DAYS/healthy --html out/x.html "
    "--augmented-model out/a.yaml --retuned out/r.yaml --json out/x.json",
    "gap effects": "--json out/x.json",
    "gap history": "DAYS --model MODEL --workers 1 --figure out/x.svg --json out/x.json",
    "log check": "LOG --json out/x.json",
    "log compare": "LOG LOG --figure out/x.svg --json out/x.json",
    "log export": "LOG -o out/x.csv --json out/x.json",
    "log import": "TABLE -o out/x.mcap --json out/x.json",
    "log info": "LOG --json out/x.json",
    "log plot": "LOG -o out/x.svg",
    "log recover": "CUT -o out/x.mcap --json out/x.json",
    "rig check": "RIG --json out/x.json",
    "rig new": "--yes -o out/x.yaml --json out/x.json",
    "devices calibrate": "--points POINTS -o out/x.yaml --json out/x.json",
    "devices list": "--json out/x.json",
    "devices probe": "--ticks 20 --json out/x.json",
    "faults": "--dry-run --json out/x.json",
}
"""What each command that writes files is called with here, each word in capitals standing for a file of `lab`."""
LONG = {
    "gap calibrate", "gap check", "gap study absorbed", "gap check compare", "gap study intervals", "gap check merge",
    "gap study odds", "gap study temperature", "gap check score", "gap study sensitivity", "gap study sizes",
    "gap study laws", "gap study usual", "gap study noise", "gap hunt", "bench", "latency",
}  # fmt: skip
"""Commands that take minutes or the machine for themselves, or what those leave behind."""
DAEMON = {"status", "queue"}
"""Commands that ask a daemon."""


@pytest.fixture(scope="module")
def lab(warm: Warm, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The files that the calls read, by their words."""
    root = tmp_path_factory.mktemp("lab")
    texts = {"SWEEP": SWEEP, "REFERENCE": REFERENCE, "POINTS": POINTS, "FEW": rig_of_few_effects()}
    for name, text in texts.items():
        (root / f"{name.lower()}.yaml").write_text(text)
    (root / "table.csv").write_text("t_s,dp_cmd_mpa,angle_deg\n0,0,0\n0.005,0.1,1\n0.01,0.1,2\n")
    made_log(root / "log.mcap", 800)
    (root / "cut.mcap").write_bytes((root / "log.mcap").read_bytes()[:-4000])
    for day, effects in {"healthy": [], "late": [AddedEffect("delay", {"delay_s": 0.04})]}.items():
        (root / "days" / day).mkdir(parents=True)
        for record in session(1 + len(effects), *effects):
            write_record(replace(record, facts={"p0_mpa": 0.2}), root / "days" / day / f"{record.name}.mcap", {})
    assert warm.run(shlex.split("pamrig run sweep.yaml --clock virtual -o run"), root)[0] == 0
    places = {name: f"{root / name.lower()}.yaml" for name in texts}
    files = {"LOG": "log.mcap", "CUT": "cut.mcap", "TABLE": "table.csv", "DAYS": "days"}
    (recorded,) = (root / "run").glob("*.mcap")
    places |= {name: f"{root / file}" for name, file in files.items()}
    places |= {"MODEL": f"{MODEL}", "RIG": f"{MODEL.parents[1]}/rigs/simulated.yaml"}
    return places | {"NARROW": f"{narrow_rig(root)}", "RUN": f"{recorded}"}


def words_of(name: str, lab: dict[str, str], out: Path) -> list[str]:
    """The call of that command, with its files in their places."""
    words = shlex.split(f"{name} {CALLS[name]}")
    placed = [
        word.replace(word.partition("/")[0], lab.get(word.partition("/")[0], word.partition("/")[0]), 1)
        for word in words
    ]
    return [word.replace("out/", f"{out}/", 1) if word.startswith("out/") else word for word in placed]


def test_every_command_that_writes_files_is_called_here() -> None:
    writing = {name for name, param in parameters(cli) if isinstance(param.type, Output)}
    assert writing == CALLS.keys() | LONG | DAEMON


@pytest.mark.parametrize("name", list(CALLS))
def test_its_files_stand_although_nobody_reads_its_text(
    name: str, lab: dict[str, str], tmp_path: Path, warm: Warm
) -> None:
    words = words_of(name, lab, tmp_path)
    status, said = warm.run(["pamrig", *words], tmp_path, reader=False)
    assert "Traceback" not in said
    assert status == 0, said
    for word in words:
        if word.startswith(f"{tmp_path}/"):
            assert Path(word).exists(), said
            assert not word.endswith(".json") or json.loads(Path(word).read_text())


def test_a_check_that_failed_says_so_although_nobody_reads_its_findings(lab: dict[str, str]) -> None:
    words = [sys.executable, "-m", "rig.cli.main", "log", "check", lab["CUT"]]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as call:
        assert call.stdout is not None
        call.stdout.close()
    assert call.returncode == 1


def test_where_there_is_no_room_for_the_text_the_files_stand(lab: dict[str, str], tmp_path: Path) -> None:
    words = [sys.executable, "-m", "rig.cli.main", "log", "info", lab["LOG"], "--json", f"{tmp_path / 'x.json'}"]
    with open("/dev/full", "w") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "pamrig: the system: No space left on device\n")
    assert json.loads((tmp_path / "x.json").read_text())["files"]
