"""What a rig's YAML says about its Modbus module: where it is, its map, and which channel is wired to what. Nothing is
opened."""

import ipaddress
import math
import re
import socket
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from drivers.modbus_io.maps import ChannelRun, ModuleMap, load_map
from drivers.serial_port import SerialPort
from drivers.signals import SignalRange, Span
from rig.config import unstructure
from rig.fields import bounded
from rig.interfaces import Role, Wiring

_NUMBERS: Final = re.compile(r"[\d.]+")
"""What is meant for an address, and not for a name."""


class ExchangeMode(StrEnum):
    """How the exchanges of a tick are made."""

    AUTO = "auto"
    """By the round trip measured when opening: separate if two fit the period, else combined, else process."""
    SEPARATE = "separate"
    """Read the inputs, later write the outputs: two exchanges a tick, values fresh."""
    COMBINED = "combined"
    """Function 23: write and read in one exchange; the values are then one period old at the next read."""
    PROCESS = "process"
    """An I/O process goes round as fast as the module answers. The only way on RTU."""


@dataclass(frozen=True)
class PressureChannel:
    """A regulator's input or monitor on one channel of the module."""

    channel: int = bounded(0, 59)
    signal: SignalRange = SignalRange.V_0_10
    low_mpa: float = bounded(-0.1, 1.0, "MPa", default=0.0)
    high_mpa: float = bounded(0.001, 1.0, "MPa", default=0.5)
    """Pressures at the two ends of the signal."""

    def __post_init__(self) -> None:
        _ = self.span

    @property
    def span(self) -> Span:
        """Signal and pressure range."""
        return Span(self.signal, self.low_mpa, self.high_mpa)

    def complaint(self, block: ChannelRun | None, output: bool) -> str | None:
        """Why this channel cannot be on `block`; None when it can."""
        kind = "output" if output else "input"
        if block is None:
            return f"the module has no {kind}s"
        if self.channel >= block.channels:
            return f"{kind} channel {self.channel} does not exist; allowed: 0 .. {block.channels - 1}"
        low, high = block.signal
        if self.signal.unit != block.signal_unit or self.signal.low < low or self.signal.high > high:
            return f"a signal of {self.signal.value} does not fit an {kind} of {low:g} .. {high:g} {block.signal_unit}"
        return None


@dataclass(frozen=True)
class ModbusAngleChannel:
    """The potentiometer: its wiper, and either its excitation read as well, or a fixed reference voltage."""

    wiper: int = bounded(0, 59)
    excitation: int | None = bounded(0, 59, default=None)
    reference_v: float | None = bounded(0.1, 30.0, "V", default=None)

    def __post_init__(self) -> None:
        if (self.excitation is None) == (self.reference_v is None):
            raise ValueError("set either excitation (the channel that reads it) or reference_v (a fixed voltage)")


@dataclass(frozen=True)
class FurtherChannel:
    """Any other sensor: value = signal (V or mA) * scale + offset, in the unit that the rig's YAML gives it."""

    channel: int = bounded(0, 59)
    scale: float = bounded(-1e9, 1e9, default=1.0)
    offset: float = bounded(-1e9, 1e9, default=0.0)


@dataclass(frozen=True)
class SerialLine(SerialPort):
    """The RS-485 port of an RTU bus: eight data bits; Modbus asks for even parity, or none with two stop bits."""

    baud: int = bounded(300, 4_000_000, "baud", default=19200)
    parity: str = "E"
    data_bits: int = bounded(8, 8, "bit", default=8)


