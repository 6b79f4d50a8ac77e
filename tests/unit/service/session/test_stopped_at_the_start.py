"""A loop that somebody stops before its first tick, which has written nothing: its session ends all the same."""

import multiprocessing
import os
import signal
import threading
import time
from dataclasses import replace
from multiprocessing.connection import Connection

import pytest
from support.rigs.fieldbus_rigs import soon

from rig.app import compose
from rig.app.supervise import parts_of
from rig.realtime.faults import Fault
from rig.realtime.ring import Ring, RingWriter
from rig.service.processes import is_stopped
from rig.service.session.process_setups import LoopSetup
from rig.service.session.session import Session
from rig.service.session.session_monitor import SessionMonitor

pytestmark = pytest.mark.real_time


def loop_stopped_while_it_starts(_: LoopSetup, pipe: Connection) -> None:
    os.kill(os.getpid(), signal.SIGSTOP)
    pipe.recv()


def loop_stopped_when_it_is_ready(_: LoopSetup, pipe: Connection) -> None:
    pipe.send(("ready", {}))
    os.kill(os.getpid(), signal.SIGSTOP)
    time.sleep(60.0)


def test_a_session_whose_loop_was_stopped_when_it_was_ready_ends_at_once() -> None:
    """It was waited for, for the five seconds that a loop has for its safe state, and killed."""
    session = Session(loop_stopped_when_it_is_ready, compose.load(None), virtual=True)
    session.open()
    loop = session.loop
    assert loop is not None
    assert soon(lambda: is_stopped(loop.pid))
    session.close()
    assert loop.exitcode == -signal.SIGTERM
    assert session.end.words == "the loop never ticked, and nothing was written to the rig"


def loop_that_has_its_device_when_nobody_wants_it(setup: LoopSetup, pipe: Connection) -> None:
    ring = RingWriter(Ring.attach(setup.ring, setup.session))
    ring.beat()
    ring.made_safe()
    ring.saw_safe()
    pipe.recv()


def test_what_a_loop_did_that_was_given_up_as_it_had_its_device_is_told() -> None:
    """A run that was told to end in that moment said that nobody had reported the safe state, and old set-points might
    stand, with exit status 1."""
    session = Session(loop_that_has_its_device_when_nobody_wants_it, compose.load(None), virtual=True)

    def told_to_end() -> None:
        if session.ring.safe_seen_ns:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        session.open(meanwhile=told_to_end)
    session.close()
    assert session.end.words == "safe state written by the loop, seen at the device"
    assert not session.end.unsafe


def test_a_daemon_that_is_told_to_end_waits_for_no_loop_that_was_stopped_while_it_started() -> None:
    """It waited for the thirty seconds that a loop has for its start."""
    parts = replace(parts_of(compose.load(None), virtual=True), loop=loop_stopped_while_it_starts)
    monitor = SessionMonitor(parts)
    opening = threading.Thread(target=monitor.open)
    opening.start()
    assert soon(lambda: any(is_stopped(child.pid) for child in multiprocessing.active_children()))
    monitor.give_up_opening()
    opening.join()
    assert monitor.fault is Fault.LOOP_DIED
    assert monitor.message == "the loop's process was ended by SIGTERM before anything was written to the rig"
