"""The supervisor against real processes: what it sees, what it does, and in which order."""

import errno
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from rig.errors import ConfigError, DeviceError
from rig.realtime.ring import Ring, RingWriter
from rig.realtime.safe_report import LoopVerdict, Outcome, SafeBlock, SafeReport, Writer
from rig.realtime.safe_state import SafeStateAuthority, SecondPath
from rig.realtime.supervisor import Supervisor
from rig.realtime.watched_process import WatchedProcess

pytestmark = pytest.mark.real_time

PERIOD_NS = 20_000_000
"""Longer than the loop's, so that a slow machine is no silent loop."""

SLEEPER = [sys.executable, "-c", "import time; time.sleep(60)"]


class Rig:
    """A stand-in for the loop: a process, and its heartbeat in a ring."""

    def __init__(self) -> None:
        name = f"test-{os.getpid()}-{time.monotonic_ns()}"
        self.ring, self.block = Ring.create(f"{name}-ring", 1), SafeBlock.create(f"{name}-safe", 1)
        self.process = subprocess.Popen(SLEEPER)
        self.loop = WatchedProcess(self.process.pid)
        self.writer = RingWriter(self.ring)
        self.alive_when_safe: list[bool] = []
        self.told: list[bool] = []
        """Whether somebody had called it safe at each write."""
        self.held: list[bool | None] = [True]
        """What the device says one look after the other; the last goes on."""

    def safe(self) -> None:
        self.alive_when_safe.append(self.process.poll() is None)
        self.told.append(self.block.best().safe)

    def holds_safe(self) -> bool | None:
        return self.held.pop(0) if len(self.held) > 1 else self.held[0]

    def authority(
        self, safe: Callable[[], None] | None = None, writer: Writer = Writer.SUPERVISOR
    ) -> SafeStateAuthority:
        return SafeStateAuthority(
            writer, self.block, self.ring, self.loop, SecondPath(safe or self.safe, self.holds_safe)
        )

    def supervisor(self, writer: Writer = Writer.SUPERVISOR, grace_ns: int = 0) -> Supervisor:
        return Supervisor(
            writer, self.ring, self.block, self.loop, self.authority(writer=writer),
            patience_ns=3 * PERIOD_NS, period_ns=PERIOD_NS, grace_ns=grace_ns,
        )  # fmt: skip

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self.loop.close()
        self.ring.block.unlink()
        self.block.block.unlink()


@pytest.fixture
def rig() -> Iterator[Rig]:
    rig = Rig()
    yield rig
    rig.close()


def test_a_killed_loop_is_seen_without_waiting_for_its_heartbeat(rig: Rig) -> None:
    rig.writer.beat(ahead_ns=60_000_000_000)
    threading.Timer(0.05, rig.process.kill).start()
    assert rig.supervisor().run() is LoopVerdict.ENDED
    report = rig.block.best()
    assert (report.writer, report.verdict, report.outcome) == (Writer.SUPERVISOR, LoopVerdict.ENDED, Outcome.SEEN)
    assert rig.alive_when_safe == [False]
    assert report.confirmed_ns >= report.written_ns >= report.seen_ns > 0


@pytest.mark.parametrize("number", [None, signal.SIGSTOP], ids=["hanging", "stopped"])
def test_a_silent_loop_is_ended_and_only_what_was_written_after_its_end_counts(
    rig: Rig, number: signal.Signals | None
) -> None:
    rig.writer.beat()
    if number is not None:
        rig.process.send_signal(number)
    assert rig.supervisor().run() is LoopVerdict.SILENT
    assert rig.process.wait(5) == -signal.SIGKILL
    assert rig.alive_when_safe[-1] is False
    assert not any(rig.told)
    report = rig.block.best()
    assert report.outcome is Outcome.SEEN
    assert report.seen_ns - report.last_beat_ns >= 2.9 * PERIOD_NS


def test_a_loop_that_beats_is_left_alone(rig: Rig) -> None:
    supervisor = rig.supervisor()
    thread = threading.Thread(target=supervisor.run)
    thread.start()
    for _ in range(20):
        rig.writer.beat()
        time.sleep(PERIOD_NS / 4e9)
    rig.block.release()
    rig.writer.beat()
    thread.join(5)
    assert rig.process.poll() is None
    assert rig.alive_when_safe == []
    assert rig.block.beat_ns(Writer.SUPERVISOR) > 0


def test_a_loop_that_never_ticked_wrote_nothing_and_nothing_is_written_after_it(rig: Rig) -> None:
    supervisor = rig.supervisor()
    thread = threading.Thread(target=supervisor.run)
    thread.start()
    time.sleep(10 * PERIOD_NS / 1e9)
    assert thread.is_alive()
    rig.process.kill()
    thread.join(5)
    assert rig.alive_when_safe == []


