"""What a Modbus module looks like from the bus: its register map as a dataclass, read from YAML. No bus, no conversion.

Addresses are protocol addresses, from 0: the manuals' "40011" is 10, "30001" is 0.
"""

from dataclasses import dataclass, field
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Final

from rig.config import load
from rig.fields import bounded


class Type(StrEnum):
    """How a channel's number lies in its registers."""

    UINT16 = "uint16"
    INT16 = "int16"
    UINT32 = "uint32"
    INT32 = "int32"
    FLOAT32 = "float32"

    @property
    def registers(self) -> int:
        """Registers a channel."""
        return 1 if self in (Type.UINT16, Type.INT16) else 2


class WordOrder(StrEnum):
    """Which half comes first."""

    BIG = "big"
    LITTLE = "little"


_TYPE_RANGES: Final = {
    Type.UINT16: (0, 0xFFFF),
    Type.INT16: (-0x8000, 0x7FFF),
    Type.UINT32: (0, 0xFFFFFFFF),
    Type.INT32: (-0x80000000, 0x7FFFFFFF),
    Type.FLOAT32: (-3.4e38, 3.4e38),
}


@dataclass(frozen=True)
class ChannelRun:
    """A run of analog channels that lie side by side."""

    address: int = bounded(0, 0xFFFF)
    channels: int = bounded(1, 60)
    counts: tuple[float, float] = (0.0, 65535.0)
    """Numbers at the two ends of the signal."""
    signal: tuple[float, float] = (0.0, 10.0)
    signal_unit: str = "V"
    function: int = bounded(3, 16, default=16)
    """Reading: 3 (holding) or 4 (input registers). Writing: 16 (several at once)."""
    type: Type = Type.UINT16
    byte_order: WordOrder = WordOrder.BIG
    """Of the two bytes of a register; Modbus says big."""
    word_order: WordOrder = WordOrder.BIG
    """Of the two registers of a 32-bit number."""

    def __post_init__(self) -> None:
        if self.signal_unit not in ("V", "mA"):
            raise ValueError(f"signal_unit {self.signal_unit!r} is unknown; allowed: V, mA")
        for name, (low, high) in (("counts", self.counts), ("signal", self.signal)):
            if not low < high:
                raise ValueError(f"{name} must rise, got [{low:g}, {high:g}]")
        low, high = _TYPE_RANGES[self.type]
        if self.counts[0] < low or self.counts[1] > high:
            raise ValueError(f"counts [{self.counts[0]:g}, {self.counts[1]:g}] do not fit {self.type.value}")
        if self.address + self.channels * self.type.registers > 0x10000:
            raise ValueError(f"{self.channels} channels from address {self.address} run past 65535")


@dataclass(frozen=True)
class ReadBack:
    """Where the module tells what stands in its output registers, in their order and form."""

    address: int = bounded(0, 0xFFFF)
    function: int = bounded(3, 4, default=3)


@dataclass(frozen=True)
class Identity:
    """Registers that tell one module from another."""

    address: int = bounded(0, 0xFFFF)
    count: int = bounded(1, 60)
    function: int = bounded(3, 4, default=4)
    registers: list[int] = field(default_factory=list)
    """What must stand there."""
    text: str = ""
    """Or: text that must occur in the registers' bytes."""

    def __post_init__(self) -> None:
        if bool(self.registers) == bool(self.text):
            raise ValueError("identity needs either registers or text")


@dataclass(frozen=True)
class RegisterWrite:
    """One register write: a fixed value, the timeout in ticks, or the counts of a channel's safe set-point."""

    address: int = bounded(0, 0xFFFF)
    value: int = bounded(0, 0xFFFF, default=0)
    timeout: bool = False
    safe_channel: int | None = bounded(0, 59, default=None)
    """Output channel to whose safe value this register belongs, from 0 as in a rig's YAML: it is given the safe
    set-point of the valve that is wired there, and left alone where none is."""


class SafeIs(StrEnum):
    """Where a module's own watchdog takes the outputs."""

    ZERO = "zero"
    REGISTERS = "registers"
    """The safe set-points, which its `arm` writes."""


@dataclass(frozen=True)
class Failsafe:
    """The module's own watchdog: what to write so that it makes the outputs safe when the host is gone."""

    arm: list[RegisterWrite]
    disarm: list[RegisterWrite] = field(default_factory=list)
    safe_is: SafeIs = SafeIs.ZERO
    tick_s: float = bounded(0.001, 10.0, "s", default=0.1)

    def __post_init__(self) -> None:
        if not self.arm:
            raise ValueError("arm needs at least one step")


@dataclass(frozen=True)
class ModuleMap:
    """One module."""

    name: str
    source: str
    """The manual and its page: where the numbers come from."""
    unit: int = bounded(0, 247, default=1)
    """Its unit (device) id when nothing else is set."""
    inputs: ChannelRun | None = None
    outputs: ChannelRun | None = None
    read_back: ReadBack | None = None
    """Not set: what was written cannot be read back, and so the safe state is never confirmed."""
    read_write: bool = False
    """It knows function 23: write outputs and read inputs in one exchange."""
    identity: Identity | None = None
    failsafe: Failsafe | None = None
    about_failsafe: str = "no fail-safe is known"

    def __post_init__(self) -> None:
        if self.inputs is None and self.outputs is None:
            raise ValueError("a map needs inputs or outputs")
        if self.inputs and self.inputs.function not in (3, 4):
            raise ValueError(f"inputs.function {self.inputs.function} cannot read; allowed: 3, 4")
        if self.outputs and self.outputs.function != 16:
            raise ValueError(f"outputs.function {self.outputs.function} is not used; allowed: 16")
        self._check_safe_registers()

    def _check_safe_registers(self) -> None:
        """A safe set-point takes as many registers as an output does, and belongs to one."""
        steps = [step for step in self.failsafe.arm if step.safe_channel is not None] if self.failsafe else []
        channels, width = (self.outputs.channels, self.outputs.type.registers) if self.outputs else (0, 1)
        for step in steps:
            if step.safe_channel is not None and step.safe_channel >= channels:
                raise ValueError(
                    f"failsafe.arm: safe_channel {step.safe_channel} at {step.address}: the module has no such output "
                    f"channel, but {channels}, counted from 0"
                )
        places = sorted(step.address for step in steps)
        for before, after in pairwise(places):
            if 0 < after - before < width:
                raise ValueError(
                    f"failsafe.arm: the safe set-point at {before} takes {width} registers, "
                    f"and the next one is at {after}"
                )


def load_map(path: Path) -> ModuleMap:
    """The map at `path`; ConfigError names file and key."""
    return load(path, ModuleMap)
