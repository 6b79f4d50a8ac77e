"""A run on a myRIO whose loop is killed: the supervisor makes the outputs safe through a session of its own.

The emulated FPGA lives in this test's process, as hardware lives outside of pamrig's; `pamrig run` drives it by the
lab's YAML.
"""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
import pytest
import yaml
from conftest import CONFIGS

from hil.emulators.nifpga.bitfile import personality
from hil.emulators.nifpga.board import BoardWiring
from hil.emulators.nifpga.stand_in import StandIn
from hil.emulators.world import World
from rig.model.chain import Chain
from rig.model.parameters import load_model
from rig.realtime.clock import MonotonicClock

SAFE = (0.2, 0.2)
RESOURCE = f"RIO{os.getpid()}"
"""One process of the machine drives a RIO: tests beside these have one of their own."""
SWEEP = """
name: soon moving
p0_mpa: 0.2
settle_s: 0.2
zero_s: 0.1
ramp_in_s: 0.2
duration_s: 30.0
ramp_out_s: 0.2
records:
  - sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}
"""


class Lab:
    """An FPGA with a plant that goes with real time, whoever holds a session on it."""

    def __init__(self, folder: Path) -> None:
        chain = Chain(load_model(CONFIGS / "models/simulated.yaml"))
        chain.reset(*SAFE)
        self.world = World(chain, MonotonicClock(), commands=SAFE)
        self.stand_in = StandIn(self.world, folder, RESOURCE, BoardWiring(), personality())
        rig = yaml.safe_load((CONFIGS / "rigs/paper_myrio.yaml").read_text())
        rig["devices"]["myrio"] |= {"bitfile": self.stand_in.settings["bitfile"], "resource": RESOURCE}
        # a busy test machine must not end the run before the fault does
        rig["limits"] |= {"stall_periods": 60, "misses_per_s": 200}
        self.yaml = folder / "rig.yaml"
        self.yaml.write_text(yaml.safe_dump(rig))
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.wait(0.001):
            self.stand_in.board.poll()

    def close(self) -> None:
        self._over.set()
        self._thread.join()
        self.stand_in.close()

    @property
    def apart_mpa(self) -> float:
        """How far the regulators' set-points lie from the safe pressures."""
        return max(abs(a - b) for a, b in zip(self.world.commands, SAFE, strict=True))


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    made = Lab(tmp_path)
    yield made
    made.close()


def until(so, seconds: float = 30.0) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if so():
            return True
        time.sleep(0.002)
    return bool(so())


@contextmanager
def moving(lab: Lab, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """`pamrig run` on the lab's rig, once its sweep has left the safe pressures."""
    code = "from rig.cli.main import main; main()"
    (tmp_path / "sweep.yaml").write_text(SWEEP)
    run = ["run", str(tmp_path / "sweep.yaml"), "--rig", str(lab.yaml), "--out", str(tmp_path / "out"), "--force"]
    command = subprocess.Popen(
        [sys.executable, "-c", code, *run], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert until(lambda: lab.apart_mpa > 0.05 or command.poll() is not None), "the sweep never began"
        assert command.poll() is None, command.communicate()
        yield command
    finally:
        if command.poll() is None:
            command.kill()
        command.communicate()


@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGSTOP])
def test_a_loop_that_is_gone_is_made_safe_by_the_supervisors_own_session(
    lab: Lab, tmp_path: Path, blow: signal.Signals
) -> None:
    with moving(lab, tmp_path) as command:
        loop = loop_of(command.pid)
        os.kill(loop, blow)
        assert until(lambda: lab.apart_mpa < 0.001, 10.0), lab.world.commands
        if blow is signal.SIGSTOP:
            os.kill(loop, signal.SIGCONT)
        assert command.wait(60) == 1
        assert lab.apart_mpa < 0.001


@pytest.mark.parametrize(
    ("what", "says"),
    [
        ("session", "the connection to the device is gone"),
        ("monitor_1", "live zero"),
        ("wiper", "a sensor kept giving values"),
    ],
)
def test_what_happens_to_the_wires_ends_the_run_safely(lab: Lab, tmp_path: Path, what: str, says: str) -> None:
    with moving(lab, tmp_path) as command:
        if what == "session":
            lab.stand_in.registers.lose_sessions()
        else:
            lab.stand_in.board.cut(what)
        assert until(lambda: lab.apart_mpa < 0.001, 10.0), lab.world.commands
        assert command.wait(60) == 1
        assert lab.apart_mpa < 0.001
        assert command.stderr is not None
        assert says in command.stderr.read()


def _has_the_registers(process: psutil.Process) -> bool:
    with suppress(psutil.NoSuchProcess):  # one that only helped another to start
        return any(area.path.endswith(f"/{RESOURCE}") for area in process.memory_maps())
    return False


def loop_of(pid: int) -> int:
    """The loop's process: of the two that map the FPGA's registers, the one that was there first."""
    holders = [child.pid for child in psutil.Process(pid).children(recursive=True) if _has_the_registers(child)]
    assert len(holders) == 2, "the loop and, standing by, the supervisor"
    return min(holders)
