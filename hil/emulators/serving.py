"""The process in which an emulated rig lives: builds it from its spec, serves it, and obeys lines of JSON from its
owner.

`python -m hil.emulators.serving` reads the spec as its first line, answers with the places where its devices are found,
and then with one line to each command, until its input ends.
"""

import asyncio
import dataclasses
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from hil.emulators.itv_serial.line import EmulatedSerialLine
from hil.emulators.itv_serial.regulator import Regulator
from hil.emulators.modbus.bus_wire import BusWire
from hil.emulators.modbus.module import Module
from hil.emulators.modbus.server import Bus, watch
from hil.emulators.modbus.wago import WagoCoupler
from hil.emulators.priority import run_in_real_time
from hil.emulators.spec import BusSpec, ModuleSpec, RigSpec, ValveSpec
from hil.emulators.world import World
from rig.config import structure
from rig.model.chain import Chain
from rig.model.parameters import load_model

KINDS = {"plain": Module, "wago": WagoCoupler}


class MonotonicTime:
    """The plant goes with real time."""

    def now_ns(self) -> int:
        """CLOCK_MONOTONIC."""
        return time.monotonic_ns()

    def wait_until_ns(self, deadline_ns: int) -> None:
        """Sleep."""
        time.sleep(max(0, deadline_ns - time.monotonic_ns()) / 1e9)


class TurnedTime:
    """The plant goes on when it is told to."""

    def __init__(self) -> None:
        self._now_ns = 0

    def now_ns(self) -> int:
        """What it was turned to."""
        return self._now_ns

    def wait_until_ns(self, deadline_ns: int) -> None:
        """Turn it."""
        self._now_ns = max(self._now_ns, deadline_ns)


