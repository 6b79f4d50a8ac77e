"""A hunt by a daemon that is cut short while the daemon records: the daemon goes on, and the same call takes what it
made."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.plants.begun_hunts import hunt_options

from rig.app.gap.hunt.folder import FILE
from rig.app.gap.hunt.hunting import Hunted, HuntFinding, hunt
from rig.app.gap.hunt.options import HuntOptions
from rig.app.gap.hunt.report import hunt_and_tell
from rig.errors import CheckFailed, Interrupted, StateError

pytestmark = pytest.mark.usefixtures("each_diagnosed_once")


class Killed(BaseException):
    """The process is gone: nothing of it catches this."""


class Daemon:
    """One that records a sweep when it is waited for, or when `go_on` says that its time has come."""

    def __init__(self, record: Path) -> None:
        self._record = record
        self.queue: list[dict[str, Any]] = []
        self.struck: BaseException | None = None
        """What strikes the hunt while it waits."""

    @property
    def working(self) -> bool:
        return any(job["state"] == "running" for job in self.queue)

    def status(self) -> dict[str, Any]:
        return {"working": self.working, "queue": self.queue, "interrupted": [], "fault": None}

    def start(self, sweep: Path, before: str = "") -> list[dict[str, Any]]:
        job = {"id": len(self.queue) + 1, "sweep": str(Path(sweep).absolute()), "name": Path(sweep).stem, "error": ""}
        self.queue.append(job | {"state": "running", "not_valid": 0, "files": []})
        return [job]

    def go_on(self) -> None:
        self.queue[-1].update(state="done", files=[str(self._record)])

    def wait(self) -> dict[str, Any]:
        if self.struck is not None:
            raise self.struck
        self.go_on()
        return self.status()


@pytest.fixture
def record(begun_hunt: Path) -> Path:
    """What the daemon records of the first session."""
    (made,) = (begun_hunt / "step_1_records").glob("*.mcap")
    return made


@pytest.fixture
def daemon(record: Path) -> Daemon:
    return Daemon(record)


@pytest.fixture
def options(daemon: Daemon, tmp_path: Path) -> HuntOptions:
    return hunt_options(tmp_path / "hunt", virtual=False, seed=None, daemon=daemon)


def first_only(options: HuntOptions) -> Hunted:
    """The hunt up to its second sweep; nobody is asked about the first, which the daemon was told to make before."""
    return hunt(options, allowed=lambda step: False)


def killed(options: HuntOptions, daemon: Daemon) -> None:
    """The hunt gone while the daemon records its first sweep."""
    daemon.struck = Killed()
    with pytest.raises(Killed):
        hunt(options)
    daemon.struck = None


@pytest.mark.parametrize("meanwhile", [lambda daemon: None, Daemon.go_on], ids=["records still", "is done"])
def test_killed_while_the_daemon_records_the_same_call_takes_its_records(
    options: HuntOptions, daemon: Daemon, record: Path, meanwhile: Callable[[Daemon], None]
) -> None:
    killed(options, daemon)
    meanwhile(daemon)
    found = first_only(options)
    assert len(daemon.queue) == 1, "it was made once"
    step = found.hunt.steps[0]
    assert (options.folder / step.records / record.name).read_bytes() == record.read_bytes()
    assert {name for name, _ in step.set} >= {"delay", "valve_lag"}


def test_killed_while_it_copies_the_record_is_taken_again_and_none_is_half(
    options: HuntOptions, daemon: Daemon, record: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def half(source: Path, target: Path) -> None:
        target.write_bytes(source.read_bytes()[:1000])
        raise Killed

    with monkeypatch.context() as patch:
        patch.setattr(shutil, "copy2", half)
        with pytest.raises(Killed):
            hunt(options)
    found = first_only(options)
    assert len(daemon.queue) == 1
    assert {file.read_bytes() for file in options.folder.rglob("*.mcap")} == {record.read_bytes()}
    assert found.hunt.steps[0].done


def test_what_the_daemon_could_not_make_whole_is_asked_about_and_made_again(
    options: HuntOptions, daemon: Daemon
) -> None:
    killed(options, daemon)
    daemon.queue[-1].update(state="stopped", error="the operator")
    assert first_only(options).hunt.ended == "not confirmed"
    hunt(options, allowed=lambda step: step.sweep == "step_1.yaml")
    assert [job["state"] for job in daemon.queue] == ["stopped", "done"]


def test_a_job_of_an_earlier_hunt_in_a_folder_of_that_name_is_not_taken(options: HuntOptions, daemon: Daemon) -> None:
    killed(options, daemon)
    daemon.go_on()
    shutil.rmtree(options.folder)
    assert first_only(options).hunt.ended == "not confirmed"


def test_a_job_that_somebody_took_out_of_the_queue_is_one_line(options: HuntOptions, daemon: Daemon) -> None:
    daemon.go_on = daemon.queue.clear  # type: ignore[method-assign]
    with pytest.raises(CheckFailed, match=r"step_1\.yaml: .*queue"):
        hunt(options)


def test_while_the_daemon_does_something_else_a_hunt_refuses_still(options: HuntOptions, daemon: Daemon) -> None:
    killed(options, daemon)
    daemon.go_on()
    daemon.queue[-1]["not_valid"] = 1
    daemon.start(Path("another.yaml"))
    with pytest.raises(StateError, match="works on its queue"):
        hunt(options)


def test_ctrl_c_leaves_the_sweep_to_the_daemon_and_says_so(options: HuntOptions, daemon: Daemon) -> None:
    daemon.struck = KeyboardInterrupt()
    told: list[Hunted] = []
    with pytest.raises(Interrupted, match="the daemon has step_1"):
        hunt_and_tell(options, lambda step: True, lambda step: None, told.append)
    assert daemon.working
    assert told[0].ended.startswith("cut short: interrupted")


def test_ctrl_c_while_it_thinks_says_what_was_learnt(
    options: HuntOptions, daemon: Daemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> HuntFinding:
        raise KeyboardInterrupt

    told: list[Hunted] = []
    monkeypatch.setattr("rig.app.gap.hunt.hunting.what_next", interrupted)
    with pytest.raises(KeyboardInterrupt):
        hunt_and_tell(options, lambda step: True, lambda step: None, told.append)
    assert {name for name, _ in told[0].hunt.steps[0].set} >= {"delay", "valve_lag"}
    assert told[0].ended == "cut short: interrupted"
    assert "valve_lag" in (options.folder / "hunt.html").read_text()
    assert json.loads((options.folder / FILE).read_text())["steps"][0]["records"]
