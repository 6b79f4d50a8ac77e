"""Devices behind ports and sockets for the contract suite: serial valves, Modbus TCP in two modes, Modbus RTU.

One emulated rig a factory is kept for the whole test run and put back to its beginnings for each test.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path

from drivers.itv_serial.device import ItvSerial
from drivers.mixed import MixedRig
from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.settings import ExchangeMode, ModbusAngleChannel, ModbusSettings
from hil.emulators.emulation import Emulation
from rig.interfaces import Device, DeviceContext, Role
from support.rigs import fieldbus_rigs as rigs
from support.rigs.factories import Bench


def _bench(
    running: Emulation, make: Callable[[DeviceContext], Device], places: tuple[str, ...], step_mpa: float
) -> Bench:
    def commands() -> tuple[float, float]:
        first, second = running.state()["commands_mpa"]
        return first, second

    return Bench(
        rigs.context(),
        make,
        commands,
        pull=lambda: [running.unplug(place) for place in places] and None,
        plug=lambda: [running.plug(place) for place in places] and None,
        step_mpa=step_mpa,
    )


def _modbus(name: str, mode: ExchangeMode, baud: int | None = None) -> Callable[[Path], AbstractContextManager[Bench]]:
    @contextmanager
    def factory(folder: Path) -> Iterator[Bench]:
        running = rigs.wago(name, baud)
        settings = rigs.modbus_settings(running.places["io"], mode)
        yield _bench(running, lambda context: ModbusIo(settings, context), ("io",), 0.5 / 32767)

    return factory


@contextmanager
def serial_valves(folder: Path) -> Iterator[Bench]:
    """Two regulators on ports of their own, the potentiometer on a Modbus module: the rig of
    configs/rigs/serial_modbus.yaml."""
    running = rigs.valves("serial_valves")
    valves = rigs.valve_settings(running)
    angle = ModbusSettings(
        rigs.MAPS / "moxa_e1240.yaml",
        "127.0.0.1",
        running.places["io"],
        angle=ModbusAngleChannel(2, excitation=3),
        patience_s=0.2,
        mode=ExchangeMode.SEPARATE,
    )

    def make(context: DeviceContext) -> MixedRig:
        parts = [
            ItvSerial(valves, replace(context, roles=context.roles - {Role.ANGLE})),
            ModbusIo(angle, replace(context, roles=context.roles & {Role.ANGLE})),
        ]
        return MixedRig(parts, context.clock, context.period_ns)

    yield _bench(running, make, ("valve_1", "valve_2", "io"), 0.5 / 1023)


FIELDBUS: dict[str, Callable[[Path], AbstractContextManager[Bench]]] = {
    "serial_valves": serial_valves,
    "modbus_tcp": _modbus("modbus_tcp", ExchangeMode.SEPARATE),
    "modbus_tcp_combined": _modbus("modbus_tcp_combined", ExchangeMode.COMBINED),
    "modbus_rtu": _modbus("modbus_rtu", ExchangeMode.AUTO, rigs.BAUD),
}
