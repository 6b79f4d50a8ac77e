"""A WAGO Ethernet coupler's own registers: its watchdog, and its outputs read back at 0x0200.

After the coupler manual, "MODBUS functions": 0x1000 time in 100 ms, 0x1001 and 0x1002 which function codes keep it
content, 0x1003 starts it whenever its value changes, 0x1006 its state, 0x1008 stops it. When it runs out, all outputs
go to zero and every request is answered with exception 4 until it is started again.
"""

from pathlib import Path

from hil.emulators.modbus.module import DEVICE_FAILURE, Module, ModuleWiring, RefusedByModule
from hil.emulators.world import World

TIME, MASK_LOW, MASK_HIGH, TRIGGER, STATUS, STOP = 0x1000, 0x1001, 0x1002, 0x1003, 0x1006, 0x1008
"""Registers of the watchdog, see above."""
_SETTINGS = {TIME: 100, MASK_LOW: 0xFFFF, MASK_HIGH: 0xFFFF, TRIGGER: 0, STOP: 0}
_STOP_WORDS = (0x55AA, 0xAA55)
_READ_BACK = 0x0200


class WagoCoupler(Module):
    """The coupler's modules as one process image, and its watchdog."""

    def __init__(self, path: Path, wiring: ModuleWiring, world: World) -> None:
        super().__init__(path, wiring, world)
        self._settings = dict(_SETTINGS)
        self._last_ns = 0
        self._running = False
        self.tripped = False

    @property
    def readable(self) -> set[int]:
        """The image, the outputs read back, and the watchdog."""
        return (
            super().readable | set(_SETTINGS) | {STATUS} | {_READ_BACK + i for i in range(len(self.output_registers()))}
        )

    @property
    def writable(self) -> set[int]:
        """The outputs and the watchdog's settings."""
        return super().writable | set(_SETTINGS)

    def begin(self, function: int) -> None:
        """A request has come: is the watchdog still content, and does this function code feed it?"""
        self.tick()
        if self._running and self._feeds(function):
            self._last_ns = self.world.clock.now_ns()

    def tick(self) -> None:
        """Time passes."""
        limit_ns = self._settings[TIME] * 100_000_000
        if self._running and self.world.clock.now_ns() - self._last_ns > limit_ns:
            self._running, self.tripped = False, True
            self.clear_outputs()

    def peek(self, address: int) -> int:
        """Refused while tripped, except for the watchdog's own registers."""
        if _READ_BACK <= address < _READ_BACK + len(self.output_registers()):
            self._check()
            return self.output_registers()[address - _READ_BACK]
        if address == STATUS:
            return 2 if self.tripped else int(self._running)
        if address in _SETTINGS:
            return self._settings[address]
        if address not in self._fixed:
            self._check()
        return super().peek(address)

    def poke(self, address: int, value: int) -> None:
        """Settings of a running watchdog cannot be changed; its trigger and its stop can."""
        if address not in _SETTINGS:
            self._check()
            super().poke(address, value)
            return
        before = self._settings[address]
        if self._running and address in (TIME, MASK_LOW, MASK_HIGH) and value != before:
            raise RefusedByModule(DEVICE_FAILURE)
        self._settings[address] = value
        if address == TRIGGER and value not in (0, before):
            self._running, self.tripped = True, False
            self._last_ns = self.world.clock.now_ns()
        if address == STOP and value in _STOP_WORDS:
            self._running = False

    def _feeds(self, function: int) -> bool:
        mask = self._settings[MASK_LOW] if function <= 16 else self._settings[MASK_HIGH]
        return bool(mask >> (function - 1) % 16 & 1)

    def _check(self) -> None:
        if self.tripped:
            raise RefusedByModule(DEVICE_FAILURE)
