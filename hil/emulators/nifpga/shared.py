"""The file of registers that stands for one FPGA, shared by every process that opens it. Layout: struct fpga in
NiFpga.c."""

import ctypes
import mmap
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from hil.emulators.nifpga.bitfile import SIGNATURE, Register

SLOTS: Final = 8192
MAX_OUTPUTS: Final = 32
"""Places for registers, and for outputs that act in the world; as in NiFpga.c beside it, which lays the memory out
too."""
EXISTS, INDICATOR, HOOK_READ, HOOK_WRITE, STROBE = 1, 2, 4, 8, 16
"""Bits of what a register is."""
OPEN, CLOSE, CONTROL, READ, WRITE = 1, 2, 4, 8, 16
EVERY_CALL: Final = OPEN | CLOSE | CONTROL | READ | WRITE
"""Bits of the calls of the vendor's library that a fault may be asked for."""
FOR_GOOD: Final = 0xFFFFFFFF
"""So often an injected fault strikes: every time from then on."""


class _Fpga(ctypes.Structure):
    _fields_ = (
        ("magic", ctypes.c_char * 8),
        ("signature", ctypes.c_char * 40),
        ("vi_state", ctypes.c_uint32),
        ("boot", ctypes.c_uint32),
        ("sessions", ctypes.c_uint32),
        ("latency_us", ctypes.c_uint32),
        ("fault_status", ctypes.c_int32),
        ("fault_mask", ctypes.c_uint32),
        ("fault_after", ctypes.c_int32),
        ("fault_count", ctypes.c_uint32),
        ("stall_us", ctypes.c_uint32),
        ("outputs", ctypes.c_uint32),
        ("calls", ctypes.c_uint64),
        ("strobes", ctypes.c_uint64),
        ("output_slot", ctypes.c_uint32 * MAX_OUTPUTS),
        ("padding", ctypes.c_uint8 * (4096 - 104 - 4 * MAX_OUTPUTS)),
        ("value", ctypes.c_uint64 * SLOTS),
        ("pin", ctypes.c_uint64 * SLOTS),
        ("kind", ctypes.c_uint8 * SLOTS),
    )


class RegisterFile:
    """One FPGA as the emulator sees it: registers and terminals by name, faults to inject."""

    def __init__(self, folder: Path, resource: str, registers: Sequence[Register]) -> None:
        """Creates the file of `resource` in `folder` afresh; a running FPGA with all registers at zero."""
        self.resource = resource
        self.key = resource.replace("/", "_").replace(":", "_")
        self._registers = {register.name: register for register in registers}
        path = folder / self.key
        path.write_bytes(bytes(ctypes.sizeof(_Fpga)))
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), 0)
        self._fpga = _Fpga.from_buffer(self._memory)
        self._fpga.signature = SIGNATURE.encode()
        self._fpga.vi_state = 2
        outputs = [
            register.slot
            for register in registers
            if register.name.startswith("AO.") and register.name.endswith(".VAL")
        ]
        self._fpga.outputs = len(outputs)
        self._fpga.output_slot[: len(outputs)] = outputs
        for register in registers:
            self._fpga.kind[register.slot] = EXISTS | (INDICATOR if register.indicator else 0)
        if "AO.SYS.GO" in self._registers:
            self.mark("AO.SYS.GO", STROBE)
        self._fpga.magic = b"PAMRIO1"

    def mark(self, name: str, kind: int) -> None:
        """Give a register further properties, such as HOOK_READ."""
        self._fpga.kind[self._registers[name].slot] |= kind

    def __contains__(self, name: str) -> bool:
        return name in self._registers

    def slot(self, name: str) -> int:
        """Where a register stands."""
        return self._registers[name].slot

    def value(self, name: str) -> int:
        """What the host wrote last, or what the FPGA measured."""
        return int(self._fpga.value[self.slot(name)])

    def measure(self, name: str, value: int) -> None:
        """The FPGA's side of an input register."""
        self._fpga.value[self.slot(name)] = value

    def pin(self, name: str) -> int:
        """What an output's terminal carries since the last strobe of AO.SYS.GO."""
        return int(self._fpga.pin[self.slot(name)])

    def drive(self, name: str, value: int) -> None:
        """The FPGA's own change of an output's terminal: a watchdog, a limit."""
        self._fpga.pin[self.slot(name)] = value

    @property
    def sessions(self) -> int:
        """Sessions open now, over all processes."""
        return int(self._fpga.sessions)

    @property
    def calls(self) -> int:
        """How many calls have reached the FPGA, over all sessions."""
        return int(self._fpga.calls)

    @property
    def strobes(self) -> int:
        """How often AO.SYS.GO was written."""
        return int(self._fpga.strobes)

    def fail(
        self, status: int, calls: int = EVERY_CALL, after: int = 0, count: int = FOR_GOOD, stall_us: int = 0
    ) -> None:
        """Let `count` of the calls in the groups `calls` return `status`, after `after` that still work."""
        self._fpga.fault_status = status
        self._fpga.fault_after = after
        self._fpga.stall_us = stall_us
        self._fpga.fault_count = count
        self._fpga.fault_mask = calls

    def heal(self) -> None:
        """End every injected fault."""
        self._fpga.fault_mask = 0

    def set_latency_us(self, latency_us: int) -> None:
        """Every call takes at least this long, as over the network."""
        self._fpga.latency_us = latency_us

    def set_vi_state(self, state: int) -> None:
        """0 not running, 1 invalid, 2 running, 3 stopped by itself."""
        self._fpga.vi_state = state

    @property
    def vi_state(self) -> int:
        """See set_vi_state."""
        return int(self._fpga.vi_state)

    def lose_sessions(self) -> None:
        """All sessions are invalid from now on; the FPGA runs on."""
        self._fpga.boot += 1

    def power_cycle(self) -> None:
        """All sessions are lost, outputs and registers at zero; the VI starts again by itself."""
        self.lose_sessions()
        ctypes.memset(self._fpga.value, 0, ctypes.sizeof(self._fpga.value))
        ctypes.memset(self._fpga.pin, 0, ctypes.sizeof(self._fpga.pin))
