"""Outputs and inputs in two modules, of which the one with the inputs is lost: the valves' module answers, and nothing
may stand in the way of its safe set-points."""

import contextlib
import os
import signal
from collections.abc import Callable, Iterator

import pytest
from support.rigs import fieldbus_rigs as rigs

from drivers.io_process.lookup import path_for
from drivers.io_process.mailbox import attach
from drivers.mixed import MixedRig
from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.settings import ExchangeMode
from hil.emulators.emulation import Emulation
from rig.errors import DeviceError
from rig.interfaces import Role
from rig.realtime.clock import MonotonicClock
from rig.realtime.commands import Mailbox
from rig.realtime.faults import Fault
from rig.realtime.loop import Loop, LoopSettings
from rig.realtime.ring import Ring, RingWriter

INPUT_UNIT = 2


@pytest.fixture
def tcp() -> Iterator[Emulation]:
    running = rigs.pair("pair_tcp")
    yield running
    running.plug("in")


@pytest.fixture
def rtu() -> Iterator[Emulation]:
    running = rigs.pair("pair_rtu", rigs.BAUD)
    running.trouble("io", dead_unit=-1)
    yield running
    running.trouble("io", dead_unit=-1)


def made(running: Emulation, mode: ExchangeMode = ExchangeMode.AUTO) -> ModbusIo:
    return ModbusIo(rigs.pair_settings(running, mode, patience_s=0.05), rigs.context())


def told(running: Emulation) -> tuple[float, ...]:
    return tuple(round(at, 2) for at in running.state()["commands_mpa"])


def holds(device: ModbusIo) -> bool:
    try:
        device.safe()
        return device.holds_safe() is True
    except DeviceError:
        return False


def lost(device: ModbusIo) -> Callable[[], bool]:
    def tick() -> None:
        device.read()
        device.write(0.3, 0.3)

    return lambda: rigs.is_lost(tick)


def test_who_comes_from_outside_makes_safe_without_the_input_module(tcp: Emulation) -> None:
    driving = made(tcp, ExchangeMode.SEPARATE)
    driving.open()
    driving.write(0.3, 0.3)
    tcp.unplug("in")
    outside = made(tcp)
    outside.safe()
    assert outside.holds_safe() is True
    assert told(tcp) == rigs.SAFE
    driving.close()


def test_who_comes_from_outside_makes_safe_on_a_bus_without_the_input_module(rtu: Emulation) -> None:
    rtu.trouble("io", dead_unit=INPUT_UNIT)
    outside = made(rtu)
    outside.safe()
    assert outside.holds_safe() is True
    assert told(rtu) == rigs.SAFE
    outside.close()


def test_an_input_module_that_is_lost_while_driving_leaves_no_pressure(rtu: Emulation) -> None:
    """The line counts as lost then; the outputs are within reach all the same."""
    driving = made(rtu)
    driving.open()
    driving.write(0.3, 0.3)
    assert rigs.soon(lambda: told(rtu) == (0.3, 0.3))
    rtu.trouble("io", dead_unit=INPUT_UNIT)
    assert rigs.soon(lost(driving))
    assert rigs.soon(lambda: told(rtu) == rigs.SAFE)
    assert rigs.soon(lambda: holds(driving))
    driving.close()
    assert told(rtu) == rigs.SAFE


def test_an_input_module_that_is_lost_together_with_the_process_of_the_wire(rtu: Emulation) -> None:
    driving = made(rtu)
    driving.open()
    driving.write(0.3, 0.3)
    assert rigs.soon(lambda: told(rtu) == (0.3, 0.3))
    rtu.trouble("io", dead_unit=INPUT_UNIT)
    behind = attach(path_for(rtu.places["io"]))
    assert behind is not None
    os.kill(behind.pid, signal.SIGKILL)
    behind.close()
    assert rigs.soon(lambda: holds(driving), 10.0)
    assert told(rtu) == rigs.SAFE
    driving.close()


