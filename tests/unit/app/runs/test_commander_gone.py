"""Processes of a rig when the one that commands them is killed while they start, or interrupted while they end."""

import secrets
import signal
import subprocess
import sys
from collections.abc import Iterator
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

import pytest

from rig.app import compose
from rig.app.loop_process import loop_process
from rig.app.watcher_process import watcher_process
from rig.errors import RigError
from rig.realtime.ring import Ring
from rig.realtime.safe_report import Writer
from rig.service.session.process_setups import LoopSetup, WatcherSetup
from rig.service.session.session import Session
from rig.service.session.watchers import Watchers


class Unheard:
    """A pipe whose other end closes when it has been told something, which nobody reads."""

    def __init__(self) -> None:
        self._ours, self._theirs = get_context("spawn").Pipe()

    def send(self, said: Any) -> None:
        self._ours.send(said)
        self._theirs.close()

    def recv(self) -> Any:
        return self._ours.recv()


def gone() -> Connection:
    """A pipe whose other end is closed."""
    ours, theirs = get_context("spawn").Pipe()
    theirs.close()
    return ours


def loop_that_nobody_hears(setup: LoopSetup, pipe: Connection) -> None:
    loop_process(setup, gone())


def loop_that_nobody_heard(setup: LoopSetup, pipe: Connection) -> None:
    loop_process(setup, Unheard())  # type: ignore[arg-type]


@pytest.mark.parametrize("entry", [loop_that_nobody_hears, loop_that_nobody_heard])
def test_a_loop_whose_commander_is_gone_when_it_is_ready_leaves_its_device_in_order(
    entry: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    """It ended in a traceback, with the device open as it was."""
    session = Session(entry, compose.load(None), virtual=True)
    try:
        with pytest.raises(RigError, match="ended before it was ready"):
            session.open()
        assert session.loop is not None
        assert session.loop.exitcode == 0
    finally:
        session.close()
    assert capfd.readouterr().err == ""


def watcher_that_nobody_hears(setup: WatcherSetup, pipe: Connection) -> None:
    watcher_process(setup, gone())


@pytest.fixture
def ring() -> Iterator[Ring]:
    session = secrets.randbits(62)
    ring = Ring.create(f"test-{session:016x}-ring", session, capacity=1)
    yield ring
    ring.block.unlink()


def test_a_watcher_whose_commander_is_gone_when_it_is_ready_watches(
    ring: Ring, capfd: pytest.CaptureFixture[str]
) -> None:
    """Nobody watched the loop then, and a traceback stood in the daemon's log."""
    with subprocess.Popen([sys.executable, "-c", "import sys; sys.stdin.read()"], stdin=subprocess.PIPE) as loop:
        watchers = Watchers(ring.block.session, ring, compose.load(None), {})
        watchers.start(watcher_that_nobody_hears, loop.pid, (Writer.GUARDIAN,))
        (watcher,) = watchers.processes.values()
        while watcher.is_alive() and not watchers.block.beat_ns(Writer.GUARDIAN):
            watcher.join(0.01)
        assert watchers.block.beat_ns(Writer.GUARDIAN), "it watches"
    watcher.join()
    watchers.end()
    assert watcher.exitcode == 0
    assert capfd.readouterr().err == ""


def test_ctrl_c_once_more_while_a_session_ends_leaves_nothing_in_shared_memory() -> None:
    """`pamrig latency` left three blocks there."""

    def interrupted() -> None:
        signal.raise_signal(signal.SIGINT)
        dismissed()

    before = signal.getsignal(signal.SIGINT)
    with Session(loop_process, compose.load(None), virtual=True) as session:
        session.open()
        dismissed, session.dismiss_loop = session.dismiss_loop, interrupted  # type: ignore[method-assign]
    assert not any(block.path.exists() for block in (session.ring.block, session.mailbox.block))
    assert signal.getsignal(signal.SIGINT) is before
