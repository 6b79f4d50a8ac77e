"""What the edge to pymodbus says when a module refuses: where, what was asked of which register, and why."""

from types import SimpleNamespace

import pytest

from drivers.modbus_io.session import ModbusSession
from rig.errors import DeviceError, DeviceLost


def test_a_refused_register_is_named_in_both_ways_that_manuals_write_it() -> None:
    refusal = SimpleNamespace(isError=lambda: True, exception_code=2)
    client = SimpleNamespace(connected=True, read_holding_registers=lambda *_, **__: refusal)
    with pytest.raises(DeviceError) as error:
        ModbusSession(client, "wago:502").read(3, 8210, 1, 1)
    said = (
        "wago:502: reading 1 registers at address 8210 (0x2012): exception 2: it has no such register: wrong "
        "map, or wrong module"
    )
    assert str(error.value) == said


class Wire:
    """A socket on which so much waits after an exchange that failed, and as much again whenever it was read."""

    def __init__(self, waiting: int) -> None:
        self.waiting, self.reads = waiting, 0

    def setblocking(self, _: bool) -> None:
        pass

    def recv(self, most: int) -> bytes:
        self.reads += 1
        if not self.waiting:
            raise BlockingIOError
        if self.reads > 100:
            raise AssertionError("it never comes to an end")
        return bytes(min(self.waiting, most))


class Answering:
    """A client whose line is up, and which answers the next exchange."""

    connected = True

    def __init__(self, waiting: int) -> None:
        self.socket, self.closed = Wire(waiting), False

    def read_holding_registers(self, *_: object, **__: object) -> SimpleNamespace:
        return SimpleNamespace(function_code=3, registers=[7], isError=lambda: False)

    def close(self) -> None:
        self.closed = True


@pytest.mark.parametrize("waiting", [0, 260, 3 * 260])
def test_late_replies_are_thrown_away_before_the_next_exchange(waiting: int) -> None:
    session = ModbusSession(client := Answering(waiting), "module:502")
    session.doubtful = True
    assert session.read(3, 0, 1, 1) == [7]
    assert not client.closed


def test_a_module_that_never_stops_sending_is_lost_and_holds_up_no_tick() -> None:
    """Throwing away what came went on for as long as something came: a quarter of a second at once, on a fast line."""
    session = ModbusSession(client := Answering(1 << 20), "module:502")
    session.doubtful = True
    with pytest.raises(DeviceLost, match=r"^module:502: it sends without being asked$"):
        session.read(3, 0, 1, 1)
    assert client.closed
    assert client.socket.reads == 1
