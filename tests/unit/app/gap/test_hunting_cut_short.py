"""Hunts that something cuts short: killed at any moment, no room on the disk, limits, a busy daemon, records that were
damaged. Nothing is lost, what was learnt so far is said, and the hunt goes on to the same end."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from support.plants.begun_hunts import MODEL
from support.plants.begun_hunts import hunt_options as options

from rig.app.gap.hunt.folder import FILE, alone_in, open_hunt
from rig.app.gap.hunt.hunting import NAMED, TIME, Hunted, hunt
from rig.app.gap.hunt.options import HuntOptions
from rig.app.gap.hunt.report import hunt_and_tell
from rig.cli.commands import cli
from rig.errors import EnvelopeError, RigError, StateError
from rig.log.reader import read

pytestmark = pytest.mark.usefixtures("each_diagnosed_once")

CALL = ("--rig", "simulated_worn", "--model", str(MODEL), "--sweep", "quick", "--clock", "virtual", "--seed", "5")
PATIENCE_S = 300.0


def tell(asked: HuntOptions) -> tuple[list[Hunted], RigError]:
    """What a hunt that is cut short says, and what it ends by."""
    told: list[Hunted] = []
    with pytest.raises(RigError) as error:
        hunt_and_tell(asked, lambda step: True, lambda step: None, told.append)
    return told, error.value


def start(folder: Path) -> "subprocess.Popen[str]":
    command = [sys.executable, "-m", "rig.cli.main", "gap", "hunt", *CALL, "-o", str(folder), "--json", "-"]
    return subprocess.Popen(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)


def killed_when(folder: Path, moment: str, random_s: float) -> None:
    """The hunt killed with everything that it started, some time after a file of that name appears."""
    process, until = start(folder), time.monotonic() + PATIENCE_S
    while not any(folder.glob(moment)) and process.poll() is None:
        assert time.monotonic() < until, f"{moment} never came"
        time.sleep(0.01)
    time.sleep(random_s)
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


def test_killed_at_any_moment_it_goes_on_to_the_same_end(begun_hunt: Path, tmp_path: Path) -> None:
    chance, folder = random.Random(8), tmp_path / "killed"
    for moment in ("step_1_records/*.mcap*", "step_2.yaml"):
        killed_when(folder, moment, chance.uniform(0.0, 0.3))
    process = start(folder)
    out, error = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, error
    told = json.loads(out)
    first = json.loads((begun_hunt / FILE).read_text())["steps"][0]
    assert told["steps"][0]["set"] == first["set"], "as the hunt that nobody killed"
    assert told["ended"] == NAMED
    assert [name for name, _ in told["steps"][-1]["set"]] == ["valve_lag"]
    kept = open_hunt(folder, {})
    assert all(read(folder / step.records) for step in kept.steps)


def test_of_two_hunts_in_one_folder_the_second_is_refused(left_hunt: Path) -> None:
    """Each wrote its own notes over the other's, whose records nobody knew then."""
    before = (left_hunt / FILE).read_bytes()
    with alone_in(left_hunt):
        told, error = tell(options(left_hunt))
    assert isinstance(error, StateError)
    assert str(error) == f"{left_hunt}: another hunt is at work there; wait for its end, or name another folder"
    assert told == []
    assert (left_hunt / FILE).read_bytes() == before
    hunt_and_tell(options(left_hunt), lambda _: False, lambda _: None, told.append)
    assert len(told) == 1


def test_a_first_session_outside_the_limits_leaves_nothing_behind(tmp_path: Path) -> None:
    asked = options(tmp_path / "narrow")
    told, error = tell(replace(asked, rig=limited(asked)))
    assert isinstance(error, EnvelopeError)
    assert not (tmp_path / "narrow").exists()
    assert told == []


def limited(asked: HuntOptions) -> Any:
    return replace(asked.rig, limits=replace(asked.rig.limits, pressure_mpa=(0.19, 0.21)))


def test_a_folder_that_is_moved_meanwhile_is_not_made_anew_and_nothing_moves(left_hunt: Path) -> None:
    """The next sweep was recorded into another one of that name, and ended in a diagnosis without the first."""
    elsewhere = left_hunt.with_name("elsewhere")

    def moving(_: object) -> bool:
        left_hunt.rename(elsewhere)
        return True

    told: list[Hunted] = []
    with pytest.raises(RigError, match="moved or removed while the hunt was at work"):
        hunt_and_tell(options(left_hunt), moving, lambda step: None, told.append)
    assert not left_hunt.exists()
    assert len(told) == 1, "what is known is told"
    assert [step.done for step in open_hunt(elsewhere, options(elsewhere).asked).steps] == [True, False]


