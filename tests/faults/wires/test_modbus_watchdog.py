"""The watchdog and the fail-safe registers of a Modbus module: it lets go when nobody asks any more, and keeps what
whoever drives it wrote."""

import dataclasses
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.rigs import fieldbus_rigs as rigs
from support.rigs.faulty_modbus import error_of, heal, made, told

from drivers.modbus_io import device as modbus_device
from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.link import ModbusLink
from drivers.modbus_io.settings import ExchangeMode
from hil.emulators.emulation import Emulation
from rig.errors import DeviceError, WatchdogTripped
from rig.interfaces import Role

pytest_plugins = "support.rigs.faulty_modbus_rig"

REGISTERS = (
    "name: module with safe registers\nsource: made for this test\n"
    "inputs: {function: 4, address: 0, channels: 4, counts: [0, 4000], signal: [0, 10]}\n"
    "outputs: {address: 100, channels: 5, counts: [0, 4000], signal: [0, 10]}\n"
    "failsafe:\n  safe_is: registers\n  tick_s: 0.5\n"
    "  arm: [{address: 102, safe_channel: 0}, {address: 103, safe_channel: 1}, {address: 104, timeout: true}]\n"
)


def made_safe(device: ModbusIo) -> bool:
    try:
        device.safe()
    except DeviceError:
        return False
    return True


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

    assert rigs.soon(lambda: made_safe(device))
    assert not rigs.soon(lambda: told(tcp) != rigs.SAFE, 1.5)
    device.close()


@pytest.fixture
def link(tcp: Emulation) -> Iterator[ModbusLink]:
    """As an I/O process on TCP drives it, connected, with a watchdog that acts soon."""
    settings = rigs.modbus_settings(tcp.places["io"], ExchangeMode.PROCESS, watchdog_s=0.3, patience_s=0.05)
    link = ModbusLink(settings, rigs.context().roles, safe_numbers(tcp))
    link.connect()
    yield link
    link.close()
    link._loop.close()  # noqa: SLF001  # its process takes it with it


def safe_numbers(tcp: Emulation) -> dict[int, float]:
    return made(tcp).numbers(*rigs.SAFE)


def outputs_of(tcp: Emulation) -> tuple[float, float]:
    safe = safe_numbers(tcp)
    return safe[0], safe[1]


def test_one_exchange_that_failed_long_ago_leaves_no_watchdog_behind(tcp: Emulation, link: ModbusLink) -> None:
    """An I/O process on TCP took its line for dead from then on, and did not stop the watchdog at the end: 0 MPa half a
    second after "seen at the device"."""
    outputs = outputs_of(tcp)
    tcp.trouble("io", exception=6)
    with pytest.raises(DeviceError, match="it is busy"):
        link.exchange(outputs, fresh=True, urgent=False)
    tcp.trouble("io", exception=0)
    assert link.exchange(outputs, fresh=True, urgent=True).sent
    assert told(tcp) == rigs.SAFE
    link.close(settled=True)
    assert not rigs.soon(lambda: told(tcp) != rigs.SAFE, 0.6)


def test_the_last_exchange_that_failed_leaves_no_watchdog_behind(tcp: Emulation, link: ModbusLink) -> None:
    """The safe set-points stood, and a reading after them was lost: 0 MPa, as above."""
    assert link.exchange(outputs_of(tcp), fresh=True, urgent=True).sent
    tcp.trouble("io", silence=True)
    with pytest.raises(DeviceError, match="no usable answer in time"):
        link.exchange(outputs_of(tcp), fresh=False, urgent=False)
    tcp.trouble("io", silence=False)
    link.close(settled=True)
    assert not rigs.soon(lambda: told(tcp) != rigs.SAFE, 0.6)


def test_a_stop_of_the_watchdog_that_is_refused_once_is_asked_for_again(tcp: Emulation, link: ModbusLink) -> None:
    """A busy module, or a gateway that has lost the request: "seen at the device", and 0 MPa as above."""
    assert link.exchange(outputs_of(tcp), fresh=True, urgent=True).sent
    tcp.trouble("io", refuse_next=1)
    link.close(settled=True)
    assert not rigs.soon(lambda: told(tcp) != rigs.SAFE, 0.6)


def test_the_loop_itself_asks_again_as_well(tcp: Emulation) -> None:
    device = made(tcp, watchdog_s=0.3)
    device.open()
    device.write(0.3, 0.1)
    device.safe()
    tcp.trouble("io", refuse_next=1)
    device.close()
    assert not rigs.soon(lambda: told(tcp) != rigs.SAFE, 0.6)