@pytest.mark.parametrize("error", [DeviceError("no reply"), ConfigError("no bitfile"), OSError("no port")])
def test_a_device_that_cannot_be_reached_is_tried_again_and_never_called_safe(rig: Rig, error: Exception) -> None:
    tries = []

    def unreachable() -> None:
        tries.append(1)
        raise error

    rig.process.kill()
    report = rig.authority(unreachable).take_over(LoopVerdict.ENDED, persistence_s=0.1)
    assert (report.outcome, report.written_ns) == (Outcome.FAILED, 0)
    assert len(tries) > 2
    assert "NOT SAFE" in report.words
    assert rig.block.best() == report


def test_who_is_left_alone_tries_on_beyond_his_time(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command was killed while its device was away: supervisor and guardian gave up after ten seconds."""
    monkeypatch.setattr("rig.realtime.safe_state._LATE_RETRY_S", 0.01)
    asked, tries = [], []

    def unreachable() -> None:
        tries.append(1)
        if len(asked) < 5:
            raise DeviceError("no reply")

    def goes_on() -> bool:
        asked.append(1)
        return True

    rig.process.kill()
    path = SecondPath(unreachable, rig.holds_safe)
    authority = SafeStateAuthority(Writer.GUARDIAN, rig.block, rig.ring, rig.loop, path, goes_on)
    assert authority.take_over(LoopVerdict.ENDED, persistence_s=0.02).outcome is Outcome.SEEN
    assert len(asked) == 5


def test_a_device_that_comes_back_is_made_safe(rig: Rig) -> None:
    tries = []

    def away_for_a_while() -> None:
        tries.append(1)
        if len(tries) < 4:
            raise DeviceError("no reply")

    rig.process.kill()
    assert rig.authority(away_for_a_while).take_over(LoopVerdict.ENDED).outcome is Outcome.SEEN
    assert len(tries) == 4


def test_what_the_device_does_not_hold_is_written_again(rig: Rig) -> None:
    rig.held = [False, False, True]
    rig.process.kill()
    assert rig.authority().take_over(LoopVerdict.ENDED).outcome is Outcome.SEEN
    assert len(rig.alive_when_safe) == 3


def test_a_device_that_cannot_be_read_back_is_said_to_be_written_not_confirmed(rig: Rig) -> None:
    rig.held = [None]
    rig.process.kill()
    report = rig.authority().take_over(LoopVerdict.ENDED)
    assert (report.outcome, report.confirmed_ns) == (Outcome.WRITTEN, 0)
    assert report.words == "safe state written by the supervisor, not confirmed: the device has not been read back"


def test_a_plant_in_the_loop_s_process_ends_with_it(rig: Rig) -> None:
    rig.process.send_signal(signal.SIGSTOP)
    authority = SafeStateAuthority(Writer.CONTROL, rig.block, rig.ring, rig.loop, None)
    assert authority.take_over(LoopVerdict.SILENT).outcome is Outcome.ENDED
    assert rig.process.wait(5) == -signal.SIGKILL


def test_the_guardian_writes_nothing_when_somebody_else_made_it_safe(rig: Rig) -> None:
    rig.writer.beat()
    rig.process.kill()
    rig.process.wait()
    rig.block.tell(SafeReport(Writer.SUPERVISOR, LoopVerdict.ENDED, Outcome.SEEN, 1, 1, 2, 3))
    assert rig.supervisor(Writer.GUARDIAN, grace_ns=10**9).run() is LoopVerdict.ENDED
    assert rig.alive_when_safe == []


def test_the_guardian_writes_when_nobody_else_did_within_its_grace(rig: Rig) -> None:
    rig.writer.beat()
    rig.process.kill()
    rig.block.tell(SafeReport(Writer.SUPERVISOR, LoopVerdict.ENDED, Outcome.FAILED, 1))
    assert rig.supervisor(Writer.GUARDIAN, grace_ns=50_000_000).run() is LoopVerdict.ENDED
    assert rig.block.best().writer is Writer.GUARDIAN
    assert rig.alive_when_safe == [False]


def test_a_process_that_is_gone_already_is_gone(rig: Rig) -> None:
    rig.process.kill()
    rig.process.wait()
    assert WatchedProcess(rig.process.pid).gone_within(0.0)


def test_a_process_that_cannot_be_watched_is_not_taken_for_gone(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a descriptor left, a loop that was stopped was called gone, and the rig safe: it was never ended."""

    def exhausted(_: int) -> int:
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(os, "pidfd_open", exhausted)
    with pytest.raises(OSError, match="Too many open files"):
        WatchedProcess(rig.process.pid)


def test_a_process_is_watched_by_a_descriptor_of_any_number(rig: Rig) -> None:
    """In a notebook that holds a thousand files nobody took over from a loop that was lost."""
    most, held = resource.getrlimit(resource.RLIMIT_NOFILE), []
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(most[0], min(2048, most[1])), most[1]))
    try:
        while not held or held[-1] < 1024:
            held.append(os.dup(0))
        watched = WatchedProcess(rig.process.pid)
        assert not watched.gone_within(0.001)
        rig.process.kill()
        assert watched.gone_within(10.0)
        watched.close()
    finally:
        for descriptor in held:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, most)
