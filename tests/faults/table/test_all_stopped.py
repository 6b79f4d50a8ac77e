"""A rig whose processes have all stood still, as under `docker pause`: what they do first when they go on again."""

from collections.abc import Callable
from pathlib import Path

import pytest

from rig.log.reader import read
from rig.qualify.faults.bench import FaultBench
from rig.qualify.faults.command_benches import CommandBench, RunBench, RunOverModbus
from rig.qualify.faults.table import TABLE, all_stopped
from rig.qualify.faults.trial import try_row
from rig.qualify.faults.wired import ModbusFaultBench, RtuFaultBench, SerialFaultBench

CAUSES = ("LONG_STALL", "LOOP_DIED", "SUPERVISOR_DIED")
"""Who runs first finds it."""


@pytest.mark.parametrize("make", [ModbusFaultBench, RtuFaultBench, SerialFaultBench])
def test_a_daemon_over_a_wire(tmp_path: Path, make: Callable[[Path], FaultBench]) -> None:
    """Over Modbus TCP the module's own watchdog has taken the outputs away meanwhile; who serves a slow line stood
    still as well, and is not replaced."""
    with make(tmp_path) as bench:
        finding = try_row(bench, next(row for row in TABLE if row.name == "all stopped"))
        assert finding.problem == ""
        status = bench.status()
        assert (status["state"], status["working"]) == ("fault", False)
        check_that_the_same_daemon_is_reset(bench)


@pytest.mark.parametrize("make", [RunBench, RunOverModbus])
def test_a_run(tmp_path: Path, make: Callable[[Path], CommandBench]) -> None:
    with make(tmp_path) as run:
        run.ready()
        assert run.ms_to_safe(all_stopped(run)) < 1000.0
        assert run.said_of_safe(10.0).rstrip().endswith("seen at the device")
        assert any(cause in run.said for cause in CAUSES)
        (record,) = tmp_path.rglob("*.mcap")
        facts = read(record)[0].facts
        assert (facts["ended"], facts["valid"]) == ("fault", False)


def test_a_rig_that_had_been_stopped_before(tmp_path: Path) -> None:
    """The module's own watchdog took its outputs away from the safe set-points, which were written when the rig was
    stopped and not again: the status called them seen, and the module refused every reading, and with it every reset.
    """
    with ModbusFaultBench(tmp_path) as bench:
        bench.ready()
        with bench.client() as client:
            client.estop()
        assert bench.is_safe
        all_stopped(bench)
        assert bench.wait(lambda: bench.is_safe, "the safe set-points", 5.0)
        assert bench.fault() == "ESTOP"
        check_that_the_same_daemon_is_reset(bench)


def check_that_the_same_daemon_is_reset(bench: FaultBench) -> None:
    """As soon as its wires have carried the safe state again, which slow ones may not have when the fault is told: a
    reset is refused until then."""
    daemon = bench.daemon_pid
    bench.at_rest()
    assert bench.is_safe
    assert (bench.daemon_pid, bench.status()["state"]) == (daemon, "disarmed")
