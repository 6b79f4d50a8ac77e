"""`pamrig run` whose device is lost on the way out: it is tried on, and the last line says what is known."""

import os
import signal
from collections.abc import Callable
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from types import SimpleNamespace

import pytest
from support.run_command import reproach
from support.scripted import program

from hil.bench import SimulatedRig
from rig.app import compose, trying_on
from rig.app.loop_process import loop_process
from rig.app.runs import runner
from rig.app.runs.outcome import RunOutcome
from rig.app.runs.runner import Planned, RunOptions
from rig.app.trying_on import TryingOn
from rig.app.watcher_process import watcher_process
from rig.errors import DeviceError
from rig.realtime.safe_report import Outcome as SafeOutcome
from rig.realtime.safe_report import Writer
from rig.realtime.safe_state import SecondPath
from rig.service.session.process_setups import LoopSetup
from rig.service.session.session import Watching


def loop_whose_device_takes_no_safe_state(setup: LoopSetup, pipe: Connection) -> None:
    def refuse(_: SimulatedRig) -> None:
        raise DeviceError("no answer")

    SimulatedRig.safe = refuse  # type: ignore[method-assign]
    loop_process(setup, pipe)


@pytest.fixture
def lost_on_the_way_out(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A rig whose loop cannot make it safe, and this process only while `back` is so."""
    device = SimpleNamespace(back=False, asked=0, on_asking=lambda _: None)

    def safe() -> None:
        device.asked += 1
        device.on_asking(device.asked)
        if not device.back:
            raise DeviceError("no answer")

    beside = Watching(watcher_process, (), lambda: SecondPath(safe, lambda: device.back))
    monkeypatch.setattr(runner, "loop_process", loop_whose_device_takes_no_safe_state)
    monkeypatch.setattr(compose, "outlives_the_loop", lambda _: True)
    monkeypatch.setattr(runner, "watching", lambda _: beside)
    monkeypatch.setattr("rig.service.session.session.SAFE_STATE_S", 0.3)
    return device


def carried_out(folder: Path) -> RunOutcome:
    plan = replace(program(), run=1)
    return runner.carry_out(compose.load(None), [Planned("a", plan)], RunOptions(folder / "out", virtual=True))


@pytest.mark.usefixtures("lost_on_the_way_out")
def test_a_device_that_is_lost_on_the_way_out_is_told_though_every_record_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The loop ended in good order, nobody brought the valves to their safe set-points, and the command succeeded."""
    monkeypatch.setattr(trying_on, "TRYING_ON_S", 0.3)
    outcome = carried_out(tmp_path)
    assert [(run.valid, run.fault) for run in outcome.runs] == [(True, 0)]
    assert reproach(outcome).startswith(
        "NOT SAFE as far as is known: the commanding process could not bring the device"
    )
    assert reproach(outcome).endswith("; given up after 0 s of trying")


def test_a_device_that_is_back_later_is_made_safe_by_the_command_that_lost_it(
    tmp_path: Path, lost_on_the_way_out: SimpleNamespace, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """It gave up after three seconds, and nobody wrote any more."""
    go_on = TryingOn.go_on

    def back_after_a_while(trying: TryingOn, done: Callable[[], bool], attempt: Callable[[], None]) -> str:
        lost_on_the_way_out.back = True
        return go_on(trying, done, attempt)

    monkeypatch.setattr(TryingOn, "go_on", back_after_a_while)
    outcome = carried_out(tmp_path)
    outcome.judge()
    assert (outcome.end.report.outcome, outcome.end.report.writer) == (SafeOutcome.SEEN, Writer.CONTROL)
    said = capsys.readouterr().err
    assert "NOT SAFE as far as is known: the device does not take the safe state" in said
    assert "safe state written by the commanding process, seen at the device, after 0 s of trying" in said


def test_ctrl_c_ends_the_trying(tmp_path: Path, lost_on_the_way_out: SimpleNamespace) -> None:
    """Not so a terminal that is gone, by the same network perhaps."""
    sent = []

    def asked(count: int) -> None:
        if count > 40:  # after those few seconds that are waited in any case
            sent.append(signal.SIGHUP if count < 50 else signal.SIGINT)
            os.kill(os.getpid(), sent[-1])

    lost_on_the_way_out.on_asking = asked
    said = reproach(carried_out(tmp_path))
    assert signal.SIGINT in sent
    assert "given up by Ctrl-C or a signal after" in said
    assert said.startswith("NOT SAFE as far as is known: the commanding process could not bring the device")
