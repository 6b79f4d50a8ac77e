"""Carrying out runs, seen from inside: permission, refusal, judging the outcome, and the operator's keys."""

import functools
import itertools
import os
import signal
import sys
from dataclasses import replace
from io import StringIO
from multiprocessing.connection import Connection
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console
from support.run_command import reproach
from support.scripted import program

from hil.bench import SimulatedRig
from rig.app import compose, shipped
from rig.app.loop_process import loop_process
from rig.app.runs import record_folders, runner
from rig.app.runs.outcome import RunOutcome
from rig.app.runs.runner import Planned, RunOptions
from rig.app.runs.under_way import RunsUnderWay, ending
from rig.errors import Interrupted, RigError
from rig.realtime.faults import Fault
from rig.realtime.safe_report import Outcome as SafeOutcome
from rig.realtime.safe_report import SafeReport, Writer
from rig.sample import Sample
from rig.service.records.recorder_messages import RunResult
from rig.service.session.process_setups import LoopSetup
from rig.service.session.run_setup import program_of
from rig.service.session.session import Session
from rig.service.session.session_end import SessionEnd

DENIED = {"fifo": "denied: Operation not permitted", "mlock": "granted"}


def good(**more: object) -> RunResult:
    return replace(RunResult(1, Path("a.mcap"), ticks=9, valid=True, complete=True), **more)  # type: ignore[arg-type]


def test_a_good_outcome_is_good() -> None:
    assert RunOutcome([good()], 1).judge() is None


@pytest.mark.parametrize(
    ("outcome", "says"),
    [
        (RunOutcome([good(fault=Fault.FROZEN_SENSOR, valid=False)], 1), "a.mcap: FROZEN_SENSOR: "),
        (RunOutcome([good(missed=3, valid=False)], 1), "a.mcap: not valid: 3 ticks missed, 0 dropped"),
        (RunOutcome([good(valid=False, error="disk full")], 1), "a.mcap: not valid: disk full"),
        (RunOutcome([good()], 2), "1 of 2 runs were recorded"),
        (RunOutcome([], 1, error="the loop's process ended unexpectedly"), "the loop's process ended unexpectedly"),
        (RunOutcome([good(fault=Fault.DEVICE_LOST)], 2, interrupted=True), "a.mcap: DEVICE_LOST: "),
    ],
)
def test_a_bad_outcome_says_why(outcome: RunOutcome, says: str) -> None:
    assert reproach(outcome).startswith(says)


@pytest.mark.parametrize(
    "runs",
    [
        [],
        [good(complete=False)],
        [good(fault=Fault.ESTOP, valid=False)],
        [good(fault=Fault.TERMINATED, valid=False)],
    ],
)
def test_an_interruption_is_130(runs: list[RunResult]) -> None:
    with pytest.raises(Interrupted):
        RunOutcome(runs, 3, interrupted=True).judge()


def test_a_full_disk_names_the_file_once_and_says_what_became_of_the_rig() -> None:
    full = good(valid=False, error="a.mcap.partial: cannot be written: No space left on device")
    safe = SafeReport(Writer.LOOP, outcome=SafeOutcome.SEEN)
    assert reproach(RunOutcome([full], 1, end=SessionEnd(True, safe))) == (
        "not valid: a.mcap.partial: cannot be written: No space left on device; safe state written by the loop, seen "
        "at the device"
    )


def test_an_interruption_says_what_became_of_a_rig_that_was_under_way() -> None:
    safe = SafeReport(Writer.LOOP, outcome=SafeOutcome.SEEN)
    with pytest.raises(Interrupted, match=r"^interrupted; safe state written by the loop, seen at the device$"):
        RunOutcome([good(complete=False)], 3, interrupted=True, end=SessionEnd(True, safe)).judge()


