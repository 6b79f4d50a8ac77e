"""A run all of whose processes are told to end by one signal, as `timeout` and a supervisor of services send it."""

import functools
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pytest
from support.rigs.fieldbus_rigs import soon
from support.scripted import program

from rig.app import compose
from rig.app.loop_process import loop_process
from rig.app.runs import runner
from rig.app.runs.runner import Planned, RunOptions
from rig.errors import Interrupted
from rig.realtime.loop import Loop
from rig.service.records.recorder import record
from rig.service.session.process_setups import LoopSetup

pytestmark = pytest.mark.real_time


class EndsLate:
    """Sends its process the signal to end when the interpreter is ending already, and hears no signals any more."""

    def __init__(self) -> None:
        self._send = functools.partial(os.kill, os.getpid(), signal.SIGTERM)

    def __del__(self) -> None:
        self._send()


def recorder_that_is_told_to_end_twice(*arguments: Any) -> None:
    record(*arguments)
    sys.modules["kept until the end"] = EndsLate()  # type: ignore[assignment]


def loop_whose_way_out_takes_longer_than_its_recorders(setup: LoopSetup, pipe: Connection) -> None:
    leave = Loop.leave

    def slowly(self: Loop) -> None:
        self.ring.beat(1_000_000_000)
        time.sleep(0.5)
        leave(self)

    Loop.leave = slowly  # type: ignore[method-assign]
    loop_process(setup, pipe)


@pytest.mark.parametrize("recorder", [record, recorder_that_is_told_to_end_twice], ids=["once", "twice"])
def test_a_recorder_that_was_told_to_end_with_its_run_is_not_lost(
    recorder: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run ended by RECORDER_DIED, "check the disk", with exit status 1."""
    monkeypatch.setattr(runner, "loop_process", loop_whose_way_out_takes_longer_than_its_recorders)

    monkeypatch.setattr("rig.service.session.recording._recorder", recorder)

    def strike() -> None:
        soon(lambda: [*tmp_path.glob("out/*.partial")], 60.0)
        for pid in [os.getpid(), *(child.pid for child in multiprocessing.active_children())]:
            if pid is not None:
                os.kill(pid, signal.SIGTERM)

    striking = threading.Thread(target=strike)
    striking.start()
    outcome = runner.carry_out(compose.load(None), [Planned("a", program(sweep=20_000))], RunOptions(tmp_path / "out"))
    striking.join()
    assert outcome.error == ""
    with pytest.raises(Interrupted, match="safe state written by the loop"):
        outcome.judge()
    assert [run.file.name for run in outcome.runs] == ["a.mcap"]
    assert (tmp_path / "out" / "a.mcap").exists()
