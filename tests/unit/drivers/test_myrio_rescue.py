"""The safe set-points by a new session, on a thread of its own."""

import os
import threading

import pytest

from drivers.myrio.rescue import Rescue
from rig.errors import DeviceError


def test_without_a_thread_it_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each attempt after it waited for a thread that had never begun, by an error of the program."""

    def refuse(_: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    written: list[str] = []
    rescue = Rescue("myrio", lambda: written.append("safe"))
    with monkeypatch.context() as patched:
        patched.setattr(threading.Thread, "start", refuse)
        for _ in range(2):
            with pytest.raises(DeviceError, match="the safe set-points are not written: no thread to be had"):
                rescue.attempt(1.0)
    rescue.attempt(10.0)
    assert written == ["safe"]


def test_it_is_real_time_behind_the_loop_that_began_it() -> None:
    """At an ordinary priority it kept the interpreter from the loop for as long as other work kept it from a processor:
    ticks of 10 to 30 ms beside three computing processes, and a loop that is 14.5 ms late is ended."""
    seen: list[tuple[int, int]] = []
    rescue = Rescue("myrio", lambda: seen.append((os.sched_getscheduler(0), os.sched_getparam(0).sched_priority)))

    def as_the_loop() -> None:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(80))
        except PermissionError:
            return
        rescue.attempt(10.0)

    loop = threading.Thread(target=as_the_loop)
    loop.start()
    loop.join()
    if not seen:
        pytest.skip("real-time priority is not allowed here")
    assert seen == [(os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, 40)]
