"""Everything that a Modbus line and its modules can do to us, on pymodbus' own server: named in one line, and none
moves the rig."""

import dataclasses
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient
from support.rigs import fieldbus_rigs as rigs

from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.settings import AngleChannel, Mode
from drivers.modbus_io.stations import Stations
from hil.emulators.emulation import Emulation
from rig.errors import DeviceError, DeviceLost
from rig.interfaces import Role
from rig.sample import Flag

HEALTHY = {"silence": False, "exception": 0, "late_s": 0.0, "cut": 0, "garble": -1, "only_unit": -1}
WHOLE = {"cut": [], "swapped_valves": False, "not_a_number": False}


@pytest.fixture(params=["tcp", "rtu"])
def running(request: pytest.FixtureRequest) -> Iterator[Emulation]:
    running = rigs.wago(f"faulty_{request.param}", rigs.BAUD if request.param == "rtu" else None)
    yield running
    _heal(running)


@pytest.fixture
def tcp() -> Iterator[Emulation]:
    running = rigs.wago("faulty_tcp")
    yield running
    _heal(running)


def _heal(running: Emulation) -> None:
    running.plug("io")
    running.trouble("io", **HEALTHY)
    running.damage("io", **WHOLE)


def made(running: Emulation, **changes: object) -> ModbusIo:
    """Quick to lose patience: the faults are waited for."""
    mode = Mode.SEPARATE if isinstance(running.places["io"], int) else Mode.AUTO
    return rigs.modbus(running, mode, **{"patience_s": 0.05, **changes})


@pytest.fixture
def device(running: Emulation) -> Iterator[ModbusIo]:
    device = made(running)
    yield device
    device.close()


def told(running: Emulation) -> tuple[float, float]:
    first, second = running.state()["commands_mpa"]
    return round(first, 3), round(second, 3)


def refusal(device: ModbusIo) -> str:
    with pytest.raises(DeviceLost if "tty" in str(device) else DeviceError) as caught:
        device.open()
    assert "\n" not in str(caught.value)
    device.close()
    return str(caught.value)


def error_of(call: Callable[[], object]) -> DeviceError:
    """What it says when it fails, within seconds."""
    found: list[DeviceError] = []

    def failed() -> bool:
        try:
            call()
        except DeviceError as error:
            found.append(error)
        return bool(found)

    assert rigs.soon(failed), "no error"
    assert "\n" not in str(found[0])
    return found[0]


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
    device = ModbusIo(rigs.modbus_settings(tcp.places["io"], Mode.SEPARATE), rigs.context(period_ns=50_000_000))
    device.open()
    tcp.trouble("io", silence=True)
    for call in (device.read, lambda: device.write(0.2, 0.2)):
        began = time.monotonic()
        with pytest.raises(DeviceError, match="no usable answer in time"):
            call()
        assert time.monotonic() - began < 1.0
    device.close()


def test_a_late_answer_is_never_taken_for_the_next_ones(tcp: Emulation) -> None:
    """The answer to a read under 0.3 MPa arrives while the next request waits: its number is another, so it is thrown
    away."""
    device = ModbusIo(rigs.modbus_settings(tcp.places["io"], Mode.SEPARATE, reply_s=0.03), rigs.context())
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
        device = ModbusIo(rigs.modbus_settings(modules.settings["port"], Mode.SEPARATE, map=table), rigs.context())
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
            angle=AngleChannel(0, reference_v=5.0),
        ),
        rigs.context(Role.ANGLE),
    )
    assert "no such register: wrong map, or wrong module" in refusal(device)


