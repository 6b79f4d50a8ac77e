"""Everything that a Modbus line and its modules can do to us, on pymodbus' own server: named in one line, and none
moves the rig."""

import dataclasses
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient
from support.rigs import fieldbus_rigs as rigs
from support.rigs.faulty_modbus import HEALTHY, error_of, made, told

from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.settings import ExchangeMode, ModbusAngleChannel
from drivers.modbus_io.stations import Stations
from hil.emulators.emulation import Emulation
from rig.errors import DeviceError, DeviceLost
from rig.interfaces import Role
from rig.sample import Flag

pytest_plugins = "support.rigs.faulty_modbus_rig"


@pytest.fixture
def device(running: Emulation) -> Iterator[ModbusIo]:
    device = made(running)
    yield device
    device.close()


def refusal(device: ModbusIo) -> str:
    with pytest.raises(DeviceLost if "tty" in str(device) else DeviceError) as caught:
        device.open()
    assert "\n" not in str(caught.value)
    device.close()
    return str(caught.value)


def healed(device: ModbusIo) -> bool:
    """Whether reading works, with a fresh start where the device asks for one."""
    try:
        return not device.read().flags & Flag.P1_ABSENT
    except DeviceLost:
        device.close()
        device.open()
    except DeviceError:
        pass
    return False


def test_the_wrong_unit_id_is_named_and_moves_nothing(running: Emulation) -> None:
    text = refusal(made(running, unit=9))
    assert "unit id" in text or "no usable answer in time" in text
    assert told(running) == rigs.LEFT_AT


@pytest.mark.parametrize(
    ("code", "says"), [(1, "does not know this function"), (2, "no such register"), (4, "device failure"), (6, "busy")]
)
def test_exception_replies_are_errors_with_their_reason(
    running: Emulation, device: ModbusIo, code: int, says: str
) -> None:
    """pymodbus does not raise for them: whoever forgets isError() reads nonsense."""
    device.open()
    running.trouble("io", exception=code)
    assert says in str(error_of(device.read))
    running.trouble("io", **HEALTHY)
    assert rigs.soon(lambda: healed(device), 10.0)


@pytest.mark.parametrize("trouble", [{"silence": True}, {"cut": 3}, {"garble": 7}, {"garble": 0}, {"only_unit": 9}])
def test_bad_frames_are_errors_then_heal(running: Emulation, device: ModbusIo, trouble: dict[str, object]) -> None:
    device.open()
    device.write(0.3, 0.1)
    assert rigs.soon(lambda: told(running) == (0.3, 0.1))
    running.trouble("io", **trouble)
    error_of(device.read)
    running.trouble("io", **HEALTHY)
    assert rigs.soon(lambda: healed(device), 10.0)
    assert told(running) in ((0.3, 0.1), rigs.SAFE)


def test_every_call_is_bounded_when_the_module_is_silent(tcp: Emulation) -> None:
    """Longer than 5 periods would be pymodbus' own 3 s; the loop must not wait for that."""
    device = ModbusIo(rigs.modbus_settings(tcp.places["io"], ExchangeMode.SEPARATE), rigs.context(period_ns=50_000_000))
    device.open()
    tcp.trouble("io", silence=True)
    for call in (device.read, lambda: device.write(0.2, 0.2)):
        began = time.monotonic()
        with pytest.raises(DeviceError, match="no usable answer in time"):
            call()
        assert time.monotonic() - began < 1.0
    device.close()