def test_a_planned_sweep_that_the_limits_no_longer_allow_is_refused_and_the_rest_said(left_hunt: Path) -> None:
    asked = options(left_hunt)
    told, error = tell(replace(asked, rig=limited(asked)))
    assert isinstance(error, EnvelopeError)
    assert "\n" not in str(error)
    (cut,) = told
    assert cut.cut_short_by == str(error)
    assert {name for name, _ in cut.hunt.steps[0].set} >= {"delay", "valve_lag"}
    assert "valve_lag" in (left_hunt / "hunt.html").read_text()
    assert open_hunt(left_hunt, {}).ended == "not confirmed", "it can go on"


class Busy:
    """A daemon that works on its queue."""

    def status(self) -> dict[str, Any]:
        return {"working": True}


def test_a_busy_daemon_is_waited_for_by_the_operator(left_hunt: Path) -> None:
    told, error = tell(options(left_hunt, daemon=Busy()))
    assert isinstance(error, StateError)
    assert "queue" in str(error)
    assert len(told[0].hunt.steps[0].set) >= 2
    assert not list(left_hunt.glob("step_2_records*"))


def test_a_record_that_was_damaged_since_is_said_with_its_name(left_hunt: Path) -> None:
    (record,) = (left_hunt / "step_1_records").glob("*.mcap")
    record.write_bytes(b"")
    _, error = tell(options(left_hunt))
    assert record.name in str(error)
    assert "\n" not in str(error)
    assert not list(left_hunt.glob("step_2_records*")), "nothing moves for a hunt that cannot go on"


def test_gone_on_with_less_time_than_the_planned_sweep_takes_it_runs_nothing(left_hunt: Path) -> None:
    found = hunt(options(left_hunt, minutes=0.2), allowed=lambda step: pytest.fail("something would have moved"))
    assert found.hunt.ended == TIME
    assert not list(left_hunt.glob("step_2_records*"))


def test_gone_on_with_and_not_confirmed_the_page_still_says_what_is_known(left_hunt: Path) -> None:
    heard: list[str] = []
    hunt_and_tell(options(left_hunt), lambda step: False, lambda step: heard.append(step.sweep), lambda found: None)
    assert heard == ["step_1.yaml"], "what is still possible is said before anybody is asked"
    page = (left_hunt / "hunt.html").read_text()
    assert 'href="report.html"' in page
    assert "he regulators answer 10 ms later" in page


def test_nobody_to_answer_is_an_interruption_that_says_what_was_learnt(left_hunt: Path) -> None:
    call = ["gap", "hunt", *CALL, "--confirm", "-o", f"{left_hunt}", "--json", f"{left_hunt / 'told.json'}"]
    said = CliRunner().invoke(cli, call, input="").output
    assert "ended: cut short; " in said
    assert "cut short: " not in said, "the error below says why"
    told = json.loads((left_hunt / "told.json").read_text())
    assert told["ended"] == "cut short: interrupted"
    assert told["diagnosis"] is not None


def test_a_disk_without_room_loses_nothing(begun_hunt: Path, tmp_path: Path) -> None:
    """The second sweep is to be recorded on a file system with no room left."""
    inside = tmp_path / "small"
    inside.mkdir()
    script = (
        f"mount -t tmpfs -o size=2m none {inside} && cp -r {begun_hunt} {inside}/hunt && "
        f"(dd if=/dev/zero of={inside}/full bs=4k 2>/dev/null; true) && "
        f"{{ {sys.executable} -m rig.cli.main gap hunt {' '.join(CALL)} -o {inside}/hunt --json -; "
        f"echo STATUS $?; cat {inside}/hunt/{FILE} >&2; }}"
    )
    done = subprocess.run(["unshare", "-rm", "sh", "-c", script], capture_output=True, text=True, check=False)
    if "STATUS" not in done.stdout:
        pytest.skip(f"no small file system can be had here: {done.stderr.strip()[:200]}")
    assert "STATUS 1" in done.stdout or "STATUS 2" in done.stdout
    assert "Traceback" not in done.stderr
    kept = json.loads(done.stderr[done.stderr.index("{") :])
    assert {name for name, _ in kept["steps"][0]["set"]} >= {"delay", "valve_lag"}


def test_a_rig_that_does_not_open_leaves_no_empty_folders_however_often_it_is_asked(tmp_path: Path) -> None:
    """An earlier try that was killed leaves one as well."""
    folder = tmp_path / "hunt"
    asked = options(folder)
    (main,) = asked.rig.devices
    main = replace(main, settings={**main.settings, "model": "none.yaml"})
    (folder / "step_1_records").mkdir(parents=True)
    for _ in range(2):
        with pytest.raises(RigError):
            hunt(replace(asked, rig=replace(asked.rig, devices=(main,))))
        assert not list(folder.glob("step_1_records*"))
