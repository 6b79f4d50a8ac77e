"""A device that is away, and a daemon that is lost while it tries to make it safe: somebody else goes on."""

import contextlib
import os
import signal
import time
from pathlib import Path

import pytest
from support.rigs.switched_line import SwitchedBench

from rig.errors import RigError


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_after_a_reset_in_vain(tmp_path: Path, number: int) -> None:
    """The reset had ended all who watched: old set-points stood when the device was back, for as long as one looked."""
    with SwitchedBench(tmp_path) as bench:
        _lose_the_device(bench)
        with bench.client() as client, pytest.raises(RigError, match="DEVICE_LOST"):
            client.reset()
        check_that_somebody_goes_on_without_the_daemon(bench, number)


def test_after_the_time_of_those_who_watched_a_loop_that_is_gone(tmp_path: Path) -> None:
    """They gave up after ten seconds, for there was one who commands: nobody was left when he was lost as well."""
    with SwitchedBench(tmp_path) as bench:
        _lose_the_device(bench)
        os.kill(bench.pids()["loop"], signal.SIGKILL)
        gave_up = time.monotonic() + 12.0
        bench.wait(lambda: time.monotonic() > gave_up, "the end of their time")
        check_that_somebody_goes_on_without_the_daemon(bench, signal.SIGKILL)


def _lose_the_device(bench: SwitchedBench) -> None:
    for _ in range(3):
        with contextlib.suppress(RigError):  # a machine that stands still refuses to arm
            bench.ready()
            break
    bench.line.cut()
    bench.wait(bench.fault, "the fault")
    assert not bench.is_safe


def check_that_somebody_goes_on_without_the_daemon(bench: SwitchedBench, number: int) -> None:
    others = {pid for name, pid in bench.pids().items() if name != "control"}
    os.kill(bench.daemon_pid, number)
    bench.line.mend()
    bench.wait(lambda: bench.is_safe, "the safe set-points", 10.0)
    bench.revive()
    if number == signal.SIGKILL:
        bench.wait(lambda: not any(Path(f"/proc/{pid}/fd").exists() for pid in others), "the end of all")
        assert "safe state written by the" in bench.log_text()


def test_a_bench_goes_on_from_a_daemon_that_could_not_open_its_device(tmp_path: Path) -> None:
    """On a busy machine a module's answer comes late now and then: for the daemon's loop, which only a reset makes,
    each start waited 150 s in vain."""
    with SwitchedBench(tmp_path) as bench:
        bench.line.cut()
        bench.start()
        assert (bench.fault(), bench.status()["loop"]) == ("DEVICE_LOST", None)
        bench.line.mend()
        bench.at_rest()
        assert bench.status()["loop"]