@pytest.mark.parametrize("interrupted", [False, True])
@pytest.mark.parametrize(
    ("safe", "says"),
    [
        (SafeReport(Writer.SUPERVISOR, outcome=SafeOutcome.FAILED), "NOT SAFE as far as is known: the supervisor"),
        (SafeReport(), "nobody has reported the safe state yet; old set-points may stand"),
    ],
)
def test_a_rig_that_is_not_known_to_be_safe_is_no_success(interrupted: bool, safe: SafeReport, says: str) -> None:
    outcome = RunOutcome([good()], 1, interrupted=interrupted, end=SessionEnd(True, safe))
    assert reproach(outcome).startswith(says)
    assert outcome.stopped


def test_the_simulated_rig_runs_without_permission_and_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    runner.check_realtime(compose.load(None), DENIED, force=False)
    assert "real-time measures not granted (fifo denied: Operation not permitted)" in capsys.readouterr().err


def test_a_real_rig_is_refused_without_permission_unless_forced() -> None:
    simulated = compose.load(None)
    real = replace(simulated, devices=tuple(replace(entry, kind="itv_serial") for entry in simulated.devices))
    with pytest.raises(RigError, match=r"fifo denied: Operation not permitted.*give --force"):
        runner.check_realtime(real, DENIED, force=False)
    runner.check_realtime(real, DENIED, force=True)
    runner.check_realtime(real, {"fifo": "granted", "mlock": "granted", "affinity": "denied: x"}, force=False)


def test_a_refusal_ends_the_loop_through_its_safe_state_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sessions: list[Session] = []
    made = Session.__init__

    def remember(self: Session, *args: object, **kwargs: object) -> None:
        made(self, *args, **kwargs)  # type: ignore[arg-type]
        sessions.append(self)

    def refuse(*_: object) -> None:
        raise RigError("refused")

    monkeypatch.setattr(Session, "__init__", remember)
    monkeypatch.setattr(runner, "check_realtime", refuse)
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(RigError, match="refused"):
        runner.carry_out(compose.load(None), [Planned("a", program())], RunOptions(tmp_path / "out", virtual=True))
    (session,) = sessions
    assert session.loop is not None
    assert session.loop.exitcode == 0, "it left by itself and was not killed"
    assert not session.ring.block.path.exists()
    assert not list((tmp_path / "out").iterdir())
    assert signal.getsignal(signal.SIGINT) is before


class EndsLate:
    """Sends its process the signal to end when the interpreter is ending already, and hears no signals any more."""

    def __init__(self) -> None:
        self._send = functools.partial(os.kill, os.getpid(), signal.SIGTERM)

    def __del__(self) -> None:
        self._send()


def loop_that_is_told_to_end_twice(setup: LoopSetup, pipe: Connection) -> None:
    loop_process(setup, pipe)
    sys.modules["kept until the end"] = EndsLate()  # type: ignore[assignment]


def test_a_loop_that_has_left_is_not_killed_by_the_signal_that_comes_after_the_word() -> None:
    """As happens on a busy machine, where time passes between the two."""
    session = Session(loop_that_is_told_to_end_twice, compose.load(None), virtual=True)
    session.open()
    assert session.loop is not None
    session.close()
    assert session.loop.exitcode == 0


def loop_that_is_told_to_end_with_all_others(setup: LoopSetup, pipe: Connection) -> None:
    os.kill(os.getppid(), signal.SIGTERM)
    signal.raise_signal(signal.SIGTERM)


@pytest.mark.parametrize("seen_first", ["the operator's wish", "the loop's end"])
def test_a_signal_to_all_processes_while_the_rig_is_opened_is_an_interruption(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seen_first: str
) -> None:
    """The device was told to be looked at, with exit status 2. Whether the operator's wish or the loop's end is seen
    first is chance, and makes no difference."""
    monkeypatch.setattr(runner, "loop_process", loop_that_is_told_to_end_with_all_others)
    if seen_first == "the loop's end":
        monkeypatch.setattr("rig.app.runs.operator.Operator.check", lambda _: None)
    outcome = runner.carry_out(
        compose.load(None), [Planned("a", program())], RunOptions(tmp_path / "out", virtual=True)
    )
    with pytest.raises(Interrupted, match="the loop never ticked, and nothing was written to the rig"):
        outcome.judge()


