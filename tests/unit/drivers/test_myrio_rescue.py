"""The safe set-points by a new session, on a thread of its own."""

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