@pytest.mark.parametrize("error", [DeviceError("late"), KeyboardInterrupt()])
def test_an_opening_that_comes_to_no_end_leaves_no_watchdog_behind(
    tcp: Emulation, error: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Armed, and given up while its round trip was measured: what had stood for hours went to 0 MPa."""
    tcp.leave_at(0.25, 0.15)

    def given_up(_: object) -> None:
        raise error

    monkeypatch.setattr(modbus_device, "round_trip", given_up)
    with pytest.raises(type(error)):
        made(tcp, watchdog_s=0.3).open()
    assert not rigs.soon(lambda: told(tcp) != (0.25, 0.15), 0.6)


def test_who_has_not_come_to_the_outputs_leaves_the_watchdog_on(tcp: Emulation, link: ModbusLink) -> None:
    """Its line was lost and is back, and it was told to go before it wrote: the module's own watchdog is what is
    left."""
    tcp.leave_at(0.3, 0.1)
    link.close()
    assert rigs.soon(lambda: told(tcp) == (0.0, 0.0)), "old set-points would stand for ever"


@pytest.mark.parametrize("mode", [ExchangeMode.SEPARATE, ExchangeMode.PROCESS])
def test_who_only_looks_leaves_the_watchdog_of_whoever_drives(tcp: Emulation, mode: ExchangeMode) -> None:
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


@pytest.fixture
def rtu() -> Iterator[Emulation]:
    running = rigs.wago("faulty_rtu", rigs.BAUD)
    yield running
    heal(running)


def _looking(running: Emulation) -> ModbusIo:
    """With a watchdog that would act soon if it were armed."""
    settings = rigs.modbus_settings(running.places["io"], ExchangeMode.AUTO, watchdog_s=0.3)
    return ModbusIo(settings, dataclasses.replace(rigs.context(), looking=True))


def test_who_only_looks_at_a_serial_line_arms_nothing(rtu: Emulation) -> None:
    """Its I/O process did not know that it only looked: it armed the module's watchdog, and stopped it at the end."""
    rtu.leave_at(0.25, 0.15)
    looking = _looking(rtu)
    looking.open()
    assert rigs.soon(lambda: looking.read().p1_mpa > 0.0)
    rtu.unplug("io")
    assert not rigs.soon(lambda: told(rtu) != (0.25, 0.15), 1.0), "an armed watchdog hears nobody, and acts"
    looking.close()


def test_who_only_looks_at_a_serial_line_starts_no_watchdog_that_has_tripped(rtu: Emulation) -> None:
    lost = made(rtu, watchdog_s=0.3)
    lost.open()
    lost.write(0.3, 0.1)
    rtu.unplug("io")
    assert rigs.soon(lambda: told(rtu) == (0.0, 0.0))
    lost.close()
    rtu.plug("io")
    with pytest.raises(WatchdogTripped, match="its watchdog may have tripped"):
        _looking(rtu).open()
    assert told(rtu) == (0.0, 0.0)
    again = made(rtu)
    again.open()
    again.close()


def test_who_only_looks_makes_safe_when_he_is_told_to(rtu: Emulation) -> None:
    """He holds the port, so that `pamrig service safe` comes to him."""
    looking, outside = _looking(rtu), made(rtu)
    looking.open()

    assert rigs.soon(lambda: made_safe(outside))
    assert told(rtu) == rigs.SAFE
    looking.close()
    outside.close()


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


def test_fail_safe_registers_get_the_safe_set_points(tmp_path: Path) -> None:
    """A module whose safe values are registers: what `arm` writes there are the counts of the safe pressures."""
    table = tmp_path / "registers.yaml"
    table.write_text(REGISTERS)
    with rigs.served(table, tmp_path) as modules:
        device = ModbusIo(
            rigs.modbus_settings(modules.settings["port"], ExchangeMode.SEPARATE, map=table), rigs.context()
        )
        assert "outputs to the safe set-points after 30 s" in device.open()["failsafe"]
        assert modules.modules[0][1].output_registers()[2:] == [1680, 1520, 60]
        device.close()


def test_two_devices_on_one_module_keep_each_other_s_fail_safe_register(tmp_path: Path) -> None:
    """The second to be opened wrote 0 for the valve that it does not drive."""
    table = tmp_path / "registers.yaml"
    table.write_text(REGISTERS)
    with rigs.served(table, tmp_path) as modules:
        settings = rigs.modbus_settings(modules.settings["port"], ExchangeMode.SEPARATE, map=table)
        devices = [ModbusIo(settings, rigs.context(role)) for role in (Role.VALVE_1, Role.VALVE_2)]
        for device in devices:
            device.open()
        assert modules.modules[0][1].output_registers()[2:] == [1680, 1520, 60]
        for device in devices:
            device.close()
