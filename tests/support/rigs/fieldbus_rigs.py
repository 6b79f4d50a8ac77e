"""Emulated serial valves and Modbus modules for the tests: the common wiring, settings to match, and rigs that are kept
running.

They live in a process of their own and in real time, until the file of tests that started them is done (see
conftest.py). The context's period is long, so that a busy test machine does not look like a dead owner.
"""

import atexit
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from drivers.itv_serial.device import ItvSerial, ItvSettings
from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.settings import ExchangeMode, ModbusAngleChannel, ModbusSettings, PressureChannel, SerialLine
from drivers.serial_port import SerialPort
from drivers.signals import SignalRange
from hil.emulators.emulation import Emulation
from hil.emulators.modbus.module import ModuleWiring, PressureWire
from hil.emulators.modbus.stand_in import ModbusModules
from hil.emulators.spec import BusSpec, ModuleSpec, RigSpec, ValveSpec
from hil.emulators.world import World
from rig.errors import DeviceError, DeviceLost
from rig.interfaces import DeviceContext, Role
from rig.realtime.clock import MonotonicClock

CONFIGS = Path(__file__).resolve().parents[3] / "configs"
MODEL = CONFIGS / "models/simulated.yaml"
MAPS = CONFIGS / "modbus"
BAUD = 115_200
PERIOD_NS = 300_000_000
SAFE = (0.21, 0.19)
LEFT_AT = (0.12, 0.34)
WIRING = ModuleWiring(
    PressureWire(0), PressureWire(1), PressureWire(0, 1.0, 5.0), PressureWire(1, 1.0, 5.0), wiper=2, excitation=3
)
CHANNELS: dict[str, Any] = {
    "valve_1": PressureChannel(0, SignalRange.V_0_10),
    "valve_2": PressureChannel(1, SignalRange.V_0_10),
    "monitor_1": PressureChannel(0, SignalRange.V_1_5),
    "monitor_2": PressureChannel(1, SignalRange.V_1_5),
    "angle": ModbusAngleChannel(2, excitation=3),
}
PATIENT = 1000
"""Periods of silence before an owner is taken for dead."""
_running: dict[str, Emulation] = {}


def emulation(name: str, spec: RigSpec) -> Emulation:
    """The emulated rig of that name, started once, or again where it has ended, with every plug in and the regulators
    where somebody left them."""
    if name in _running and not _running[name].alive:
        _running.pop(name).end()
    if name not in _running:
        _running[name] = Emulation(spec).__enter__()
    running = _running[name]
    for place in (*spec.valves, *spec.buses):
        running.plug(place)
    running.leave_at(*LEFT_AT)
    return running


