"""One analog module: which registers it has, what stands in them, and what is wired to its terminals. No bus here.

The register map comes from the same YAML as the driver's; what the numbers mean is worked out apart from the driver's
conversion, so that an error in one does not hide in the other.
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from hil.emulators.world import World
from rig.config import read_yaml

ILLEGAL_ADDRESS = 2
DEVICE_FAILURE = 4
"""Exception codes of the Modbus application protocol that the module answers with: illegal data address, server device
failure."""


class RefusedByModule(Exception):
    """The module answers with an exception code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"exception {code}")
        self.code = code


@dataclass(frozen=True)
class PressureWire:
    """A pressure on a channel: `low` (V or mA) stands for `low_mpa`, `high` for `high_mpa`."""

    channel: int
    low: float = 0.0
    high: float = 10.0
    low_mpa: float = 0.0
    high_mpa: float = 0.5

    def signal(self, pressure_mpa: float) -> float:
        """What the sender puts on the wire."""
        return self.low + (pressure_mpa - self.low_mpa) / (self.high_mpa - self.low_mpa) * (self.high - self.low)

    def pressure_mpa(self, signal: float) -> float:
        """What a regulator makes of the signal: never outside its range."""
        share = (signal - self.low) / (self.high - self.low)
        return self.low_mpa + min(max(share, 0.0), 1.0) * (self.high_mpa - self.low_mpa)


@dataclass(frozen=True)
class ModuleWiring:
    """What hangs on the terminals of one module; None: elsewhere."""

    valve_1: PressureWire | None = None
    valve_2: PressureWire | None = None
    monitor_1: PressureWire | None = None
    monitor_2: PressureWire | None = None
    wiper: int | None = None
    excitation: int | None = None
    excitation_v: float = 5.0
    travel_deg: float = 345.0
    pot_ohm: float = 5000.0
    load_ohm: float = 500_000.0

    def wiper_v(self, angle_deg: float) -> float:
        """The loaded divider: position x gives x / (1 + a x (1 - x)) of the excitation, a = R_pot / R_load."""
        x = min(max(angle_deg / self.travel_deg + 0.5, 0.0), 1.0)
        return self.excitation_v * x / (1.0 + self.pot_ohm / self.load_ohm * x * (1.0 - x))


@dataclass
class Damage:
    """What somebody did to the wires and the power."""

    cut: list[str] = field(default_factory=list)
    """Of monitor_1, monitor_2, wiper, excitation: the input then reads 0."""
    swapped_valves: bool = False
    not_a_number: bool = False
    """Float channels read NaN."""


_CODES = {"uint16": "H", "int16": "h", "uint32": "I", "int32": "i", "float32": "f"}


class ChannelBlock:
    """A block of channels of the map: numbers <-> registers <-> signal."""

    def __init__(self, raw: Mapping[str, Any]) -> None:
        self.address, self.count = int(raw["address"]), int(raw["channels"])
        self._type = str(raw.get("type", "uint16"))
        self.width = 1 if self._type.endswith("16") else 2
        self._swap_bytes = raw.get("byte_order", "big") == "little"
        self._swap_words = raw.get("word_order", "big") == "little"
        self._c0, self._c1 = map(float, raw["counts"])
        self._s0, self._s1 = map(float, raw["signal"])

    @property
    def registers(self) -> range:
        """Addresses of the block."""
        return range(self.address, self.address + self.count * self.width)

    def put(self, signal: float) -> list[int]:
        """Registers of a channel with this signal on its terminal, as its converter sees it."""
        share = (signal - self._s0) / (self._s1 - self._s0)
        number = self._c0 + min(max(share, 0.0), 1.0) * (self._c1 - self._c0) if signal == signal else signal
        data = struct.pack(">" + _CODES[self._type], number if self._type == "float32" else round(number))
        words = [data[i : i + 2] for i in range(0, len(data), 2)]
        words = words[::-1] if self._swap_words else words
        return [int.from_bytes(word, "little" if self._swap_bytes else "big") for word in words]

    def get(self, registers: list[int]) -> float:
        """The signal that a channel with these registers puts on its terminal."""
        words = [register.to_bytes(2, "little" if self._swap_bytes else "big") for register in registers]
        data = b"".join(words[::-1] if self._swap_words else words)
        number = float(struct.unpack(">" + _CODES[self._type], data)[0])
        return self._s0 + (min(max(number, self._c0), self._c1) - self._c0) / (self._c1 - self._c0) * (
            self._s1 - self._s0
        )