def test_a_module_that_says_another_name_is_refused(tmp_path: Path) -> None:
    other = tmp_path / "e1242.yaml"
    other.write_text((rigs.MAPS / "moxa_e1240.yaml").read_text().replace("text: E1240", "text: E1242"))
    with rigs.served(other, tmp_path) as modules:
        settings = rigs.modbus_settings(
            modules.settings["port"], map=rigs.MAPS / "moxa_e1240.yaml", angle=AngleChannel(0, reference_v=5.0)
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


def test_the_watchdog_of_the_module_acts_when_nobody_asks_any_more(tcp: Emulation) -> None:
    """Third layer: host gone, supervisor gone. The coupler goes to 0 V by itself; safe() arms it anew and gets
    through."""
    device = made(tcp, watchdog_s=0.3)
    assert "outputs to 0 after 0.3 s" in device.open()["failsafe"]
    device.write(0.3, 0.3)
    assert told(tcp) == (0.3, 0.3)
    assert rigs.soon(lambda: told(tcp) == (0.0, 0.0))
    assert "its watchdog may have tripped" in str(error_of(device.read))
    device.safe()
    assert told(tcp) == rigs.SAFE
    device.close()
    time.sleep(0.5)
    assert told(tcp) == rigs.SAFE, "close stops the watchdog, so outputs stay"


def test_a_module_whose_watchdog_has_tripped_can_be_opened_by_somebody_new(tcp: Emulation) -> None:
    lost = made(tcp, watchdog_s=0.3)
    lost.open()
    lost.write(0.3, 0.1)
    assert rigs.soon(lambda: told(tcp) == (0.0, 0.0)), "nobody closed it"
    device = made(tcp, watchdog_s=0.3)
    device.open()
    device.read()
    device.write(0.3, 0.1)
    assert rigs.soon(lambda: told(tcp) == (0.3, 0.1))
    device.close()
    lost.close()


def test_who_leaves_without_having_made_safe_leaves_the_watchdog_on(tcp: Emulation) -> None:
    """A module that refuses what it is written, and then its stop is the first thing that gets through."""
    device = made(tcp, watchdog_s=0.5)
    device.open()
    device.write(0.3, 0.1)
    tcp.trouble("io", exception=6)
    with pytest.raises(DeviceError):
        device.safe()
    tcp.trouble("io", exception=0)
    device.close()
    assert rigs.soon(lambda: told(tcp) == (0.0, 0.0)), "nobody is there, and nothing was made safe"


def test_a_safe_state_written_past_a_line_that_was_lost_stays(tcp: Emulation) -> None:
    """Nobody feeds the watchdog then: it took the safe set-points away again, under "seen at the device"."""
    device = made(tcp, watchdog_s=0.5)
    device.open()
    device.write(0.3, 0.1)
    tcp.unplug("io")
    tcp.plug("io")

    def made_safe() -> bool:
        try:
            device.safe()
        except DeviceError:
            return False
        return True

    assert rigs.soon(made_safe)
    assert not rigs.soon(lambda: told(tcp) != rigs.SAFE, 1.5)
    device.close()


@pytest.mark.parametrize("mode", [Mode.SEPARATE, Mode.PROCESS])
def test_who_only_looks_leaves_the_watchdog_of_whoever_drives(tcp: Emulation, mode: Mode) -> None:
    """`pamrig devices probe` beside a daemon: when the daemon then dies, its module still lets go."""
    driving = made(tcp, watchdog_s=0.5)
    driving.open()
    driving.write(0.25, 0.15)
    settings = rigs.modbus_settings(tcp.places["io"], mode)
    looking = ModbusIo(settings, dataclasses.replace(rigs.context(), looking=True))
    looking.open()
    assert looking.read().p1_mpa == pytest.approx(0.25, abs=0.2)
    looking.close()
    assert told(tcp) == (0.25, 0.15)
    assert rigs.soon(lambda: told(tcp) == (0.0, 0.0)), "nobody asks any more"
    driving.close()


def test_reading_keeps_the_watchdog_content(tcp: Emulation) -> None:
    device = made(tcp, watchdog_s=0.3)
    device.open()
    device.write(0.3, 0.3)

    def read() -> bool:
        device.read()
        return False

    rigs.soon(read, 0.8)
    assert told(tcp) == (0.3, 0.3)
    device.close()


def test_a_module_without_fail_safe_is_warned_about(tmp_path: Path) -> None:
    with rigs.served(rigs.MAPS / "adam_6024.yaml", tmp_path) as modules:
        device = ModbusIo(
            rigs.modbus_settings(modules.settings["port"], map=rigs.MAPS / "adam_6024.yaml"), rigs.context()
        )
        assert "holds its outputs when the host is gone" in device.open()["warning"]
        device.close()


REGISTERS = (
    "name: module with safe registers\nsource: made for this test\n"
    "inputs: {function: 4, address: 0, channels: 4, counts: [0, 4000], signal: [0, 10]}\n"
    "outputs: {address: 100, channels: 5, counts: [0, 4000], signal: [0, 10]}\n"
    "failsafe:\n  safe_is: registers\n  tick_s: 0.5\n"
    "  arm: [{address: 102, safe_channel: 0}, {address: 103, safe_channel: 1}, {address: 104, timeout: true}]\n"
)


def test_fail_safe_registers_get_the_safe_set_points(tmp_path: Path) -> None:
    """A module whose safe values are registers: what `arm` writes there are the counts of the safe pressures."""
    table = tmp_path / "registers.yaml"
    table.write_text(REGISTERS)
    with rigs.served(table, tmp_path) as modules:
        device = ModbusIo(rigs.modbus_settings(modules.settings["port"], Mode.SEPARATE, map=table), rigs.context())
        assert "outputs to the safe set-points after 30 s" in device.open()["failsafe"]
        assert modules.modules[0][1].output_registers()[2:] == [1680, 1520, 60]
        device.close()


def test_two_devices_on_one_module_keep_each_other_s_fail_safe_register(tmp_path: Path) -> None:
    """The second to be opened wrote 0 for the valve that it does not drive."""
    table = tmp_path / "registers.yaml"
    table.write_text(REGISTERS)
    with rigs.served(table, tmp_path) as modules:
        settings = rigs.modbus_settings(modules.settings["port"], Mode.SEPARATE, map=table)
        devices = [ModbusIo(settings, rigs.context(role)) for role in (Role.VALVE_1, Role.VALVE_2)]
        for device in devices:
            device.open()
        assert modules.modules[0][1].output_registers()[2:] == [1680, 1520, 60]
        for device in devices:
            device.close()


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
