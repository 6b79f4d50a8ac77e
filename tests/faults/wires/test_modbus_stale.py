"""A gateway that passes nothing on any more and answers with what it heard before: what it says of the safe state is
not believed."""

import contextlib
from collections.abc import Iterator

import pytest
from support.rigs import fieldbus_rigs as rigs
from support.rigs.faulty_modbus import told
from support.rigs.stale_gateway import StaleGateway

from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.settings import ExchangeMode
from hil.emulators.emulation import Emulation
from rig.errors import DeviceError, DeviceLost
from rig.realtime.safe_report import Outcome
from rig.realtime.safe_state import SecondPath, look

MODES = [ExchangeMode.SEPARATE, ExchangeMode.COMBINED, ExchangeMode.PROCESS]


@pytest.fixture
def running() -> Emulation:
    return rigs.wago("stale")


@pytest.fixture
def gateway(running: Emulation) -> Iterator[StaleGateway]:
    gateway = StaleGateway(int(running.places["io"]))
    yield gateway
    gateway.stop()


@pytest.fixture(params=MODES)
def mode(request: pytest.FixtureRequest) -> ExchangeMode:
    chosen: ExchangeMode = request.param
    return chosen


@pytest.fixture
def device(mode: ExchangeMode, gateway: StaleGateway) -> Iterator[ModbusIo]:
    device = ModbusIo(rigs.modbus_settings(gateway.port, mode, reply_s=1.0), rigs.context())
    device.open()
    assert rigs.soon(lambda: seen_safe(device))
    yield device
    device.close()


def seen_safe(device: ModbusIo) -> bool:
    """What is said when the safe state was asked for."""
    with contextlib.suppress(DeviceError):  # an I/O process may have it on its way, or be told otherwise
        device.safe()
    return look(SecondPath.of(device)) is Outcome.SEEN


def driven(device: ModbusIo, running: Emulation) -> None:
    """Somewhere else, for some ticks."""
    device.write(0.4, 0.1)
    assert rigs.soon(lambda: told(running) == (0.4, 0.1))
    for _ in range(20):
        device.write(0.4, 0.1)
        device.read()


def test_a_safe_state_that_is_remembered_is_not_seen(
    running: Emulation, gateway: StaleGateway, device: ModbusIo
) -> None:
    """It was "seen at the device" while 0.4 MPa stood there: what was read back was the safe state of before."""
    driven(device, running)
    gateway.stale = True
    assert not rigs.soon(lambda: seen_safe(device), 1.0)
    assert told(running) == (0.4, 0.1)
    rescuer = ModbusIo(rigs.modbus_settings(gateway.port), rigs.context())
    assert not seen_safe(rescuer)
    rescuer.close()


def test_a_module_that_repeats_what_it_said_is_lost_when_it_is_driven(
    running: Emulation, gateway: StaleGateway, device: ModbusIo, mode: ExchangeMode
) -> None:
    gateway.stale, before = True, told(running)

    def drive() -> None:
        device.write(0.4, 0.1)
        device.read()

    assert rigs.soon(lambda: rigs.is_lost(drive), 5.0)
    with pytest.raises(DeviceLost, match=r"still says that the safe set-points stand|the line was lost while driving"):
        drive()
    if mode is ExchangeMode.PROCESS:  # who makes it safe now is another process, which has heard nothing before
        assert told(running) == before
        return
    assert not rigs.soon(lambda: seen_safe(device), 1.0)