class Module:
    """A module with its map, its wires, and the world behind them."""

    def __init__(self, path: Path, wiring: ModuleWiring, world: World) -> None:
        raw = cast(dict[str, Any], read_yaml(path))
        self.name = str(raw["name"])
        self.wiring, self.world = wiring, world
        self.damage = Damage()
        self.inputs = ChannelBlock(raw["inputs"]) if raw.get("inputs") else None
        self.outputs = ChannelBlock(raw["outputs"]) if raw.get("outputs") else None
        self.read_write = bool(raw.get("read_write"))
        self._fixed = _identity(raw.get("identity"))
        self._written: dict[int, int] = dict.fromkeys(self.outputs.registers, 0) if self.outputs else {}

    @property
    def readable(self) -> set[int]:
        """Every address that can be read."""
        return set(self._fixed) | set(self._written) | set(self.inputs.registers if self.inputs else ())

    @property
    def writable(self) -> set[int]:
        """Every address that can be written."""
        return set(self._written)

    def peek(self, address: int) -> int:
        """One register, as a read request sees it now. Inputs win over outputs at the same address (WAGO reads back
        elsewhere)."""
        if self.inputs and address in self.inputs.registers:
            channel, part = divmod(address - self.inputs.address, self.inputs.width)
            return self.inputs.put(self._signal(channel))[part]
        return self._fixed.get(address, self._written.get(address, 0))

    def poke(self, address: int, value: int) -> None:
        """One register written by a request; Refused where there is none."""
        if address not in self._written:
            raise RefusedByModule(ILLEGAL_ADDRESS)
        self._written[address] = value

    def obey(self) -> None:
        """Bring the outputs to the regulators; once a request, so that two channels change together."""
        for valve, wire in enumerate((self.wiring.valve_1, self.wiring.valve_2), 1):
            if wire is not None and self.outputs is not None:
                at = self.outputs.address + wire.channel * self.outputs.width
                signal = self.outputs.get([self._written[at + i] for i in range(self.outputs.width)])
                target = 3 - valve if self.damage.swapped_valves else valve
                pressure_mpa = wire.pressure_mpa(signal)
                if self.world.commands[target - 1] != pressure_mpa:
                    self.world.command(target, pressure_mpa)

    def start_from(self, pressures_mpa: tuple[float, float]) -> None:
        """The set-points that somebody left behind, as registers."""
        for wire, pressure_mpa in zip((self.wiring.valve_1, self.wiring.valve_2), pressures_mpa, strict=True):
            if wire is not None and self.outputs is not None:
                at = self.outputs.address + wire.channel * self.outputs.width
                self._written.update(enumerate(self.outputs.put(wire.signal(pressure_mpa)), at))
        self.obey()

    def output_registers(self) -> list[int]:
        """What stands in the output registers."""
        return [self._written[address] for address in self.outputs.registers] if self.outputs else []

    def clear_outputs(self) -> None:
        """All outputs to the register value 0: power-up, or a watchdog."""
        for address in self._written:
            self._written[address] = 0
        self.obey()

    def _signal(self, channel: int) -> float:
        wiring, now = self.wiring, self.world.outputs()
        if self.damage.not_a_number:
            return float("nan")
        for name, wire, pressure_mpa in (
            ("monitor_1", wiring.monitor_1, now.p1_mpa),
            ("monitor_2", wiring.monitor_2, now.p2_mpa),
        ):
            if wire is not None and wire.channel == channel:
                return 0.0 if name in self.damage.cut else wire.signal(pressure_mpa)
        if channel == wiring.wiper:
            return 0.0 if {"wiper", "excitation"} & set(self.damage.cut) else wiring.wiper_v(now.angle_deg)
        if channel == wiring.excitation:
            return 0.0 if "excitation" in self.damage.cut else wiring.excitation_v
        return 0.0


def _identity(raw: Mapping[str, Any] | None) -> dict[int, int]:
    if not raw:
        return {}
    registers = list(raw.get("registers") or [])
    if raw.get("text"):
        data = str(raw["text"]).encode().ljust(2 * int(raw["count"]), b"\0")
        registers = [int.from_bytes(data[i : i + 2], "big") for i in range(0, len(data), 2)]
    return {int(raw["address"]) + i: register for i, register in enumerate(registers)}
