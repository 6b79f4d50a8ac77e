"""One module, two who want to drive it: a daemon, a run and a safe state written by hand, over Modbus in real
processes."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from rig.errors import RigError
from rig.qualify.faults.wired import ModbusFaultBench


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModbusFaultBench]:
    with ModbusFaultBench(Path(tmp_path_factory.mktemp("two"))) as bench:
        yield bench


def command(*arguments: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-m", "rig.cli.main", *arguments], capture_output=True, text=True, check=False, timeout=150
    )


def words(text: str) -> str:
    return " ".join(text.split())


def test_a_run_beside_a_daemon_is_refused_and_moves_nothing(bench: ModbusFaultBench, tmp_path: Path) -> None:
    bench.at_rest()
    refused = command("run", str(bench.sweep), "--rig", str(bench.rig), "--out", str(tmp_path / "out"), "--force")
    assert refused.returncode != 0
    assert f"driven by process {bench.daemon_pid}" in words(refused.stderr)
    assert not list((tmp_path / "out").glob("*.mcap"))
    assert bench.status()["state"] == "disarmed"


def test_a_calibration_and_a_step_beside_a_daemon_are_refused(bench: ModbusFaultBench, tmp_path: Path) -> None:
    bench.at_rest()
    rig = "--rig", str(bench.rig), "--yes", "--force"
    step = command("devices", "probe", "--step", "--ticks", "20", *rig)
    assert step.returncode != 0
    assert "driven by process" in words(step.stdout + step.stderr)
    guided = command("devices", "calibrate", "pressures", "--levels", "0.2,0.25", "-o", str(tmp_path / "c.yaml"), *rig)
    assert guided.returncode != 0
    assert "driven by process" in words(guided.stdout + guided.stderr)


def test_the_safe_state_by_hand_is_not_called_safe_while_a_sweep_goes_on(bench: ModbusFaultBench) -> None:
    bench.ready()
    by_hand = command("service", "safe", "--rig", str(bench.rig))
    assert by_hand.returncode != 0
    assert "NOT SAFE" in words(by_hand.stderr)
    assert f"driven by process {bench.daemon_pid}" in words(by_hand.stderr)


def test_the_safe_state_by_hand_is_seen_once_the_daemon_is_gone(bench: ModbusFaultBench) -> None:
    bench.at_rest()
    bench.end()
    by_hand = command("service", "safe", "--rig", str(bench.rig))
    assert by_hand.returncode == 0, by_hand.stderr
    assert "seen at the device" in words(by_hand.stdout)


def test_a_daemon_without_its_loop_says_who_drives_the_rig(bench: ModbusFaultBench, tmp_path: Path) -> None:
    """What was seen at the device before another began is no news of the device any more."""
    bench.ready()
    os.kill(bench.pid("loop"), signal.SIGKILL)
    bench.wait(lambda: (bench.status()["safe_state"] or {}).get("confirmed"), "the safe state to be seen", 20.0)
    arguments = ["run", str(bench.sweep), "--rig", str(bench.rig), "--out", str(tmp_path / "out"), "--force"]
    other = subprocess.Popen([sys.executable, "-m", "rig.cli.main", *arguments], stderr=subprocess.PIPE)
    try:
        bench.wait(lambda: not bench.is_safe, "the other run to drive the rig", 150.0)
        status = bench.status()
        assert (status["safe_state"]["safe"], status["safe_state"]["confirmed"]) == (False, False)
        assert f"driven by process {other.pid}" in status["fault"]["said"]
        with bench.client() as client, pytest.raises(RigError, match=f"not carried out: .*process {other.pid}"):
            client.estop()
    finally:
        other.send_signal(signal.SIGINT)
        other.communicate(timeout=60)
    with bench.client() as client:
        client.estop()
    bench.wait(lambda: bench.is_safe, "the safe state", 5.0)


def test_a_daemon_that_opens_its_rig_is_no_stranger_to_its_own_emergency_stop(bench: ModbusFaultBench) -> None:
    """It was refused, and the operator told to stop the daemon that he asked."""
    bench.ready()
    os.kill(bench.pid("loop"), signal.SIGKILL)
    bench.wait(lambda: bench.fault() == "LOOP_DIED", "the fault", 20.0)
    said: list[str] = []

    def reset() -> None:
        with bench.client() as client, suppress(RigError):
            client.reset()

    resetting = threading.Thread(target=reset)
    resetting.start()
    while resetting.is_alive():
        try:
            with bench.client() as client:
                client.estop()
        except RigError as error:
            said.append(words(str(error)))
    assert not [line for line in said if f"process {bench.daemon_pid}" in line]
    bench.wait(lambda: bench.fault() != "", "the emergency stop to hold", 5.0)


def test_the_safe_state_by_hand_leaves_the_watchdog_to_whoever_drives(bench: ModbusFaultBench) -> None:
    """It was stopped then, and when all was lost later, the last set-points of the sweep stood for good."""
    bench.ready()
    assert command("service", "safe", "--rig", str(bench.rig)).returncode != 0
    bench.wait(lambda: not bench.is_safe, "the sweep to go on", 5.0)
    all_of_it = bench.pids().values()
    for blow in (signal.SIGSTOP, signal.SIGKILL):
        for pid in all_of_it:
            os.kill(pid, blow)
    bench.wait(lambda: bench.terminals.setpoints == (0.0, 0.0), "the module's own fail-safe", 5.0)
