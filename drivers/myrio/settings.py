"""What a rig's YAML says about its myRIO: which register is wired to what. Checked against the terminals, nothing
opened."""

from dataclasses import dataclass, field
from pathlib import Path

from drivers.myrio.codec import Converter, converter
from drivers.signals import SignalRange, Span
from rig.fields import bounded
from rig.interfaces import Role, Wiring


def _terminal(key: str, register: str, output: bool) -> Converter:
    """The converter behind a register; ValueError, with the key, for a name that is none of the myRIO's."""
    try:
        return converter(register, output)
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from None


@dataclass(frozen=True)
class PressureLine:
    """A regulator's input or monitor on one analog terminal."""

    register: str
    """Name in the bitfile, such as AO.A_0.VAL."""
    signal: SignalRange
    low_mpa: float = bounded(-0.1, 1.0, "MPa", default=0.0)
    high_mpa: float = bounded(0.001, 1.0, "MPa", default=0.5)
    """Pressures at the two ends of the signal."""
    units_per_volt: float = bounded(0.01, 100.0, default=1.0)
    """Signal per volt at the terminal: 4 for 4-20 mA through 250 Ohm, 2 for 0-10 V through a divider or an amplifier by
    two."""
    limit_min: str = ""
    limit_max: str = ""
    """Outputs only: registers of the FPGA's own limits in counts, where the bitfile has them."""

    @property
    def span(self) -> Span:
        """Signal and pressure range."""
        return Span(self.signal, self.low_mpa, self.high_mpa)

    def check(self, key: str, output: bool) -> None:
        """ValueError unless the signal fits the terminal's range (half a volt-count over is the converter's last
        step)."""
        terminal = _terminal(f"{key}.register", self.register, output)
        if self.units_per_volt <= 0.0:
            return  # out of its bounds, which are checked after this, with a better message
        low_v, high_v = self.signal.low / self.units_per_volt, self.signal.high / self.units_per_volt
        if low_v < terminal.low_v or high_v > terminal.high_v + 2 * terminal.lsb_v:
            ends = f"{terminal.low_v:.0f} .. {terminal.high_v + terminal.lsb_v:.0f} V"
            raise ValueError(
                f"{key}: a signal of {self.signal} does not fit on {self.register} ({ends}); "
                "use connector C, or set units_per_volt for the amplifier or shunt in between"
            )
        _ = self.span


@dataclass(frozen=True)
class AngleInput:
    """The potentiometer: its wiper, and either its excitation read as well, or a fixed reference voltage."""

    wiper: str
    excitation: str | None = None
    reference_v: float | None = bounded(0.1, 10.0, "V", default=None)

    def __post_init__(self) -> None:
        if (self.excitation is None) == (self.reference_v is None):
            raise ValueError("set either excitation (the register that reads it) or reference_v (a fixed voltage)")
        _terminal("wiper", self.wiper, output=False)
        if self.excitation is not None:
            _terminal("excitation", self.excitation, output=False)


@dataclass(frozen=True)
class FurtherInput:
    """Any other sensor on an analog terminal: value = volts * scale + offset, in the unit that the rig's YAML gives
    it."""

    register: str
    scale: float = bounded(-1e9, 1e9, default=1.0)
    offset: float = bounded(-1e9, 1e9, default=0.0)

    def __post_init__(self) -> None:
        _terminal("register", self.register, output=False)


@dataclass(frozen=True)
class MyRioSettings(Wiring):
    """A device of the kind myrio. The registers default to the rig of the paper on connector A."""

    bitfile: Path
    """The .lvbitx that runs on the FPGA; registers are found in it by name."""
    resource: str = "RIO0"
    """RIO0 on the controller itself, rio://HOST/RIO0 over the network."""
    valve_1: PressureLine = field(default_factory=lambda: PressureLine("AO.A_0.VAL", SignalRange.V_0_5))
    valve_2: PressureLine = field(default_factory=lambda: PressureLine("AO.A_1.VAL", SignalRange.V_0_5))
    monitor_1: PressureLine = field(default_factory=lambda: PressureLine("AI.A_0.VAL", SignalRange.V_1_5))
    monitor_2: PressureLine = field(default_factory=lambda: PressureLine("AI.A_1.VAL", SignalRange.V_1_5))
    angle: AngleInput = field(default_factory=lambda: AngleInput("AI.A_2.VAL", excitation="AI.A_3.VAL"))
    further: dict[str, FurtherInput] = field(default_factory=dict)
    """Further channels of the rig on this myRIO, by name."""
    strobe: str = "AO.SYS.GO"
    """Written once after the outputs: both then change together."""
    ready: str = "SYS.RDY"
    """Waited for after opening; empty: the bitfile has none."""
    ready_timeout_s: float = bounded(0.0, 60.0, "s", default=2.0)
    heartbeat: str = ""
    """A counter for the FPGA's watchdog, raised at each read; empty: the bitfile has none."""
    watchdog_s: float | None = bounded(0.001, 60.0, "s", default=None)
    """After how long without a heartbeat the FPGA makes safe, as it was compiled; for a bitfile with a heartbeat."""
    remote_share: float = bounded(0.05, 1.0, default=0.8)
    """A remote session is refused when the p99 of one tick's calls takes more than this share of the period."""

    def __post_init__(self) -> None:
        for key in ("valve_1", "valve_2", "monitor_1", "monitor_2"):
            line: PressureLine = getattr(self, key)
            line.check(key, output=key.startswith("valve"))
        if not self.resource or (not self.is_remote and set(self.resource) & set("./:")):
            raise ValueError(f"resource: expected RIO0 or rio://HOST/RIO0, got {self.resource!r}")

    def range_mpa(self, role: Role) -> tuple[float, float]:
        """Pressures that a valve can be given."""
        line: PressureLine = getattr(self, role.value)
        return line.low_mpa, line.high_mpa

    @property
    def wires(self) -> tuple[str, ...]:
        """The RIO device, whose outputs every session of it writes."""
        return (self.resource,)

    def wired_to(self, role: Role) -> tuple[str, ...]:
        """What a role is wired to."""
        wired: PressureLine | AngleInput = getattr(self, role.value)
        registers = [wired.wiper, wired.excitation] if isinstance(wired, AngleInput) else [wired.register]
        return tuple(f"{self.resource} {register}" for register in registers if register)

    @property
    def is_remote(self) -> bool:
        """Every call is a round trip over the network."""
        return self.resource.startswith("rio://")
