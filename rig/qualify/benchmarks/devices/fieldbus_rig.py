"""The emulated serial valves and Modbus modules that the benchmarks drive, and settings to match them."""

from typing import Any, Final

from drivers.itv_serial.device import ItvSettings
from drivers.modbus_io.settings import ExchangeMode, ModbusAngleChannel, ModbusSettings, PressureChannel, SerialLine
from drivers.serial_port import SerialPort
from drivers.signals import SignalRange
from hil.emulators.emulation import Emulation
from hil.emulators.modbus.module import ModuleWiring, PressureWire
from hil.emulators.spec import BusSpec, ModuleSpec, RigSpec, ValveSpec
from rig.app import shipped
from rig.interfaces import Device, DeviceContext, Role
from rig.realtime.clock import MonotonicClock
from rig.service.records.lateness import quantiles

BAUDS: Final = (9600, 19200, 38400, 57600, 115200)
"""Rates of the line to RTU modules, bit/s, from the slowest on."""
SAFE: Final = (0.2, 0.2)
"""Safe set-points of both valves, MPa."""
VALVE_ROLES: Final = frozenset({Role.VALVE_1, Role.VALVE_2, Role.MONITOR_1, Role.MONITOR_2})
REPLY_S: Final = 2.0
"""How long an emulated device may take for a reply. No figure is of a reply that is late, and no benchmark is to end by
one: what answers is a process that other work may hold up, not a module."""
CHANNELS: Final[dict[str, Any]] = {
    "valve_1": PressureChannel(0, SignalRange.V_0_10),
    "valve_2": PressureChannel(1, SignalRange.V_0_10),
    "monitor_1": PressureChannel(0, SignalRange.V_1_5),
    "monitor_2": PressureChannel(1, SignalRange.V_1_5),
    "angle": ModbusAngleChannel(2, excitation=3),
}
WIRING: Final = ModuleWiring(
    PressureWire(0), PressureWire(1), PressureWire(0, 1.0, 5.0), PressureWire(1, 1.0, 5.0), wiper=2, excitation=3
)


def spec(rtu_baud: int | None = None, serial_baud: int | None = None) -> RigSpec:
    """A WAGO coupler on TCP or RTU, and serial valves when they have a baud rate."""
    model = shipped.configs() / "models" / "simulated.yaml"
    module = ModuleSpec(shipped.configs() / "modbus/wago_750.yaml", WIRING, kind="wago")
    valves = {name: ValveSpec(serial_baud) for name in ("valve_1", "valve_2")} if serial_baud else {}
    return RigSpec(model, left_at_mpa=SAFE, valves=valves, buses={"io": BusSpec([module], baud=rtu_baud)})


def modbus(running: Emulation, mode: ExchangeMode = ExchangeMode.SEPARATE, baud: int | None = None) -> ModbusSettings:
    place = running.places["io"]
    if baud is None:
        return modbus_at(int(place), mode)
    line = SerialLine(str(place), baud, "N", 2)
    return ModbusSettings(
        shipped.configs() / "modbus/wago_750.yaml",
        serial=line,
        watchdog_s=30.0,
        patience_s=REPLY_S,
        silence_periods=1000,
        **CHANNELS,
    )


def modbus_at(port: int, mode: ExchangeMode) -> ModbusSettings:
    table = shipped.configs() / "modbus/wago_750.yaml"
    return ModbusSettings(
        table,
        "127.0.0.1",
        port,
        mode=mode,
        watchdog_s=30.0,
        patience_s=REPLY_S,
        reply_s=REPLY_S,
        silence_periods=1000,
        **CHANNELS,
    )


def itv(running: Emulation, baud: int) -> ItvSettings:
    return ItvSettings(
        SerialPort(running.places["valve_1"], baud),
        SerialPort(running.places["valve_2"], baud),
        patience_s=REPLY_S,
        silence_periods=1000,
    )


def context(roles: frozenset[Role] = frozenset(Role)) -> DeviceContext:
    return DeviceContext(MonotonicClock(), roles, *SAFE)


def tick(device: Device) -> None:
    """What a loop asks of a device each period."""
    device.read()
    device.write(0.2, 0.2)


def quantiles_us(times_ns: list[int]) -> dict[str, float]:
    """p50 and p99 of times in ns, in microseconds."""
    found = quantiles(times_ns)
    return {key: found[key] / 1e3 for key in ("p50", "p99")}