class RecordingWorld(World):
    """A world that keeps when its set-points changed: what a test measures the time to the safe state with."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.changes: list[tuple[int, int, float]] = []

    def command(self, valve: int, pressure_mpa: float) -> None:
        """Note the time (CLOCK_MONOTONIC), the valve and its set-point, then obey."""
        self.changes = [*self.changes[-1999:], (time.monotonic_ns(), valve, pressure_mpa)]
        super().command(valve, pressure_mpa)


class RunningEmulators:
    """The running emulators of one spec. `folder` holds the links to its serial ports."""

    def __init__(self, spec: RigSpec, folder: Path) -> None:
        self._spec, self._folder = spec, folder
        self._clock = TurnedTime() if spec.lockstep else MonotonicTime()
        self.world = RecordingWorld(Chain(load_model(spec.model)), self._clock, spec.period_ns, spec.left_at_mpa)
        self._places: dict[str, Any] = {}
        self._wires: dict[str, BusWire] = {}
        self._regulators: dict[str, Regulator] = {}
        self.valves = {name: self._valve(name, valve) for name, valve in spec.valves.items()}
        self.buses = {name: self._bus(bus) for name, bus in spec.buses.items()}
        self._leave_at(*spec.left_at_mpa)

    def _valve(self, name: str, spec: ValveSpec) -> EmulatedSerialLine:
        number = 1 if name == "valve_1" else 2
        self._regulators[name] = regulator = Regulator(
            spec.dialect,
            lambda pressure_mpa: self.world.command(number, pressure_mpa),
            lambda: self.world.outputs()[number - 1],
        )
        return EmulatedSerialLine(
            regulator, self._folder / name, spec.baud, spec.bits_per_byte, spec.turnaround_s, seed=number
        )

    def _bus(self, spec: BusSpec) -> Bus:
        return Bus({module.unit: self._module(module) for module in spec.modules}, self._turn)

    def _module(self, spec: ModuleSpec) -> Module:
        return KINDS[spec.kind](spec.map, spec.wiring, self.world)

    def _turn(self) -> None:
        if self._spec.lockstep:
            self._clock.wait_until_ns(self._clock.now_ns() + self._spec.period_ns)

    def _leave_at(self, p1_mpa: float, p2_mpa: float) -> None:
        for number, (name, pressure_mpa) in enumerate((("valve_1", p1_mpa), ("valve_2", p2_mpa)), 1):
            if name in self._regulators:
                self._regulators[name].start_from(pressure_mpa)
            self.world.command(number, pressure_mpa)
        for bus in self.buses.values():
            for module in bus.modules.values():
                module.start_from((p1_mpa, p2_mpa))

    async def start(self) -> dict[str, Any]:
        """Plug everything in; where it is found."""
        for name in (*self.valves, *self.buses):
            await self._plug(name)
        return self._places

    async def _plug(self, name: str) -> None:
        if name in self.valves:
            self.valves[name].plug()
            self._places[name] = str(self.valves[name].device)
            return
        spec = self._spec.buses[name]
        if spec.baud is None:
            self._places[name] = await self.buses[name].serve_tcp(self._places.get(name, spec.port))
            return
        if name not in self._wires:
            client, server = self._folder / name, self._folder / f"{name}.server"
            self._wires[name] = BusWire(client, server, spec.baud, spec.bits_per_byte)
            await self.buses[name].serve_rtu(str(server), spec.baud)
            self._places[name] = str(client)
        self._wires[name].plug()

    async def _unplug(self, name: str) -> None:
        if name in self.valves:
            self.valves[name].unplug()
        elif name in self._wires:
            self._wires[name].unplug()
        else:
            await self.buses[name].stop()

    async def obey(self, command: dict[str, Any]) -> Any:
        """One command of the owner; returns its answer."""
        name = command.get("name", "")
        match command["do"]:
            case "state":
                return self._state()
            case "trouble":
                _set(self.valves[name].trouble if name in self.valves else self.buses[name].trouble, command["values"])
            case "damage":
                _set(self.buses[name].modules[command.get("unit", 1)].damage, command["values"])
            case "power":
                self.valves[name].power(command["on"])
            case "plug":
                await self._plug(name)
            case "unplug":
                await self._unplug(name)
            case "leave":
                self._leave_at(*command["at_mpa"])
            case other:
                raise ValueError(f"unknown command {other!r}")
        return None

    def stop(self) -> None:
        """Take the serial ports away."""
        for line in self.valves.values():
            line.unplug()
        for wire in self._wires.values():
            wire.stop()

    def _state(self) -> dict[str, Any]:
        return {
            "now_ns": time.monotonic_ns(),
            "commands_mpa": self.world.commands,
            "outputs": self.world.outputs(),
            "changes": self.world.changes,
            "set_points": {name: line.set_point for name, line in self.valves.items()},
            "writes": {name: line.writes for name, line in self.valves.items()},
            "requests": {name: bus.requests for name, bus in self.buses.items()},
            "registers": {
                name: {str(unit): module.output_registers() for unit, module in bus.modules.items()}
                for name, bus in self.buses.items()
            },
        }


def _set(target: Any, values: dict[str, Any]) -> None:
    known = {field.name for field in dataclasses.fields(target)}
    for key, value in values.items():
        if key not in known:
            raise ValueError(f"unknown fault {key!r}; there are: {', '.join(sorted(known))}")
        setattr(target, key, value.encode() if key == "noise" else value)


async def serve() -> None:
    """Until the owner's end of the pipe closes."""
    reader = asyncio.StreamReader(limit=1 << 22)
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    spec = structure(json.loads(await reader.readline()), RigSpec, "emulated rig")
    with tempfile.TemporaryDirectory(prefix="emulated-rig-") as folder:
        rig = RunningEmulators(spec, Path(folder))
        say(await rig.start())
        run_in_real_time()
        watching = asyncio.create_task(watch(list(rig.buses.values())))
        while line := await reader.readline():
            try:
                say(await rig.obey(json.loads(line)))
            except (ValueError, KeyError, OSError) as error:
                say({"error": str(error)})
        watching.cancel()
        rig.stop()


def say(answer: Any) -> None:
    """One line of JSON to the owner."""
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    asyncio.run(serve())
