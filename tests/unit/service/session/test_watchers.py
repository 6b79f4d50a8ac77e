"""Whether supervisor and guardian can be relied on: theirs is a real process, whose heartbeats and clock the test
turns."""

import itertools
import multiprocessing
import os
import secrets
import signal
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection

import pytest

from rig.errors import RigError
from rig.realtime.ring import Ring
from rig.realtime.safe_report import Writer
from rig.service.session.process_setups import WatcherSetup
from rig.service.session.watchers import WATCHER_PATIENCE_S, Watchers, await_ready

LOOK_NS = 20_000_000


def stays(setup: WatcherSetup, pipe: Connection) -> None:
    """A watcher that does nothing by itself."""
    pipe.send(("ready", {}))
    time.sleep(60.0)


@pytest.fixture
def watchers() -> Iterator[Watchers]:
    session = secrets.randbits(62)
    ring = Ring.create(f"test-{session:016x}-ring", session, capacity=1)
    watchers = Watchers(session, ring, None, {})
    watchers.start(stays, os.getpid(), (Writer.SUPERVISOR,))
    watchers.await_ready()
    watchers.block.beat(Writer.SUPERVISOR)
    yield watchers
    for process in watchers.processes.values():
        process.kill()
    watchers.end()
    ring.block.unlink()


def test_one_that_was_stopped_is_trouble_and_one_beside_which_the_machine_stood_still_is_not(
    watchers: Watchers, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert watchers.trouble() == ""
    woken_ns = time.monotonic_ns() + round(5e9 * WATCHER_PATIENCE_S)
    monkeypatch.setattr(time, "monotonic_ns", lambda: woken_ns)
    assert watchers.trouble() == "", "who looks stood still as well"
    assert watchers.works(Writer.SUPERVISOR)
    watchers.block.beat(Writer.SUPERVISOR)
    said = []
    for now_ns in range(woken_ns, woken_ns + round(1e9 * WATCHER_PATIENCE_S) + 2 * LOOK_NS, LOOK_NS):
        monkeypatch.setattr(time, "monotonic_ns", lambda now_ns=now_ns: now_ns)
        said.append(watchers.trouble())
    assert said[-1] == f"the supervisor has not moved for {WATCHER_PATIENCE_S:g} s"
    assert not any(said[:-2])
    monkeypatch.undo()
    (process,) = watchers.processes.values()
    process.kill()
    process.join()
    assert watchers.trouble() == "the supervisor's process is gone"


def test_a_process_that_is_slow_to_start_is_not_said_to_have_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = multiprocessing.Pipe(duplex=False)
    clock_s = itertools.count(0.0, 10.0)
    monkeypatch.setattr(time, "monotonic", lambda: next(clock_s))
    with ours, pytest.raises(RigError, match="the loop's process was not ready within 30 s; is this machine busy"):
        await_ready(ours, multiprocessing.Process(), "loop")
    theirs.close()


def test_a_process_that_ended_before_it_was_ready_is_said_to_have() -> None:
    ours, theirs = multiprocessing.Pipe(duplex=False)
    theirs.close()
    process = multiprocessing.get_context("spawn").Process()
    process.start()
    with ours, pytest.raises(RigError, match="the loop's process ended before it was ready"):
        await_ready(ours, process, "loop")


def test_a_process_that_a_signal_ended_before_it_was_ready_is_said_to_have_written_nothing() -> None:
    """As by SIGTERM to a whole process group; the device was told to be looked at."""
    ours, theirs = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("spawn").Process(target=signal.raise_signal, args=(signal.SIGTERM,))
    process.start()
    theirs.close()
    with ours, pytest.raises(RigError, match="the loop's process was ended by SIGTERM before anything was written"):
        await_ready(ours, process, "loop")