def loop_whose_driver_has_a_bug(setup: LoopSetup, pipe: Connection) -> None:
    def fail(_: SimulatedRig) -> None:
        raise ZeroDivisionError("division by zero")

    SimulatedRig.open = fail  # type: ignore[method-assign, assignment]
    loop_process(setup, pipe)


def test_a_driver_that_fails_by_a_bug_when_it_is_opened_is_one_line(capfd: pytest.CaptureFixture[str]) -> None:
    session = Session(loop_whose_driver_has_a_bug, compose.load(None), virtual=True)
    try:
        with pytest.raises(RigError, match="not ready by an error of the program: ZeroDivisionError: division by zero"):
            session.open()
    finally:
        session.close()
    assert "Traceback" not in capfd.readouterr().err


def test_a_fault_outside_a_record_is_told(tmp_path: Path) -> None:
    rig = compose.load(None)
    impossible = replace(rig, limits=replace(rig.limits, monitor_mpa=(0.4, 0.6)))  # at rest the monitors read 0.2 MPa
    outcome = runner.carry_out(impossible, [Planned("a", program())], RunOptions(tmp_path / "out", virtual=True))
    assert reproach(outcome).startswith("BAD_VALUE: a sensor kept giving values")


def test_a_device_s_own_words_are_told_with_its_fault_outside_a_record() -> None:
    sample = Sample(**dict.fromkeys(Sample._fields, 0))  # type: ignore[arg-type]
    words = "valve_1 on /dev/ttyUSB0: no usable answer in time"

    def told(fault: Fault, interrupted: bool = False) -> str:
        ring = SimpleNamespace(latest=lambda: sample._replace(fault=fault), device_message=words)
        session = SimpleNamespace(loop_error=lambda: "", loop=None, ring=ring)
        return ending(session, interrupted)  # type: ignore[arg-type]

    assert told(Fault.TERMINATED, interrupted=True) == "", "by the signal that interrupted the command"
    assert told(Fault.TERMINATED).startswith("TERMINATED: ")
    assert told(Fault.DEVICE_LOST).startswith("DEVICE_LOST: ")
    assert told(Fault.DEVICE_LOST).endswith(f"; {words}")
    assert words not in told(Fault.BAD_VALUE)


def test_a_fact_that_warns_is_coloured_and_one_that_speaks_of_warnings_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Console(file=StringIO(), force_terminal=True, width=200, highlight=False)
    monkeypatch.setattr(runner, "console", lambda _: screen)
    runner.announce(
        {"1.failsafe": "none: the manual has a warning [page 7]", "2.warning": "holds its outputs", "2.mode": "x"}
    )
    plain, coloured = screen.file.getvalue().splitlines()  # type: ignore[attr-defined]
    assert plain == "1.failsafe: none: the manual has a warning [page 7]"
    assert coloured == "\x1b[33m2.warning: holds its outputs\x1b[0m"


def test_planned_set_points_are_the_paper_s() -> None:
    from rig.excite.run_plan import expand
    from rig.excite.sweep import load_sweep

    plan = expand(load_sweep(shipped.configs() / "sweeps" / "quick.yaml"), 5_000_000)[0]
    made = program_of(plan, 4)
    assert made.run == 4
    assert [p1 - p2 for p1, p2 in zip(made.p1_cmd_mpa, made.p2_cmd_mpa, strict=True)] == pytest.approx(
        list(plan.dp_mpa)
    )
    assert [p1 + p2 for p1, p2 in zip(made.p1_cmd_mpa, made.p2_cmd_mpa, strict=True)] == pytest.approx(
        [0.4] * len(plan.dp_mpa)
    )


def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(RigError, match="the folder cannot be written to; choose another with --out"):
        record_folders.prepare_folder(tmp_path, ["a.mcap"])


def test_two_sessions_in_one_second_get_two_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    first = record_folders.new_folder("quick")
    first.mkdir(parents=True)
    second = record_folders.new_folder("quick")
    assert first != second
    assert not second.exists()


