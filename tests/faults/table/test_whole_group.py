"""A signal for the whole process group of who commands, as a terminal and a shell send it: `kill -9 %1`, Ctrl-\\,
`timeout -s KILL`. Those that see to the safe state do not belong to it."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rig.log.reader import read
from rig.qualify.faults.bench import FaultBench
from rig.qualify.faults.command_benches import CalibrationBench, RunBench


def _as_a_shell_s_job() -> None:
    """Whoever runs the tests in the background has it ignored."""
    signal.signal(signal.SIGQUIT, signal.SIG_DFL)


class InAGroup(FaultBench):
    """What commands leads a process group of its own, as a shell's job does."""

    def command(self, *arguments: str, stdin: int = subprocess.DEVNULL) -> None:
        with (self.folder / "daemon.log").open("ab") as log:
            call = [sys.executable, "-m", "rig.cli.main", *arguments]
            self._daemon = subprocess.Popen(
                call, stdout=log, stderr=log, stdin=stdin, start_new_session=True, preexec_fn=_as_a_shell_s_job
            )

    def strike(self, number: int) -> int:
        """The signal to all of the group; returns when."""
        now_ns = time.monotonic_ns()
        os.killpg(self.daemon_pid, number)
        return now_ns


class Run(InAGroup, RunBench):
    """`pamrig run`."""


class Calibration(InAGroup, CalibrationBench):
    """`pamrig devices calibrate pressures`."""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGQUIT, signal.SIGSTOP, signal.SIGUSR1])
@pytest.mark.parametrize("make", [InAGroup, Run, Calibration])
def test_old_set_points_do_not_stay(tmp_path: Path, make: type[InAGroup], number: int) -> None:
    """All processes were in the group, and ended or stood still together: old set-points stayed for as long as one
    looked."""
    with make(tmp_path) as bench:
        bench.ready()
        assert bench.ms_to_safe(bench.strike(number)) < 1500.0
        bench.strike(signal.SIGKILL)


def test_the_record_is_finished(tmp_path: Path) -> None:
    with Run(tmp_path) as run:
        run.ready()
        run.strike(signal.SIGKILL)
        run.wait(lambda: list(tmp_path.rglob("trial_1/*.mcap")), "the record")
        (record,) = tmp_path.rglob("trial_1/*.mcap")
        facts = read(record)[0].facts
        assert (facts["ended"], facts["valid"]) == ("fault", False)
        assert "CONTROL_LOST" in facts["fault"]
