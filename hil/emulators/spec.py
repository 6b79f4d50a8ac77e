"""What an emulated rig consists of, as plain data: it travels as JSON to the process that runs it."""

from dataclasses import dataclass, field
from pathlib import Path

from hil.emulators.itv_serial.regulator import RegulatorDialect
from hil.emulators.modbus.module import ModuleWiring
from rig.fields import bounded


@dataclass(frozen=True)
class ValveSpec:
    """A serial regulator on a pty."""

    baud: int = bounded(300, 4_000_000, "baud", default=9600)
    bits_per_byte: int = bounded(9, 12, "bit", default=10)
    turnaround_s: float = bounded(0.0, 1.0, "s", default=0.0)
    dialect: RegulatorDialect = field(default_factory=RegulatorDialect)


@dataclass(frozen=True)
class ModuleSpec:
    """A module of a bus."""

    map: Path
    wiring: ModuleWiring = field(default_factory=ModuleWiring)
    unit: int = bounded(1, 247, default=1)
    kind: str = "plain"
    """plain, or wago: with the coupler's watchdog."""

    def __post_init__(self) -> None:
        if self.kind not in ("plain", "wago"):
            raise ValueError(f"kind {self.kind!r} is unknown; allowed: plain, wago")


@dataclass(frozen=True)
class BusSpec:
    """A Modbus line and its modules; no baud: TCP."""

    modules: list[ModuleSpec]
    port: int = bounded(0, 65535, default=0)
    """TCP port on the loopback; 0: any that is free."""
    baud: int | None = bounded(300, 4_000_000, "baud", default=None)
    bits_per_byte: int = bounded(9, 12, "bit", default=11)


@dataclass(frozen=True)
class RigSpec:
    """One plant, and the devices through which it is reached."""

    model: Path
    """The plant's model; see rig.model."""
    left_at_mpa: tuple[float, float] = (0.0, 0.0)
    """The set-points at which the regulators stand before anybody writes."""
    period_ns: int = bounded(100_000, 1_000_000_000, "ns", default=5_000_000)
    lockstep: bool = False
    """The plant goes one period on at each read of a module's inputs instead of with real time: the same run, every
    time."""
    valves: dict[str, ValveSpec] = field(default_factory=dict)
    """valve_1, valve_2."""
    buses: dict[str, BusSpec] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if wrong := sorted(set(self.valves) - {"valve_1", "valve_2"}):
            raise ValueError(f"valves: unknown valve {wrong[0]!r}; allowed: valve_1, valve_2")