def soon(so: Callable[[], bool], seconds: float = 5.0) -> bool:
    """Poll real processes until it is so, or the time is over."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if so():
            return True
        time.sleep(0.005)
    return so()


def is_lost(call: Callable[[], object]) -> bool:
    """Whether a call of a device says that it is lost, and not only that this once it failed."""
    try:
        call()
    except DeviceLost:
        return True
    except DeviceError:
        return False
    return False


def end_all() -> None:
    """End every emulated rig: an idle one still costs a few per cent of a core."""
    while _running:
        _running.popitem()[1].end()


atexit.register(end_all)


def wago(name: str, baud: int | None = None) -> Emulation:
    """A WAGO coupler with everything on it, on TCP or on RTU; its bus is called io."""
    module = ModuleSpec(MAPS / "wago_750.yaml", WIRING, kind="wago")
    return emulation(name, RigSpec(MODEL, left_at_mpa=LEFT_AT, buses={"io": BusSpec([module], baud=baud)}))


def pair(name: str, baud: int | None = None, kind: str = "plain") -> Emulation:
    """An output and an input module: on two buses of TCP, called out and in, or as units 1 and 2 of an RTU bus, io.
    The outputs are a Moxa's, or a WAGO coupler's by its `kind`."""
    inputs = replace(WIRING, valve_1=None, valve_2=None)
    table = "wago_750.yaml" if kind == "wago" else "moxa_e1241.yaml"
    out = ModuleSpec(MAPS / table, ModuleWiring(PressureWire(0), PressureWire(1)), kind=kind)
    into = ModuleSpec(MAPS / "moxa_e1240.yaml", inputs, unit=1 if baud is None else 2)
    buses = {"out": BusSpec([out]), "in": BusSpec([into])} if baud is None else {"io": BusSpec([out, into], baud=baud)}
    return emulation(name, RigSpec(MODEL, left_at_mpa=LEFT_AT, buses=buses))


def pair_settings(running: Emulation, mode: ExchangeMode = ExchangeMode.AUTO, **changes: Any) -> ModbusSettings:
    """All roles on the rig `pair`."""
    maps = {"map": MAPS / "moxa_e1241.yaml", "input_map": MAPS / "moxa_e1240.yaml"}
    if "io" in running.places:
        return modbus_settings(running.places["io"], mode, **{**maps, "input_unit": 2, **changes})
    own = {"input_host": "127.0.0.1", "input_port": running.places["in"]}
    return modbus_settings(running.places["out"], mode, **{**maps, **own, **changes})


def valves(name: str, baud: int = BAUD) -> Emulation:
    """Two serial regulators, and an input module with the potentiometer."""
    bus = BusSpec([ModuleSpec(MAPS / "moxa_e1240.yaml", ModuleWiring(wiper=2, excitation=3))])
    ports = {"valve_1": ValveSpec(baud), "valve_2": ValveSpec(baud)}
    return emulation(name, RigSpec(MODEL, left_at_mpa=LEFT_AT, valves=ports, buses={"io": bus}))


def modbus_settings(place: int | str, mode: ExchangeMode = ExchangeMode.AUTO, **changes: Any) -> ModbusSettings:
    """All roles on one module, on TCP at a port or on RTU at a device; a slow test machine wakes no watchdog."""
    where: dict[str, Any] = (
        {"host": "127.0.0.1", "port": place} if isinstance(place, int) else {"serial": SerialLine(place, BAUD, "N", 2)}
    )
    settings = {
        "map": MAPS / "wago_750.yaml",
        "mode": mode,
        "watchdog_s": 30.0,
        "patience_s": 0.5,
        "silence_periods": PATIENT,
    }
    return ModbusSettings(**{**settings, **where, **CHANNELS, **changes})


def valve_settings(running: Emulation, baud: int = BAUD, **changes: Any) -> ItvSettings:
    """Both valves of an emulated rig."""
    ports = {name: SerialPort(running.places[name], baud) for name in ("valve_1", "valve_2")}
    return ItvSettings(**{**ports, "patience_s": 0.1, "silence_periods": PATIENT, **changes})


def context(*roles: Role, period_ns: int = PERIOD_NS) -> DeviceContext:
    """A device's surroundings in real time; all roles when none is named."""
    return DeviceContext(MonotonicClock(), frozenset(roles or Role), *SAFE, period_ns=period_ns)


class Still:
    """A plant that stands where it is told to."""

    def step(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> tuple[float, float, float]:
        return p1_cmd_mpa, p2_cmd_mpa, 0.0


@contextmanager
def served(table: Path, folder: Path) -> Iterator[ModbusModules]:
    """A module with any map, with everything wired to it, served by this process."""
    wires = [{"channel": n % 2, "signal": "0-10 V" if n < 2 else "1-5 V"} for n in range(4)]
    raw = dict(zip(("valve_1", "valve_2", "monitor_1", "monitor_2"), wires, strict=True))
    world = World(Still(), MonotonicClock(), commands=LEFT_AT)
    modules = ModbusModules(
        {"map": str(table), **raw, "angle": {"wiper": 2, "excitation": 3}}, frozenset(Role), world, folder
    )
    try:
        yield modules
    finally:
        modules.close()


VALVE_ROLES = (Role.VALVE_1, Role.VALVE_2, Role.MONITOR_1, Role.MONITOR_2)


def modbus(running: Emulation, mode: ExchangeMode = ExchangeMode.SEPARATE, **changes: Any) -> ModbusIo:
    """A closed device on the rig `wago`."""
    return ModbusIo(modbus_settings(running.places["io"], mode, **changes), context())


def serial_valves(running: Emulation, **changes: Any) -> ItvSerial:
    """A closed device on the rig `valves`."""
    return ItvSerial(valve_settings(running, **changes), context(*VALVE_ROLES))