@dataclass(frozen=True)
class ModbusSettings(Wiring):
    """A device of the kind modbus_io: one module, or an output module paired with an input module."""

    map: Path
    """YAML of the module; of the output module when there are two."""
    host: str = ""
    port: int = bounded(1, 65535, default=502)
    serial: SerialLine | None = None
    """RTU instead of TCP."""
    unit: int | None = bounded(0, 247, default=None)
    """Unit id; the map's when not set."""
    gateway: bool = False
    """Behind `host` are several modules, told apart by their unit ids, and other processes may drive the others.
    Without it one process drives all of the host: many a module answers to every unit id."""
    input_map: Path | None = None
    """YAML of a second module that has the inputs."""
    input_host: str = ""
    """Its address on TCP; the same host when not set (a gateway)."""
    input_port: int | None = bounded(1, 65535, default=None)
    input_unit: int | None = bounded(0, 247, default=None)
    valve_1: PressureChannel | None = None
    valve_2: PressureChannel | None = None
    monitor_1: PressureChannel | None = None
    monitor_2: PressureChannel | None = None
    angle: ModbusAngleChannel | None = None
    further: dict[str, FurtherChannel] = field(default_factory=dict)
    """Further channels of the rig on this module, by name."""
    mode: ExchangeMode = ExchangeMode.AUTO
    watchdog_s: float = bounded(0.1, 60.0, "s", default=0.5)
    """Silence after which the module's own fail-safe acts, where it has one."""
    connect_s: float = bounded(0.05, 10.0, "s", default=1.0)
    patience_s: float = bounded(0.002, 2.0, "s", default=0.05)
    """How long a reply may take where nobody waits for it: in the I/O process, when opening, and when making safe from
    outside."""
    reply_s: float | None = bounded(0.0002, 10.0, "s", default=None)
    """How long a reply may take in the loop (modes separate and combined); 40 % of the period when not set."""
    maps: dict[str, ModuleMap] = field(default_factory=dict)
    """What `map` and `input_map` held when the rig was loaded, by these names; else they are read where needed."""
    silence_periods: int = bounded(2, 1000, "periods", default=5)
    """In process mode: an owner that drives and makes no call for this many periods is taken for dead."""

    def __post_init__(self) -> None:
        if bool(self.host) == (self.serial is not None):
            raise ValueError("set either host (TCP) or serial (RTU)")
        _check_host("host", self.host, "port")
        _check_host("input_host", self.input_host, "input_port")
        if self.serial and self.mode not in (ExchangeMode.AUTO, ExchangeMode.PROCESS):
            raise ValueError(f"mode {self.mode.value} is not possible on RTU; allowed: auto, process")
        if self.serial and (self.input_host or self.input_port):
            raise ValueError("input_host and input_port are for TCP; on RTU set input_unit")
        if self.serial and self.gateway:
            raise ValueError("gateway is for TCP: one process drives all of a serial line")
        if not self.input_map and (self.input_host or self.input_port or self.input_unit is not None):
            raise ValueError("input_host, input_port and input_unit need input_map")

    @property
    def module(self) -> ModuleMap:
        """The module, or the one with the outputs; ConfigError for a map that cannot be read."""
        return self.maps.get("map") or load_map(self.map)

    @property
    def input_module(self) -> ModuleMap:
        """The module with the inputs, which may be the same one; ConfigError as above."""
        return self.maps.get("input_map") or load_map(self.input_map) if self.input_map else self.module

    def read_now(self) -> dict[str, Any]:
        """`maps`, as plain settings: loop, watchers and I/O process then have what was read once, whatever becomes of
        the files. ConfigError as above."""
        both = {"map": self.module} | ({"input_map": self.input_module} if self.input_map else {})
        return {"maps": unstructure(both)}

    @property
    def resource(self) -> str:
        """Names the line, for messages and for the mailbox of its I/O process."""
        return self.serial.device if self.serial else f"{self.host}:{self.port}"

    def range_mpa(self, role: Role) -> tuple[float, float]:
        """Pressures that a valve can be given; any where its channel is not set, which is said when a plan is made."""
        channel: PressureChannel | None = getattr(self, role.value)
        return (-math.inf, math.inf) if channel is None else (channel.low_mpa, channel.high_mpa)

    @property
    def wires(self) -> tuple[str, ...]:
        """What is driven: the line on RTU, on TCP the host and the module, by the host's name and by its address; of a
        gateway the module alone. ConfigError for a map that cannot be read."""
        if self.serial is not None:
            return self.serial.wires
        unit = self.module.unit if self.unit is None else self.unit
        hosts = [f"{host}:{self.port}" for host in _names_of(self.host)]
        return (*([] if self.gateway else hosts), *(f"{host} unit {unit}" for host in hosts))

    @property
    def one_reader(self) -> tuple[str, ...]:
        """The line on RTU; a module on TCP answers whoever asks."""
        return self.serial.wires if self.serial is not None else ()

    def wired_to(self, role: Role) -> tuple[str, ...]:
        """The channels that a role is wired to, by names which another device on the same module has as well: of a host
        that is no gateway, whatever the unit. Hosts as they are written; ConfigError as above."""
        wired: PressureChannel | ModbusAngleChannel | None = getattr(self, role.value)
        if wired is None:
            return ()
        if isinstance(wired, ModbusAngleChannel):
            channels = [channel for channel in (wired.wiper, wired.excitation) if channel is not None]
        else:
            channels = [wired.channel]
        output = role in (Role.VALVE_1, Role.VALVE_2)
        kind, modules = ("output", self._output_module()) if output else ("input", self._input_module())
        return tuple(f"{module}, {kind} channel {channel}" for module in modules for channel in channels)

    def _output_module(self) -> list[str]:
        unit = self.module.unit if self.unit is None else self.unit
        line = self.serial.device if self.serial else f"{self.host.lower()}:{self.port}"
        return _called(line, unit, one_of_many=self.gateway or self.serial is not None)

    def _input_module(self) -> list[str]:
        if not self.input_map:
            return self._output_module()
        unit = self.input_module.unit if self.input_unit is None else self.input_unit
        host, port = self.input_host or self.host, self.input_port or self.port
        line = self.serial.device if self.serial else f"{host.lower()}:{port}"
        own_line = bool(self.input_host or self.input_port)
        return _called(line, unit, one_of_many=self.gateway or not own_line)


def _called(line: str, unit: int, *, one_of_many: bool) -> list[str]:
    """Names of a module: many a one that is alone answers to every unit id."""
    return [*([] if one_of_many else [f"{line} (no gateway)"]), f"{line} unit {unit}"]


def _check_host(key: str, host: str, port_key: str) -> None:
    """ValueError for a port in the host, and for an address that lacks a number: the system would take 192.168.1 for
    192.168.0.1."""
    if host.count(":") == 1:
        raise ValueError(f"{key}: {host!r}: the port has a key of its own, {port_key}")
    if _NUMBERS.fullmatch(host) and not _is_address(host):
        raise ValueError(f"{key}: {host!r} is no address; expected four numbers of 0 .. 255, such as 192.168.1.17")


def _is_address(host: str) -> bool:
    try:
        ipaddress.IPv4Address(host)
    except ValueError:
        return False
    return True


def _names_of(host: str) -> list[str]:
    """As it is written, and its address where the network knows one now."""
    try:
        address = socket.gethostbyname(host)
    except (OSError, UnicodeError):
        return [host.lower()]
    return sorted({host.lower(), address})