def test_a_name_cannot_lead_out_of_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert record_folders.new_folder("../../etc/x y").parent == Path("logs")


def test_a_recorder_that_dies_before_the_first_record_is_no_quiet_success(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A broken pipe to it once passed for a reader of stdout who had seen enough: no line, exit status 0."""
    sessions: list[Session] = []
    made = Session.__init__

    def remember(self: Session, *args: object, **kwargs: object) -> None:
        made(self, *args, **kwargs)  # type: ignore[arg-type]
        sessions.append(self)

    def strike(*_: object) -> None:
        recorder = sessions[0].recorder
        assert recorder is not None
        recorder.kill()
        recorder.join()

    monkeypatch.setattr(Session, "__init__", remember)
    monkeypatch.setattr(runner, "announce", strike)
    outcome = runner.carry_out(
        compose.load(None), [Planned("a", program())], RunOptions(tmp_path / "out", virtual=True)
    )
    assert "RECORDER_DIED" in reproach(outcome)


def test_a_recorder_that_died_while_nobody_could_look_is_told_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """This process was stopped meanwhile: when it goes on, loop and recorder have both ended."""

    def stopped(under_way: RunsUnderWay, *_: object) -> None:
        session = under_way.session
        session.go()
        assert session.recorder is not None
        assert session.loop is not None
        session.recorder.kill()
        session.recorder.join()
        session.loop.terminate()
        session.loop.join()

    monkeypatch.setattr(RunsUnderWay, "watch", stopped)
    outcome = runner.carry_out(
        compose.load(None), [Planned("a", program())], RunOptions(tmp_path / "out", virtual=True)
    )
    assert "RECORDER_DIED" in reproach(outcome)


def test_the_fault_of_a_record_whose_recorder_is_lost_before_it_tells_of_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A device that is lost, and a recorder that is killed just after: the last line was about an unfinished file, and
    said neither why nor what became of the rig."""
    close = Session.close

    def stopped(under_way: RunsUnderWay, *_: object) -> None:
        session = under_way.session
        assert session.recorder is not None
        assert session.recorder.pid is not None
        assert session.loop is not None
        os.kill(session.recorder.pid, signal.SIGSTOP)
        session.go()
        session.loop.join()

    def killed(session: Session, *arguments: object) -> list[RunResult]:
        assert session.recorder is not None
        session.recorder.kill()
        session.recorder.join()
        return close(session, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(RunsUnderWay, "watch", stopped)
    monkeypatch.setattr(Session, "close", killed)
    rig = compose.load(None)
    outside = replace(rig, limits=replace(rig.limits, angle_deg=(80.0, 90.0)))
    outcome = runner.carry_out(outside, [Planned("a", program())], RunOptions(tmp_path / "out", virtual=True))
    said = reproach(outcome)
    assert said.startswith("ANGLE_LIMIT: ")
    assert said.endswith(outcome.end.words)


def loop_whose_device_does_not_answer(_: LoopSetup, pipe: Connection) -> None:
    pipe.poll(None)  # until whoever waits for it is gone


def test_ctrl_c_while_a_device_does_not_answer_is_not_waited_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was heard when the device had answered or not: up to half a minute, without a word."""
    monkeypatch.setattr(runner, "loop_process", loop_whose_device_does_not_answer)
    looks = itertools.count()

    def beat(session: Session) -> None:
        if (look := next(looks)) == 1:
            os.kill(os.getpid(), signal.SIGINT)
        assert look < 20, "it waits on"

    monkeypatch.setattr(Session, "beat", beat)
    outcome = runner.carry_out(compose.load(None), [Planned("a", program())], RunOptions(tmp_path / "out"))
    assert (outcome.interrupted, outcome.to_json()["runs"]) == (True, [])
    with pytest.raises(Interrupted, match=r"^interrupted; the loop never ticked, and nothing was written to the rig$"):
        outcome.judge()
