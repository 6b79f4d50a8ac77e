"""A watcher that was stopped as its daemon died, and goes on in the sweep of the next one."""

import contextlib
import os
import signal
from pathlib import Path

from support.rigs import fieldbus_rigs as rigs

from rig.qualify.faults.wired import ModbusFaultBench
from rig.realtime.safe_report import Outcome, SafeBlock, Writer
from rig.realtime.shared import folder
from rig.service.processes import is_stopped


def test_a_supervisor_that_goes_on_later_leaves_a_new_daemon_s_sweep_alone(tmp_path: Path) -> None:
    """It found its loop gone, and wrote the safe set-points: for some ticks, or the new daemon lost its device by it,
    in 5 of 5 trials."""
    with ModbusFaultBench(tmp_path, watchdog_s=60.0) as bench:
        bench.ready()
        session = bench.status()["session"]
        told = SafeBlock.attach(folder() / f"pamrig-{session}-safe", int(session, 16))
        supervisor = bench.pids()["supervisor"]
        os.kill(supervisor, signal.SIGSTOP)
        bench.wait(lambda: is_stopped(supervisor), "the supervisor to stand")
        os.kill(bench.daemon_pid, signal.SIGKILL)
        bench.wait(lambda: bench.is_safe, "the safe state by whoever is left", 10.0)
        try:
            bench.start()
            bench.ready()
            os.kill(supervisor, signal.SIGCONT)
            bench.wait(lambda: told.report(Writer.SUPERVISOR).outcome is not Outcome.UNKNOWN, "its attempt", 10.0)
            disturbed = rigs.soon(lambda: told.report(Writer.SUPERVISOR).written_ns or bench.fault(), 1.0)
            assert not disturbed, "written in the middle of the sweep"
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.kill(supervisor, signal.SIGKILL)