@pytest.mark.parametrize("kind", ["tcp", "rtu"])
def test_inputs_are_read_again_after_an_outage_in_which_nothing_was_driven(
    kind: str, request: pytest.FixtureRequest
) -> None:
    running: Emulation = request.getfixturevalue(kind)
    device = made(running, ExchangeMode.PROCESS if kind == "tcp" else ExchangeMode.AUTO)
    device.open()

    def reads() -> bool:
        try:
            return device.read().p1_age_ns < 200_000_000
        except DeviceError:
            return False

    assert rigs.soon(reads)
    bus = "in" if kind == "tcp" else "io"
    running.unplug(bus)
    assert rigs.soon(lambda: not reads())
    running.plug(bus)
    assert rigs.soon(reads, 10.0)
    device.close()


@pytest.mark.parametrize("mode", [ExchangeMode.SEPARATE, ExchangeMode.PROCESS])
def test_a_module_with_valves_only_is_fed_while_nothing_is_driven(mode: ExchangeMode) -> None:
    """Its watchdog took the safe set-points away from a disarmed rig, which said that they had been seen."""
    running = rigs.wago("valves_only")
    settings = rigs.modbus_settings(running.places["io"], mode, watchdog_s=0.3)
    with contextlib.closing(ModbusIo(settings, rigs.context(Role.VALVE_1, Role.VALVE_2))) as device:
        device.open()
        device.safe()
        assert not rigs.soon(lambda: bool(device.read()) and told(running) != rigs.SAFE, 1.0)
        assert device.holds_safe() is True
        device.write(0.3, 0.3)
        assert rigs.soon(lambda: told(running) == (0.3, 0.3))


def test_outputs_that_stand_still_beside_another_input_module_are_fed() -> None:
    running = rigs.pair("fed_pair", rigs.BAUD, "wago")
    settings = rigs.pair_settings(running, map=rigs.MAPS / "wago_750.yaml", watchdog_s=0.3, patience_s=0.1)
    with contextlib.closing(ModbusIo(settings, rigs.context())) as device:
        device.open()
        device.write(0.3, 0.3)
        assert rigs.soon(lambda: told(running) == (0.3, 0.3))
        assert not rigs.soon(lambda: bool(device.read()) and told(running) != (0.3, 0.3), 1.0)


def test_a_device_that_holds_is_fed_after_another_of_the_rig_was_lost() -> None:
    """The loop asks nobody any more then; the module with the valves went from its safe set-points to 0 V."""
    running, lost = rigs.wago("mixed_valves"), rigs.pair("mixed_inputs")
    clock = MonotonicClock()
    valves = ModbusIo(
        rigs.modbus_settings(running.places["io"], ExchangeMode.SEPARATE, watchdog_s=0.3),
        rigs.context(Role.VALVE_1, Role.VALVE_2),
    )
    inputs = rigs.modbus_settings(
        lost.places["in"], ExchangeMode.SEPARATE, map=rigs.MAPS / "moxa_e1240.yaml", patience_s=0.05
    )
    rest = ModbusIo(inputs, rigs.context(Role.MONITOR_1, Role.MONITOR_2, Role.ANGLE))
    rig = MixedRig([valves, rest], clock, rigs.PERIOD_NS)
    rig.open()
    settings = LoopSettings(rigs.PERIOD_NS, *rigs.SAFE)
    loop = Loop(rig, clock, RingWriter(Ring.private()), Mailbox.private(), settings)
    ticks = iter(range(100_000))

    def tick() -> None:
        now_ns = clock.now_ns()
        loop.tick(next(ticks), now_ns, now_ns, 0)

    tick()
    assert told(running) == rigs.SAFE
    lost.unplug("in")

    def is_lost() -> bool:
        tick()
        return loop.fault is Fault.DEVICE_LOST

    def moved() -> bool:
        tick()
        return told(running) != rigs.SAFE

    assert rigs.soon(is_lost)
    assert not rigs.soon(moved, 1.0)
    loop.leave()
    lost.plug("in")
