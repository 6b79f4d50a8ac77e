"""An emulated myRIO in virtual time for the tests of its driver, with a plant whose angle the test sets."""

import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from drivers.myrio.device import MyRio
from drivers.myrio.session import vendor_library
from drivers.myrio.settings import MyRioSettings
from hil.emulators.nifpga.bitfile import personality
from hil.emulators.nifpga.board import BoardWiring
from hil.emulators.nifpga.stand_in import StandIn
from hil.emulators.world import World
from rig.errors import RigError
from rig.interfaces import DeviceContext, Role
from rig.realtime.clock import VirtualClock

SIGNATURE_MISMATCH, INVALID_SESSION, RPC_SESSION, COMMUNICATION_TIMEOUT, FPGA_BUSY = (
    -63106,
    -63195,
    -63043,
    -61046,
    -61141,
)
TICK_NS = 5_000_000


class Turning:
    """Pressures follow at once; the angle is set by the test."""

    angle_deg = 0.0

    def step(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> tuple[float, float, float]:
        return p1_cmd_mpa, p2_cmd_mpa, self.angle_deg


@dataclass
class Lab:
    stand_in: StandIn
    world: World
    plant: Turning
    clock: VirtualClock
    settings: MyRioSettings
    context: DeviceContext

    @property
    def fpga(self):
        return self.stand_in.registers

    def device(self, **changes: object) -> MyRio:
        return MyRio(replace(self.settings, **changes), self.context)

    def tick(self) -> None:
        self.clock.wait_until_ns(self.clock.now_ns() + TICK_NS)


def lab_with(folder: Path, registers: list, resource: str = "RIO0") -> Lab:
    clock, plant = VirtualClock(), Turning()
    world = World(plant, clock, commands=(0.12, 0.34))
    stand_in = StandIn(world, folder, resource, BoardWiring(), registers)
    settings = MyRioSettings(Path(stand_in.settings["bitfile"]), resource)
    return Lab(stand_in, world, plant, clock, settings, DeviceContext(clock, frozenset(Role), 0.2, 0.2))


def paper_lab(tmp_path: Path) -> Iterator[Lab]:
    """A lab with the paper's registers, closed after the test; a module's fixture by `pytest.fixture(paper_lab)`."""
    made = lab_with(tmp_path, personality())
    yield made
    made.stand_in.close()


def refused(call, kind: type[RigError], *says: str) -> bool:
    """Whether the call raises this, in one line that says all of these."""
    with pytest.raises(kind) as caught:
        call()
    text = str(caught.value)
    assert "\n" not in text
    for part in says:
        assert part in text
    return True


def opened_when_let(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Every new session is opened once this is set."""
    open_at_once, let = vendor_library, threading.Event()

    def waiting() -> object:
        assert let.wait(30.0)
        return open_at_once()

    monkeypatch.setattr("nifpga.session._NiFpga", waiting)
    return let


def slow_to_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every new session takes 20 ms, as over a network."""
    open_at_once = vendor_library

    def slowly() -> object:
        time.sleep(0.02)
        return open_at_once()

    monkeypatch.setattr("nifpga.session._NiFpga", slowly)
