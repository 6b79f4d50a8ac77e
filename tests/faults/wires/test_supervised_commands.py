"""Calibrating and probing hold a rig by themselves: they, and whoever stands above them, are struck while the rig is
under pressure."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from drivers.modbus_io.settings import ExchangeMode
from hil.terminals import Terminals
from rig.app import compose, shipped, wire_locks
from rig.app.devices import probing
from rig.cli.commands import cli
from rig.qualify.faults.bench import RIG, SAFE_MPA, named_children
from rig.qualify.faults.wired import ModbusFaultBench
from rig.realtime.clock import MonotonicClock

KILL, STOP = signal.SIGKILL, signal.SIGSTOP


class Calibration:
    """`pamrig devices calibrate pressures`, waiting for somebody to read a gauge at 0.2 MPa, which is
    soon reached from the safe 0.15."""

    def __init__(self, folder: Path) -> None:
        self.terminals = Terminals.at(folder / "terminals")
        self.terminals.write(*SAFE_MPA)
        rig = folder / "rig.yaml"
        model = shipped.configs() / "models" / "simulated.yaml"
        rig.write_text(RIG.format(model=model, terminals=folder / "terminals"))
        command = [
            sys.executable,
            "-m",
            "rig.cli.main",
            "devices",
            "calibrate",
            "pressures",
            "--rig",
            str(rig),
            "--yes",
        ]
        command += ["--levels", "0.2,0.25", "--settle", "0.1", "-o", str(folder / "calibration.yaml")]
        pipe = subprocess.PIPE
        self._stderr = folder / "stderr"
        with self._stderr.open("wb") as stderr:
            self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=stderr)
        self.wait(lambda: self.terminals.setpoints == pytest.approx((0.2, 0.2)), "the level")
        self.pids = {"command": self.process.pid, **named_children(self.process.pid)}

    def wait(self, condition: Callable[[], bool], what: str, patience_s: float = 30.0) -> None:
        deadline = time.monotonic() + patience_s
        while not condition():
            assert time.monotonic() < deadline, f"{what}: {self.terminals.setpoints}, {self.said}"
            time.sleep(0.001)

    @property
    def said(self) -> str:
        return self._stderr.read_text()

    def ms_to_safe(self, since: float) -> float:
        self.wait(lambda: self.terminals.setpoints == SAFE_MPA, "the safe state", 5.0)
        return (time.monotonic() - since) * 1e3

    def close(self) -> None:
        for pid in self.pids.values():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
        assert self.process.stdin
        assert self.process.stdout
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.close()
        self.process.wait(20)
        self.process.stdout.close()
        self.wait(lambda: not any(Path(f"/proc/{pid}/fd").exists() for pid in self.pids.values()), "the end of all")


@pytest.fixture
def calibration(tmp_path: Path) -> Iterator[Calibration]:
    calibration = Calibration(tmp_path)
    yield calibration
    calibration.close()


@pytest.mark.parametrize(
    "blows",
    [
        {"command": KILL},
        {"command": STOP},
        {"supervisor": KILL, "command": KILL},
        {"supervisor": STOP, "command": STOP},
        {"guardian": KILL, "command": STOP},
    ],
    ids=str,
)
def test_the_rig_does_not_stay_under_pressure(calibration: Calibration, blows: dict[str, int]) -> None:
    since = time.monotonic()
    for name, number in blows.items():
        os.kill(calibration.pids[name], number)
    assert calibration.ms_to_safe(since) < 1500.0
    for pid in calibration.pids.values():
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)
    time.sleep(0.2)
    assert calibration.terminals.setpoints == SAFE_MPA


@pytest.mark.parametrize("name", ["supervisor", "guardian"])
@pytest.mark.parametrize("number", [KILL, STOP])
def test_without_those_above_it_the_command_gives_up(calibration: Calibration, name: str, number: int) -> None:
    since = time.monotonic()
    os.kill(calibration.pids[name], number)
    assert calibration.ms_to_safe(since) < 1500.0
    assert calibration.process.stdin
    calibration.process.stdin.write(b"0.2\n0.2\n")
    calibration.process.stdin.flush()
    assert calibration.process.wait(20) == 2
    assert "so it gave up" in calibration.said


def test_a_supervisor_that_ended_a_command_says_so_in_its_place(calibration: Calibration) -> None:
    os.kill(calibration.pids["command"], STOP)
    calibration.process.wait(5)
    calibration.wait(lambda: calibration.said.endswith("\n"), "the supervisor's word", 5.0)
    assert "the process that held the rig is gone or did not move; safe state written by" in calibration.said
    assert "seen at the device" in calibration.said


def test_the_guardian_says_so_where_the_supervisor_is_lost_too(calibration: Calibration) -> None:
    os.kill(calibration.pids["supervisor"], KILL)
    os.kill(calibration.pids["command"], STOP)
    calibration.process.wait(5)
    calibration.wait(lambda: calibration.said.endswith("\n"), "the guardian's word", 5.0)
    assert "safe state written by the guardian, seen at the device" in calibration.said
    assert calibration.said.count("safe state written by") == 1


def test_a_watchdog_that_takes_too_long_is_refused_before_anything_moves(tmp_path: Path) -> None:
    too_long_s = 60.0
    calls = (
        ["devices", "probe", "--step", "--ticks", "20", "--settle", "0.1"],
        ["devices", "calibrate", "pressures", "--levels", "0.2,0.3", "-o", str(tmp_path / "c.yaml")],
    )
    with ModbusFaultBench(tmp_path, too_long_s) as bench:
        written = bench.terminals.writes
        for call in calls:
            done = CliRunner().invoke(cli, [*call, "--yes", "--rig", str(bench.rig)])
            assert "its watchdog takes 60 s, longer than the rig's safe.watchdog_s, 1 s" in str(done.exception)
            assert bench.terminals.writes == written
        forced = CliRunner().invoke(cli, [*calls[0], "--yes", "--force", "--rig", str(bench.rig)])
        assert "its watchdog takes 60 s" in " ".join(forced.output.split()), forced.output
        assert bench.terminals.writes > written
        assert bench.is_safe


@pytest.fixture
def tripped(tmp_path: Path) -> Iterator[ModbusFaultBench]:
    """A computer that drove the module was lost."""
    with ModbusFaultBench(tmp_path) as bench:
        lost = compose.make_device(compose.load(bench.rig), MonotonicClock(), {"mode": ExchangeMode.SEPARATE})
        lost.open()
        lost.write(0.3, 0.3)
        bench.wait(lambda: bench.terminals.setpoints == (0.0, 0.0), "the module's own watchdog", 10.0)
        yield bench
        lost.close()


def _probed(bench: ModbusFaultBench, *more: str) -> Result:
    return CliRunner().invoke(cli, ["devices", "probe", "--ticks", "20", "--rig", str(bench.rig), *more])


def test_a_module_whose_watchdog_has_tripped_is_probed(tripped: ModbusFaultBench) -> None:
    """It was "device failure; close and open again", for ever: who only looks starts no watchdog."""
    line = str(_probed(tripped).exception)
    assert line.startswith("wago: its own watchdog has tripped, as when a computer is lost")
    assert f"`pamrig service safe --rig {tripped.rig}` does, and writes the safe pressures, 0.15 and 0.15 MPa" in line
    assert tripped.terminals.setpoints == (0.0, 0.0), "a probe moves nothing"
    assert CliRunner().invoke(cli, ["service", "safe", "--rig", str(tripped.rig)]).exit_code == 0
    assert tripped.is_safe
    done = _probed(tripped)
    assert "watchdog has tripped" not in f"{done.output} {done.exception}"


def test_a_probe_that_may_move_the_rig_starts_a_tripped_watchdog_anew(tripped: ModbusFaultBench) -> None:
    done = _probed(tripped, "--step", "--settle", "0.1", "--yes")
    assert "a watchdog had tripped: the safe state was written" in done.output
    assert "watchdog has tripped" not in f"{done.output} {done.exception}"
    assert tripped.is_safe


def test_a_tripped_watchdog_of_a_rig_that_somebody_drives_is_his(tripped: ModbusFaultBench) -> None:
    with wire_locks.held(compose.wires_of(compose.load(tripped.rig))):
        done = _probed(tripped, "--step", "--yes")
    assert ": reset it there" in str(done.exception)
    assert tripped.terminals.setpoints == (0.0, 0.0)


def test_a_probe_ends_with_whoever_drove_the_rig(tmp_path: Path) -> None:
    """Each of its readings fed the module's watchdog: the last set-points stayed for as long as it went on."""
    with ModbusFaultBench(tmp_path) as bench, contextlib.ExitStack() as driving:
        rig = compose.load(bench.rig)
        lost = compose.make_device(rig, MonotonicClock(), {"mode": ExchangeMode.SEPARATE})
        lost.open()
        driving.enter_context(wire_locks.held(compose.wires_of(rig)))
        lost.write(0.3, 0.3)
        found = probing.probe(rig, 4000, lambda done, _: driving.close() if done == 20 else None)
        (finding,) = found.findings
        assert "and now by nobody: reading ended here" in finding
        bench.wait(lambda: bench.terminals.setpoints == (0.0, 0.0), "the module's own watchdog", 10.0)
        lost.close()