def test_a_module_that_does_not_answer_is_waited_for_once_a_connection(
    tcp: Emulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its watchdog was to be armed anew between two attempts to write, each waited for in one tick of the loop."""
    device = made(tcp)
    device.open()
    armed: list[object] = []
    monkeypatch.setattr("drivers.modbus_io.failsafe.arm", lambda *steps: armed.append(steps) or {})
    tcp.trouble("io", silence=True)
    with pytest.raises(DeviceError, match="no usable answer in time"):
        device.safe()
    assert armed == []
    device.close()


def test_a_late_answer_is_never_taken_for_the_next_ones(tcp: Emulation) -> None:
    """The answer to a read under 0.3 MPa arrives while the next request waits: its number is another, so it is thrown
    away."""
    device = ModbusIo(rigs.modbus_settings(tcp.places["io"], ExchangeMode.SEPARATE, reply_s=0.03), rigs.context())
    device.open()
    device.write(0.4, 0.4)
    assert rigs.soon(lambda: abs(device.read().p1_mpa - 0.4) < 0.01)
    tcp.trouble("io", late_s=0.05)
    with pytest.raises(DeviceError):
        device.read()
    tcp.trouble("io", **HEALTHY)
    tcp.leave_at(0.1, 0.1)
    assert rigs.soon(lambda: tcp.state()["outputs"][0] < 0.11)
    for _ in range(20):
        try:
            assert device.read().p1_mpa < 0.15
        except DeviceError:
            continue
    device.close()


def test_a_broken_monitor_wire_has_no_pressure(running: Emulation, device: ModbusIo) -> None:
    device.open()
    assert rigs.soon(lambda: healed(device))
    running.damage("io", cut=["monitor_2"])
    assert rigs.soon(lambda: bool(device.read().flags & Flag.BROKEN_WIRE))
    now = device.read()
    assert now.p2_mpa != now.p2_mpa
    assert now.p2_raw == pytest.approx(0.0, abs=0.01)
    assert rigs.soon(lambda: 0.1 < device.read().p1_mpa < 0.14), "the other monitor still follows its valve"
    assert told(running) == rigs.LEFT_AT


@pytest.mark.parametrize("wire", ["wiper", "excitation"])
def test_an_open_potentiometer_has_no_angle(running: Emulation, device: ModbusIo, wire: str) -> None:
    device.open()
    running.damage("io", cut=[wire])
    assert rigs.soon(lambda: bool(device.read().flags & Flag.SUSPECT))
    now = device.read()
    assert now.flags & Flag.ANGLE_ABSENT
    assert now.angle_deg != now.angle_deg


def test_not_a_number_from_a_float_module_reaches_nobody(tmp_path: Path) -> None:
    """A module of float channels whose scaling went wrong sends NaN: no value, a flag, and no output of it."""
    table = tmp_path / "floats.yaml"
    table.write_text(
        "name: float module\nsource: made for this test\n"
        "inputs: {function: 4, address: 10, channels: 4, type: float32, word_order: little, counts: [0, 10], signal: "
        "[0, 10]}\n"
        "outputs: {address: 100, channels: 2, type: float32, word_order: little, counts: [0, 10], signal: [0, 10]}\n"
    )
    with rigs.served(table, tmp_path) as modules:
        device = ModbusIo(
            rigs.modbus_settings(modules.settings["port"], ExchangeMode.SEPARATE, map=table), rigs.context()
        )
        device.open()
        assert device.read().p1_mpa == pytest.approx(0.12, abs=0.001)
        modules.modules[0][1].damage.not_a_number = True
        now = device.read()
        assert now.p1_mpa != now.p1_mpa
        assert now.flags & Flag.BROKEN_WIRE
        assert now.flags & Flag.ANGLE_ABSENT
        device.close()


def test_swapped_valves_show_at_the_other_monitor(tcp: Emulation) -> None:
    device = made(tcp)
    device.open()
    device.write(0.2, 0.2)
    assert rigs.soon(lambda: abs(device.read().p2_mpa - 0.2) < 0.01)
    tcp.damage("io", swapped_valves=True)
    device.write(0.3, 0.2)
    assert rigs.soon(lambda: device.read().p2_mpa > 0.28)
    assert device.read().p1_mpa < 0.22
    device.close()


def test_another_module_than_the_maps_is_refused(tcp: Emulation) -> None:
    device = ModbusIo(
        dataclasses.replace(
            rigs.modbus_settings(tcp.places["io"]),
            map=rigs.MAPS / "moxa_e1240.yaml",
            angle=ModbusAngleChannel(0, reference_v=5.0),
        ),
        rigs.context(Role.ANGLE),
    )
    assert "no such register: wrong map, or wrong module" in refusal(device)


def test_a_module_that_says_another_name_is_refused(tmp_path: Path) -> None:
    other = tmp_path / "e1242.yaml"
    other.write_text((rigs.MAPS / "moxa_e1240.yaml").read_text().replace("text: E1240", "text: E1242"))
    with rigs.served(other, tmp_path) as modules:
        settings = rigs.modbus_settings(
            modules.settings["port"], map=rigs.MAPS / "moxa_e1240.yaml", angle=ModbusAngleChannel(0, reference_v=5.0)
        )
        assert "says 'E1242', but the map is for Moxa ioLogik E1240" in refusal(
            ModbusIo(settings, rigs.context(Role.ANGLE))
        )


def test_nobody_at_the_address_is_named() -> None:
    text = refusal(rigs.ModbusIo(rigs.modbus_settings(1, connect_s=0.2), rigs.context()))
    assert text == "127.0.0.1:1: no connection within 0.2 s: check address, port, cable and power"


def test_an_unknown_serial_port_is_named() -> None:
    text = refusal(rigs.ModbusIo(rigs.modbus_settings("/dev/ttyNO8"), rigs.context()))
    assert "/dev/ttyNO8: cannot be opened" in text


def test_a_bug_while_opening_leaves_no_line_open(tcp: Emulation, monkeypatch: pytest.MonkeyPatch) -> None:
    lines: list[Stations] = []

    def buggy(stations: Stations) -> tuple[float, float]:
        lines.append(stations)
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr("drivers.modbus_io.device.round_trip", buggy)
    with pytest.raises(ZeroDivisionError):
        rigs.modbus(tcp).open()
    assert not lines[0].outputs.client.connected


def test_the_server_is_pymodbus_itself(tcp: Emulation) -> None:
    """The emulator speaks the protocol to any client: function 23 by the bare package, inputs back and outputs set."""
    client = ModbusTcpClient("127.0.0.1", port=tcp.places["io"])
    assert client.connect()
    answer = client.readwrite_registers(
        read_address=0, read_count=4, write_address=0, values=[16384, 8192], device_id=1
    )
    client.close()
    assert not answer.isError()
    assert len(answer.registers) == 4
    assert told(tcp) == (0.25, 0.125)
