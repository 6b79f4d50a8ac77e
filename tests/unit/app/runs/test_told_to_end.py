"""A run all of whose processes are told to end by one signal, as `timeout` and a supervisor of services send it."""

import multiprocessing
import os
import signal
import threading
import time
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
from support.rigs.fieldbus_rigs import soon
from support.scripted import program

from rig.app import compose
from rig.app.loop_process import loop_process
from rig.app.runs import runner
from rig.app.runs.runner import Planned, RunOptions
from rig.errors import Interrupted
from rig.realtime.loop import Loop
from rig.service.session.process_setups import LoopSetup

pytestmark = pytest.mark.real_time


def loop_whose_way_out_takes_longer_than_its_recorders(setup: LoopSetup, pipe: Connection) -> None:
    leave = Loop.leave

    def slowly(self: Loop) -> None:
        self.ring.beat(1_000_000_000)
        time.sleep(0.5)
        leave(self)

    Loop.leave = slowly  # type: ignore[method-assign]
    loop_process(setup, pipe)


def test_a_recorder_that_was_told_to_end_with_its_run_is_not_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run ended by RECORDER_DIED, "check the disk", with exit status 1."""
    monkeypatch.setattr(runner, "loop_process", loop_whose_way_out_takes_longer_than_its_recorders)

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
