"""Modules on a bus: pymodbus' own server, TCP or RTU, with faults that can be switched on in its frames."""

import asyncio
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pymodbus.constants import ExcCodes
from pymodbus.framer import FramerType
from pymodbus.logging import Log
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from hil.emulators.modbus.module import Module, RefusedByModule
from hil.emulators.modbus.wago import WagoCoupler

_BUSY = 6


@dataclass
class BusTrouble:
    """What is wrong with the bus or the module; all off: healthy."""

    silence: bool = False
    exception: int = 0
    """Every request is answered with this exception code."""
    refuse_next: int = 0
    """So many requests are answered that the module is busy; then no more."""
    late_s: float = 0.0
    """Every answer comes so much later."""
    cut: int = 0
    """So many bytes are missing at the end of every answer."""
    garble: int = -1
    """In every answer the byte at this place is wrong."""
    only_unit: int = -1
    """Answers carry this unit id instead of their own."""
    dead_unit: int = -1
    """The module with this unit id has no power; the others on the bus answer."""


class Bus:
    """One server and the modules behind it, by unit id."""

    def __init__(self, modules: Mapping[int, Module], on_input_read: Callable[[], None] | None = None) -> None:
        self.modules = modules
        self.trouble = BusTrouble()
        self.requests = 0
        self._on_input_read = on_input_read
        self._mute = False
        self.server: Any = None

    async def serve_tcp(self, port: int = 0) -> int:
        """Listen on the loopback; returns the port. Idempotent."""
        if self.server is not None:
            return port
        self.server = ModbusTcpServer(
            self._devices(rtu=False), framer=FramerType.SOCKET, address=("127.0.0.1", port), trace_packet=self._trace
        )
        await self._start()
        return int(self.server.transport.sockets[0].getsockname()[1])

    async def serve_rtu(self, device: str, baud: int) -> None:
        """Answer on a serial port."""
        self.server = ModbusSerialServer(
            self._devices(rtu=True), framer=FramerType.RTU, port=device, baudrate=baud, trace_packet=self._trace
        )
        await self._start()

    async def _start(self) -> None:
        Log.setLevel(100)  # type: ignore[no-untyped-call]
        await self.server.serve_forever(background=True)

    async def stop(self) -> None:
        """Pull the plug: nobody listens any more, and who was connected is cut off. Idempotent; `serve_tcp` plugs it in
        again."""
        if self.server is None:
            return
        for connection in list(self.server.active_connections.values()):
            connection.close()
        await self.server.shutdown()
        self.server = None

    def _devices(self, rtu: bool) -> list[SimDevice]:
        devices = [self._device(unit, module) for unit, module in self.modules.items()]
        if 0 not in self.modules:
            everything = [SimData(0, values=[0] * 65000, datatype=DataType.REGISTERS)]
            devices.append(SimDevice(0, everything, action=self._nobody_on_rtu if rtu else self._nobody))
        return devices

    def _device(self, unit: int, module: Module) -> SimDevice:
        async def action(
            function: int,
            start: int,
            address: int,
            count: int,
            registers: list[int],
            values: list[int] | list[bool] | None,
        ) -> ExcCodes | None:
            if unit == self.trouble.dead_unit:
                self._mute = True
                return ExcCodes.GATEWAY_NO_RESPONSE
            try:
                self._access(module, function, start, address, count, registers, values)
            except RefusedByModule as refused:
                return ExcCodes(refused.code)
            return None

        return SimDevice(unit, _registers(module.readable | module.writable), action=action)

    def _access(
        self, module: Module, function: int, start: int, address: int, count: int, registers: list[int], values: Any
    ) -> None:
        """One request at one module; FC 23 comes here twice, first writing, then reading."""
        if values is not None or function != 23:
            self.requests += 1
        if self.trouble.exception:
            raise RefusedByModule(self.trouble.exception)
        if self.trouble.refuse_next:
            self.trouble.refuse_next -= 1
            raise RefusedByModule(_BUSY)
        if isinstance(module, WagoCoupler):
            module.begin(function)
        if function == 23 and not module.read_write:
            raise RefusedByModule(1)
        if values is not None:
            for i, value in enumerate(values):
                module.poke(address + i, int(value))
            module.obey()
            return
        if function in (6,):
            return
        if self._on_input_read and module.inputs and address in module.inputs.registers:
            self._on_input_read()
        for i in range(count):
            registers[address - start + i] = module.peek(address + i)

    async def _nobody(self, *_: Any) -> ExcCodes:
        """A gateway that finds no unit of that id."""
        return ExcCodes.GATEWAY_NO_RESPONSE

    async def _nobody_on_rtu(self, *_: Any) -> ExcCodes:
        """On a serial bus nobody answers at all."""
        self._mute = True
        return ExcCodes.GATEWAY_NO_RESPONSE

    def _trace(self, sending: bool, data: bytes) -> bytes:
        """pymodbus hands over every frame before it is sent; an empty one is not sent."""
        if not sending:
            return data
        trouble, mute = self.trouble, self._mute
        self._mute = False
        if trouble.late_s:
            time.sleep(trouble.late_s)  # a slow module: the next request waits as well
        if trouble.silence or mute:
            return b""
        if trouble.garble >= 0 and data:
            at = trouble.garble % len(data)
            data = data[:at] + bytes([data[at] ^ 0x55]) + data[at + 1 :]
        if trouble.only_unit >= 0:
            at = 6 if isinstance(self.server, ModbusTcpServer) else 0
            data = data[:at] + bytes([trouble.only_unit]) + data[at + 1 :]
        return data[: len(data) - trouble.cut] if trouble.cut else data


def _registers(addresses: set[int]) -> list[SimData]:
    """One SimData a run of addresses."""
    runs: list[list[int]] = []
    for address in sorted(addresses):
        if runs and address == runs[-1][-1] + 1:
            runs[-1].append(address)
        else:
            runs.append([address])
    return [SimData(run[0], values=[0] * len(run), datatype=DataType.REGISTERS) for run in runs]


async def watch(buses: list[Bus], every_s: float = 0.005) -> None:
    """Let the watchdogs' time pass although nobody asks."""
    while True:
        for bus in buses:
            for module in bus.modules.values():
                if isinstance(module, WagoCoupler):
                    module.tick()
        await asyncio.sleep(every_s)
