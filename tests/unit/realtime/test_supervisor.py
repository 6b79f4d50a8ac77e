"""The supervisor against real processes: what it sees, what it does, and in which order."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from rig.errors import ConfigError, DeviceError
from rig.realtime.ring import Ring, RingWriter
from rig.realtime.supervisor import ATTEMPTS, Supervisor, SupervisorBlock, Verdict

pytestmark = pytest.mark.real_time

PERIOD_NS = 20_000_000
"""Longer than the loop's, so that a slow machine is no silent loop."""

SLEEPER = [sys.executable, "-c", "import time; time.sleep(60)"]


class Rig:
    """A stand-in for the loop: a process, and its heartbeat in a ring."""

    def __init__(self) -> None:
        name = f"test-{os.getpid()}-{time.monotonic_ns()}"
        self.ring, self.block = Ring.create(f"{name}-ring", 1), SupervisorBlock.create(f"{name}-supervisor", 1)
        self.process = subprocess.Popen(SLEEPER)
        self.writer = RingWriter(self.ring, self.process.pid)
        self.alive_when_safe: list[bool] = []

    def safe(self) -> None:
        self.alive_when_safe.append(self.process.poll() is None)

    def supervisor(self, safe: Callable[[], None] | None = None) -> Supervisor:
        return Supervisor(self.ring, self.block, self.process.pid, safe or self.safe, PERIOD_NS)

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
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
    assert rig.supervisor().run() is Verdict.ENDED
    report = rig.block.report()
    assert (report.verdict, report.failed, len(rig.alive_when_safe)) == (Verdict.ENDED, False, 1)
    assert report.safe_ns >= report.seen_ns > 0


@pytest.mark.parametrize("number", [None, signal.SIGSTOP], ids=["hanging", "stopped"])
def test_a_silent_loop_is_ended_and_made_safe_twice(rig: Rig, number: signal.Signals | None) -> None:
    rig.writer.beat()
    if number is not None:
        rig.process.send_signal(number)
    assert rig.supervisor().run() is Verdict.SILENT
    assert rig.process.wait(5) == -signal.SIGKILL
    assert len(rig.alive_when_safe) == 2
    report = rig.block.report()
    assert report.seen_ns - report.last_beat_ns >= 2.9 * PERIOD_NS


def test_a_loop_that_beats_is_left_alone(rig: Rig) -> None:
    supervisor = rig.supervisor()
    thread = threading.Thread(target=supervisor.run)
    thread.start()
    for _ in range(20):
        rig.writer.beat()
        time.sleep(PERIOD_NS / 4e9)
    supervisor.release()
    rig.writer.beat()
    thread.join(5)
    assert rig.process.poll() is None
    assert rig.alive_when_safe == []
    assert rig.block.beat_ns > 0


def test_before_the_first_heartbeat_only_the_end_counts(rig: Rig) -> None:
    supervisor = rig.supervisor()
    thread = threading.Thread(target=supervisor.run)
    thread.start()
    time.sleep(10 * PERIOD_NS / 1e9)
    assert thread.is_alive()
    rig.process.kill()
    thread.join(5)
    assert rig.block.report().verdict is Verdict.ENDED


@pytest.mark.parametrize("error", [DeviceError("no reply"), ConfigError("no bitfile"), OSError("no port")])
def test_a_device_that_cannot_be_reached_is_tried_and_then_reported(rig: Rig, error: Exception) -> None:
    tries = []

    def unreachable() -> None:
        tries.append(1)
        raise error

    rig.process.kill()
    assert rig.supervisor(unreachable).run() is Verdict.ENDED
    report = rig.block.report()
    assert (report.failed, report.safe_ns, len(tries)) == (True, 0, ATTEMPTS)


def test_a_process_that_is_gone_cannot_be_watched(rig: Rig) -> None:
    rig.process.kill()
    rig.process.wait()
    with pytest.raises(ProcessLookupError):
        rig.supervisor()
