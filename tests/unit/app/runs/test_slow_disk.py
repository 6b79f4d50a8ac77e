"""A disk that stands still while a session ends: real processes, of which the recorder's disk waits for the test."""

import logging
import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from support.records.mcap_files import contents
from support.run_command import until
from support.scripted import program

from rig.app import compose
from rig.app.loop_process import loop_process
from rig.app.runs import runner, under_way
from rig.app.runs.outcome import RunOutcome
from rig.app.runs.runner import Planned, RunOptions
from rig.app.supervise import parts_of
from rig.errors import CheckFailed
from rig.service.processes import DISK_PATIENCE_S
from rig.service.records.recorder_messages import RunOrder, RunResult
from rig.service.session.session import Session
from rig.service.session.session_monitor import SessionMonitor

DISK = """
import os, time
sync = os.fsync
def fsync(descriptor):
    while os.path.exists({stands!r}):
        time.sleep(0.01)
    sync(descriptor)
os.fsync = fsync
"""
"""What every process that is started now begins with: no sync ends while the file is there."""


class Clock:
    """This process's monotonic clock, which may be let run a second at each look."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._real, self._ahead_s, self._runs = time.monotonic, 0.0, False
        self._at: tuple[float, Callable[[], None]] | None = None
        monkeypatch.setattr(time, "monotonic", self)
        monkeypatch.setattr(time, "monotonic_ns", lambda: round(self() * 1e9))

    def jump(self, seconds: float) -> None:
        """As it does for one who stood still meanwhile."""
        self._ahead_s += seconds

    def run(self, at_s: float = float("inf"), do: Callable[[], None] = lambda: None) -> None:
        """From now on; stand after `at_s`, and `do` that."""
        self._runs, self._at = True, (at_s, do)

    def __call__(self) -> float:
        if self._runs and self._at is not None:
            self._ahead_s += 1.0
            if self._ahead_s > self._at[0]:
                self._runs = False
                self._at[1]()
        return self._real() + self._ahead_s


@pytest.fixture
def stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    gate = tmp_path / "the disk stands still"
    (tmp_path / "python").mkdir()
    (tmp_path / "python" / "sitecustomize.py").write_text(DISK.format(stands=str(gate)))
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path / 'python'}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    gate.touch()
    return gate


def await_file(path: Path) -> None:
    """Until the recorder has begun one: a machine that is busy takes longer than a clock that is let run."""
    until(path.with_name(f"{path.name}.partial").exists)


def run_to_its_end(path: Path) -> Session:
    """A session whose loop has ended, and whose recorder has begun a file and written nothing yet."""
    session, made = Session(loop_process, compose.load(None), virtual=True), program()
    session.open([made], scripted=True)
    facts = {"period_ns": 5_000_000, "clock": "virtual"}
    session.recording.expect(RunOrder(made.run, path, facts, {}, len(made.p1_cmd_mpa), session.facts["wall_offset_ns"]))
    session.go()
    assert session.loop is not None
    session.loop.join()
    await_file(path)
    return session


def closed(session: Session) -> RunResult:
    (result,) = session.close()
    assert session.recorder is not None
    assert not session.recorder.is_alive()
    return result


def test_a_recorder_whose_disk_stands_still_for_a_while_is_waited_for(
    stands: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    session, clock = run_to_its_end(tmp_path / "a.mcap"), Clock(monkeypatch)
    clock.run(DISK_PATIENCE_S / 2, stands.unlink)
    result = closed(session)
    assert (result.error, result.valid, session.recording.given_up) == ("", True, "")
    assert len(contents(tmp_path / "a.mcap").samples) == result.ticks
    assert "waiting for the recorder (process" in caplog.text
    assert "its disk has taken nothing for" in caplog.text


def test_a_recorder_that_stood_still_with_all_the_others_is_waited_for(
    stands: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two minutes of standstill at the end of a session: it was ended before it could move, and its record was cut."""
    session, clock = run_to_its_end(tmp_path / "a.mcap"), Clock(monkeypatch)
    clock.run(20.0, lambda: (clock.jump(2 * DISK_PATIENCE_S), clock.run(25.0 + 2 * DISK_PATIENCE_S, stands.unlink)))
    result = closed(session)
    assert (result.error, result.valid, session.recording.given_up) == ("", True, "")


def test_a_disk_that_takes_nothing_at_all_is_given_up_and_the_loss_is_told(
    stands: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    session, clock = run_to_its_end(tmp_path / "a.mcap"), Clock(monkeypatch)
    caplog.set_level(logging.WARNING)
    clock.run()
    result = closed(session)
    assert result.file == tmp_path / "a.mcap.partial"
    assert result.file.exists()
    assert not result.valid
    assert result.error.startswith(f"the disk took nothing for {DISK_PATIENCE_S:g} s, and the recorder was ended; ")
    assert len(caplog.messages) > DISK_PATIENCE_S / 10


def test_a_daemon_whose_disk_was_given_up_says_so_in_its_log(
    stands: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monitor = SessionMonitor(parts_of(compose.load(None), virtual=True))
    monitor.session = run_to_its_end(tmp_path / "a.mcap")
    Clock(monkeypatch).run()
    said: list[str] = []
    monitor.close(said.append)
    assert all(line.startswith("waiting for the recorder (process ") for line in said)
    assert len(said) > DISK_PATIENCE_S / 10
    (lost,) = caplog.messages
    assert lost.startswith(f"{tmp_path / 'a.mcap.partial'}: the disk took nothing for {DISK_PATIENCE_S:g} s")


def test_a_run_whose_disk_was_given_up_says_where_its_rest_lies(
    stands: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = Clock(monkeypatch)

    def over(_: Session, interrupted: bool) -> str:
        await_file(tmp_path / "out" / "a.mcap")
        clock.run()
        return ""

    monkeypatch.setattr(under_way, "ending", over)
    outcome: RunOutcome = runner.carry_out(
        compose.load(None), [Planned("a", program())], RunOptions(tmp_path / "out", virtual=True)
    )
    outcome.interrupted = True  # Ctrl-C does not make it better
    with pytest.raises(CheckFailed, match=r"out/a\.mcap\.partial: the disk took nothing for 60 s, .* rest lies there"):
        outcome.judge()
    assert "waiting for the recorder" in capsys.readouterr().err
