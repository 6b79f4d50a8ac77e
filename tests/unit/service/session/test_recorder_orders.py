"""What the recorder of a session is told, on a disk that stands still: nobody who ends something waits for it."""

import os
import signal
import threading
from pathlib import Path

import pytest

from rig.app import compose
from rig.app.loop_process import loop_process
from rig.service.records.recorder_messages import RunOrder
from rig.service.session.session import Session

pytestmark = pytest.mark.real_time

LONGER_THAN_A_PIPE = bytes(1 << 20)


def test_the_end_of_a_recording_waits_for_no_recorder(tmp_path: Path) -> None:
    """The daemon's event loop did, for ever, behind an order that the recorder did not take: no emergency stop was
    answered, and the daemon was not to be ended."""
    session = Session(loop_process, compose.load(None), virtual=True)
    session.open()
    assert session.recorder is not None
    assert session.recorder.pid is not None
    os.kill(session.recorder.pid, signal.SIGSTOP)
    order = RunOrder(1, tmp_path / "a.mcap", {}, {"sweep.yaml": LONGER_THAN_A_PIPE}, 10, 0)
    telling = threading.Thread(target=session.recording.expect, args=(order,), daemon=True)
    telling.start()
    telling.join(0.3)
    assert telling.is_alive(), "the recorder takes nothing"
    ending = threading.Thread(target=session.end_recording, daemon=True)
    ending.start()
    ending.join(5.0)
    waited = ending.is_alive()
    session.close()  # lets the recorder go on
    telling.join(5.0)
    assert not waited
    assert not telling.is_alive()
    assert session.recorder.exitcode == 0, "it was told to end, when it could be"


def test_a_run_that_was_called_off_is_no_record_that_was_lost(tmp_path: Path) -> None:
    """One of the same name was made later: that one was said to be lost."""
    session = Session(loop_process, compose.load(None), virtual=True)
    session.open()
    session.recording.expect(RunOrder(1, tmp_path / "a.mcap", {}, {}, 10, 0))
    session.recording.call_off(1)
    (tmp_path / "a.mcap").write_bytes(b"")
    assert session.close() == []
