"""Modbus modules on the loopback or on a pty in place of those of a rig's YAML: same maps, same wiring, one shared
plant behind."""

import asyncio
import re
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil.emulators.modbus.bus_wire import BusWire
from hil.emulators.modbus.module import Module, ModuleWiring, PressureWire
from hil.emulators.modbus.server import Bus, watch
from hil.emulators.modbus.wago import WagoCoupler
from hil.emulators.priority import run_in_real_time
from hil.emulators.world import World
from rig.config import read_yaml
from rig.errors import ConfigError
from rig.interfaces import Role

_START_S = 10.0
_REPLY_S = 5.0
"""The server shares the interpreter with the loop: what would be late from a module is patience here."""


class ModbusModules:
    """The running servers of one device: one module, or an output and an input module."""

    def __init__(self, settings: Mapping[str, Any], roles: frozenset[Role], world: World, folder: Path) -> None:
        self._raw, self._folder = settings, folder
        wiring = _wiring(settings, roles)
        path = Path(str(settings["map"]))
        unit = _unit(settings.get("unit"), path)
        self.modules: list[tuple[int, Module]] = [(unit, _module(path, wiring, world))]
        if settings.get("input_map"):
            input_path = Path(str(settings["input_map"]))
            self.modules.append((_unit(settings.get("input_unit"), input_path), _module(input_path, wiring, world)))
        for _, module in self.modules:
            module.start_from(world.commands)
        self._serial = settings.get("serial")
        self.virtual = not self._serial and settings.get("mode") != "process"
        self.buses: list[Bus] = []
        self._wire: BusWire | None = None
        self.settings: dict[str, Any] = {}
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        if not self._ready.wait(_START_S) or self._failure:
            raise ConfigError(f"emulated Modbus module: its server did not start: {self._failure}")

    def close(self) -> None:
        """Stop serving. Idempotent."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(_START_S)
        if self._wire:
            self._wire.stop()

    def _run(self) -> None:
        run_in_real_time()
        try:
            self._loop.run_until_complete(self._start())
        except (OSError, RuntimeError, ValueError) as error:
            self._failure = error
            return
        finally:
            self._ready.set()
        watching = self._loop.create_task(watch(self.buses))
        self._loop.run_forever()
        watching.cancel()
        self._loop.run_until_complete(self._stop())
        self._loop.close()

    async def _start(self) -> None:
        if self._serial:
            await self._start_rtu(dict(self._serial))
            return
        self.buses = [Bus({unit: module}) for unit, module in self.modules]
        ports = [await bus.serve_tcp() for bus in self.buses]
        own = {"mode": "separate", "reply_s": _REPLY_S} if self.virtual else {}
        self.settings = {"host": "127.0.0.1", "port": ports[0], **own}
        if len(ports) > 1:
            self.settings |= {"input_host": "127.0.0.1", "input_port": ports[1]}

    async def _start_rtu(self, serial: dict[str, Any]) -> None:
        baud = int(serial.get("baud", 19200))
        client, server = self._folder / "rtu", self._folder / "rtu.server"
        self._wire = BusWire(client, server, baud)
        self.buses = [Bus(dict(self.modules))]
        await self.buses[0].serve_rtu(str(server), baud)
        self._wire.plug()
        self.settings = {"serial": {**serial, "device": str(client), "parity": "N"}}  # a pty has no parity bit

    async def _stop(self) -> None:
        for bus in self.buses:
            await bus.stop()
        await asyncio.sleep(0)


def _module(path: Path, wiring: ModuleWiring, world: World) -> Module:
    """With the coupler's watchdog where the map arms one."""
    raw = read_yaml(path)
    kind = WagoCoupler if isinstance(raw, dict) and "WAGO" in str(raw.get("name")) else Module
    return kind(path, wiring, world)


def _unit(given: Any, path: Path) -> int:
    raw = read_yaml(path)
    return int(given if given is not None else raw.get("unit", 1) if isinstance(raw, dict) else 1)


def _wiring(settings: Mapping[str, Any], roles: frozenset[Role]) -> ModuleWiring:
    """The wires as the rig's YAML describes them, for the roles that this device fills."""

    def wire(role: Role) -> PressureWire | None:
        return _wire(settings[role.value]) if role in roles and settings.get(role.value) else None

    angle = settings.get("angle") if Role.ANGLE in roles else None
    pots = (
        (angle["wiper"], angle.get("excitation"), float(angle.get("reference_v") or 5.0))
        if angle
        else (None, None, 5.0)
    )
    return ModuleWiring(wire(Role.VALVE_1), wire(Role.VALVE_2), wire(Role.MONITOR_1), wire(Role.MONITOR_2), *pots)


def _wire(raw: Mapping[str, Any]) -> PressureWire:
    low, high = map(float, re.findall(r"[0-9.]+", str(raw.get("signal", "0-10 V")))[:2])
    return PressureWire(int(raw["channel"]), low, high, float(raw.get("low_mpa", 0.0)), float(raw.get("high_mpa", 0.5)))


def emulate(settings: Mapping[str, Any], roles: frozenset[Role], world: World, folder: Path) -> ModbusModules:
    """For hil.emulators.catalog."""
    return ModbusModules(settings, roles, world, folder)
