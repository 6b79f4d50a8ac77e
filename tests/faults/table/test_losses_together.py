"""Several processes lost together, by a fixed seed: the rig is safe, stays safe, and nobody says more than is so.

`pamrig faults --together` carries out hundreds of them.
"""

import contextlib
import os
import random
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rig.cli.qualify.faults import BENCH_NAMES
from rig.qualify.faults.bench import FaultBench
from rig.qualify.faults.command_benches import CalibrationBench, ProbeBench, RunBench
from rig.qualify.faults.losses import BENCHES, ProcessSignal, draw, trials, try_losses
from rig.qualify.faults.wired import (
    ModbusFaultBench,
    MyRioFaultBench,
    RtuFaultBench,
    SerialFaultBench,
    WiredFaultBench,
)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FaultBench]:
    with FaultBench(Path(tmp_path_factory.mktemp("losses"))) as bench:
        yield bench


@pytest.fixture(scope="module")
def modbus(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModbusFaultBench]:
    with ModbusFaultBench(Path(tmp_path_factory.mktemp("modbus_losses"))) as bench:
        yield bench


def test_pairs_and_triples_on_the_simulated_rig(bench: FaultBench) -> None:
    assert [f"{trial}: {trial.problem}" for trial in trials(bench, 8, seed=3) if trial.problem] == []


def test_pairs_and_triples_over_modbus(modbus: ModbusFaultBench) -> None:
    assert [f"{trial}: {trial.problem}" for trial in trials(modbus, 4, seed=4) if trial.problem] == []


def test_pairs_and_triples_over_a_myrio(tmp_path: Path) -> None:
    """Its FPGA has no watchdog, and whoever is left needs a session of his own."""
    with MyRioFaultBench(tmp_path) as bench:
        assert [f"{trial}: {trial.problem}" for trial in trials(bench, 4, seed=9) if trial.problem] == []


@pytest.mark.parametrize("make", [SerialFaultBench, RtuFaultBench])
def test_a_process_that_holds_a_slow_wire_lost_together_with_others(
    tmp_path: Path, make: Callable[[Path], WiredFaultBench]
) -> None:
    """Stopped, it keeps the port: whoever is left lets it go on, or ends it."""
    together = [
        {"io process 1": signal.SIGSTOP, "loop": signal.SIGKILL},
        {"io process 1": signal.SIGSTOP, "supervisor": signal.SIGKILL, "loop": signal.SIGSTOP},
        {"io process 1": signal.SIGKILL, "loop": signal.SIGKILL},
        {"recorder": signal.SIGKILL, "io process 1": signal.SIGSTOP},
    ]
    with make(tmp_path) as bench:
        for blows in together:
            trial = try_losses(bench, tuple(ProcessSignal(process, number, 0.0) for process, number in blows.items()))
            assert (str(trial), trial.problem) == (str(trial), "")
            bench.wait(
                lambda: bench.status()["safe_state"]["confirmed"], "the safe state to be seen at the device", 10.0
            )


def test_pairs_and_triples_under_a_run(tmp_path: Path) -> None:
    with RunBench(tmp_path) as run:
        assert [f"{trial}: {trial.problem}" for trial in trials(run, 4, seed=5) if trial.problem] == []


@pytest.mark.parametrize("make", [CalibrationBench, ProbeBench])
def test_pairs_under_a_command_without_a_loop(tmp_path: Path, make: Callable[[Path], FaultBench]) -> None:
    with make(tmp_path) as held:
        assert [f"{trial}: {trial.problem}" for trial in trials(held, 2, seed=6) if trial.problem] == []


@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_with_all_four_lost_the_guardian_is_left(bench: FaultBench, number: int) -> None:
    bench.ready()
    pids = bench.pids()
    since_ns = time.monotonic_ns()
    for name in ("supervisor", "loop", "control", "recorder"):
        os.kill(pids[name], number)
    assert bench.ms_to_safe(since_ns) < 600.0
    for pid in pids.values():
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)


def test_with_every_process_lost_the_module_s_own_watchdog_is_left_and_a_new_daemon_opens_it(
    modbus: ModbusFaultBench,
) -> None:
    """Where the module was so slow that an I/O process has its line, that one is not lost, and writes the safe
    set-points."""
    modbus.ready()
    pids = modbus.pids()
    for name in ("guardian", "supervisor", "control", "loop", "recorder"):  # whoever comes later could still write
        os.kill(pids[name], signal.SIGKILL)
    modbus.wait(lambda: modbus.terminals.setpoints == (0.0, 0.0) or modbus.is_safe, "the watchdog of 0.5 s", 2.0)
    left = modbus.terminals.setpoints
    modbus.wait(lambda: not modbus.alive, "the end of the daemon")
    assert modbus.terminals.setpoints == left, "nobody is left who writes"
    modbus.ready()
    assert modbus.status()["fault"] is None


@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_an_emergency_stop_is_ok_when_the_device_took_it_and_not_before(bench: FaultBench, number: int) -> None:
    """With the supervisor lost and the loop stopped, where an ok once meant nothing."""
    bench.ready()
    pids = bench.pids()
    os.kill(pids["supervisor"], number)
    os.kill(pids["loop"], signal.SIGSTOP)
    with bench.client() as client:
        answer = client.estop()
    assert bench.is_safe
    assert (answer["safe"], answer["by"]) == (True, "control")


@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_a_daemon_that_is_told_to_end_leaves_no_pressure_behind(bench: FaultBench, number: int) -> None:
    bench.ready()
    pids = bench.pids()
    os.kill(pids["supervisor"], number)
    os.kill(pids["loop"], signal.SIGSTOP)
    bench.end()
    assert bench.is_safe
    assert bench.log_text().rstrip().endswith("seen at the device")


def test_the_command_knows_every_bench() -> None:
    assert tuple(BENCHES) == BENCH_NAMES


def test_every_pair_and_triple_is_drawn_by_both_signals() -> None:
    drawn = [draw(random.Random(f"{seed}")) for seed in range(2000)]
    assert {frozenset(blow.process for blow in blows) for blows in drawn if len(blows) == 3} == {
        frozenset(FaultBench.struck) - {left} for left in FaultBench.struck
    }
    assert len({tuple((blow.process, blow.number) for blow in blows) for blows in drawn if len(blows) == 2}) == 12 * 4
    assert all(blows[0].after_s == 0.0 and all(0.0 <= blow.after_s <= 0.5 for blow in blows) for blows in drawn)
