"""Two SMC ITV regulators over RS-232C as a Device of the loop: each port in an I/O process of its own, nothing here
waits for a wire."""

import contextlib
import dataclasses
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Final

from drivers.calibration import Calibration, curve, for_role, inverse
from drivers.io_process.alarm import StandingAlarm, alarm, confirmed
from drivers.io_process.owner import IoProcess
from drivers.io_process.worker import WorkerSetup
from drivers.itv_serial.codec import Codec, Dialect, Pace, pace
from drivers.itv_serial.link import LinkSettings
from drivers.serial_port import SerialPort
from rig.errors import ConfigError, DeviceError, DeviceLost, DevicePending
from rig.fields import bounded
from rig.interfaces import NAN, Abilities, DeviceContext, Measurement, Role, Wiring
from rig.sample import ANGLE_ABSENT, P1_ABSENT, P2_ABSENT, STALE

_VALVES: Final = ((Role.VALVE_1, Role.MONITOR_1), (Role.VALVE_2, Role.MONITOR_2))
_ABSENT: Final = (P1_ABSENT, P2_ABSENT)


@dataclass(frozen=True)
class ItvSettings(Wiring):
    """The serial valves of a rig."""

    valve_1: SerialPort | None = None
    valve_2: SerialPort | None = None
    dialect: Dialect = field(default_factory=Dialect)
    patience_s: float = bounded(0.001, 5.0, "s", default=0.03)
    """How long a reply may take beyond its wire time."""
    silence_periods: int = bounded(2, 1000, "periods", default=5)
    """An owner that drives and makes no call for this many periods is taken for dead: the safe set-points are
    written."""

    def range_mpa(self, role: Role) -> tuple[float, float]:
        """Pressures that a valve can be given."""
        return 0.0, self.dialect.full_scale_mpa

    @property
    def wires(self) -> tuple[str, ...]:
        """Both ports."""
        return tuple(wire for port in (self.valve_1, self.valve_2) if port is not None for wire in port.wires)

    @property
    def one_reader(self) -> tuple[str, ...]:
        """Both ports."""
        return self.wires

    def wired_to(self, role: Role) -> tuple[str, ...]:
        """The port that a role is wired to: RS-232C joins two ends."""
        port = self.valve_1 if role in (Role.VALVE_1, Role.MONITOR_1) else self.valve_2
        return port.wires if port is not None else ()


class _Valve:
    """One regulator: its process, and counts <-> MPa."""

    def __init__(self, number: int, port: SerialPort, settings: ItvSettings, context: DeviceContext) -> None:
        valve, monitor = _VALVES[number]
        self.name = valve.value
        self.device = port.device
        self.standing = StandingAlarm()
        self.drives, self.reads = valve in context.roles, monitor in context.roles
        self.codec = Codec(settings.dialect)
        self.pace: Pace = pace(settings.dialect, port.baud, port.bits_per_byte, self.reads)
        scale = Calibration(
            [(0.0, 0.0), (float(settings.dialect.full_scale_counts), settings.dialect.full_scale_mpa)],
            raw_unit="counts",
        )
        self._to_counts = inverse(for_role(context, valve, scale).knots)
        self.to_mpa = curve(for_role(context, monitor, scale).knots)
        self.speed = self.pace.summary(port.baud, context.period_ns / 1e9)
        safe = (self.counts(context.safe_p1_mpa if number == 0 else context.safe_p2_mpa),)
        link = LinkSettings(self.name, port, settings.dialect, self.reads, settings.patience_s)
        job = WorkerSetup(
            "drivers.itv_serial.link", dataclasses.asdict(link), safe, settings.silence_periods * context.period_ns
        )
        rescue = job._replace(settings=job.settings | {"rescue": True})
        worst_s = self.pace.set_s + self.pace.monitor_s + 2 * settings.patience_s
        self.safe_bound_s = self.pace.set_s + max(self.pace.set_s, self.pace.monitor_s)
        """From the alarm to the last byte of the reply: the exchange under way, then the safe set-point. C."""
        self.max_age_ns = int(4e9 * worst_s)
        self.io = IoProcess(port.device, job, rescue, hang_ns=int(4e9 * worst_s) + 100_000_000)

    def holds_safe(self) -> bool | None:
        """Whether the regulator has confirmed the safe set-point; None where its reply does not repeat it, or nobody
        holds the port."""
        if not self.codec.repeats_set:
            return None
        if self.io.running:
            return self.io.confirmed()
        return confirmed(self.device)

    def counts(self, pressure_mpa: float) -> float:
        """The set-point as the wire carries it, inside the regulator's range."""
        return float(self.codec.to_count(self._to_counts(pressure_mpa)))


class ItvSerial(Abilities):
    """SMC ITV regulators on RS-232C ports: set-points and monitors, newest set-point wins, ages recorded.

    A port is held by an I/O process, which writes the safe set-points by itself when the loop dies or falls silent.
    `safe` from a second instance in another process reaches the same I/O process. The valves are written one after the
    other or side by side as their wires allow, never strictly together.
    """

    Settings = ItvSettings
    second_path = True

    def __init__(self, settings: ItvSettings, context: DeviceContext) -> None:
        ports = settings.valve_1, settings.valve_2
        offered = {role for pair, port in zip(_VALVES, ports, strict=True) if port for role in pair}
        where = context.where or "itv_serial"
        if wrong := sorted(context.roles - offered):
            raise ConfigError(f"{where}: the role {wrong[0].value!r} needs the port of its valve, or another device")
        if settings.valve_1 and settings.valve_2 and settings.valve_1.device == settings.valve_2.device:
            raise ConfigError(
                f"{where}: both valves on {settings.valve_1.device}: RS-232C joins two ends, so each valve needs "
                "its own port"
            )
        self.roles = context.roles
        self._period_ns = context.period_ns
        self.valves = [
            _Valve(number, port, settings, context) if port and context.roles & set(_VALVES[number]) else None
            for number, port in enumerate(ports)
        ]

    def _used(self) -> list[_Valve]:
        return [valve for valve in self.valves if valve]

    def open(self) -> Mapping[str, str]:
        """Start the I/O processes; each proves its valve by a monitor reading, which moves nothing. Takes some tenths
        of a second."""
        facts: dict[str, str] = {}
        self.close()
        try:
            for valve in self._used():
                facts |= {f"{valve.name}.{key}": text for key, text in valve.io.start().items()}
                facts[f"{valve.name}.pace"] = valve.speed
                facts[f"{valve.name}.set_rate_hz"] = f"{valve.pace.rate_hz:.1f}"
                facts[f"{valve.name}.safe_within_s"] = f"{valve.safe_bound_s:.4f}"
        except DeviceError:
            self.close()
            raise
        return facts

    def read(self) -> Measurement:
        """The newest monitor values with their ages. DeviceError once for each failed exchange on the wire."""
        flags = ANGLE_ABSENT
        pressures, raws, ages = [NAN, NAN], [NAN, NAN], [0, 0]
        for number, valve in enumerate(self.valves):
            if valve is None:
                flags |= _ABSENT[number]
                continue
            valve.io.touch()
            report = valve.io.report()
            valve.io.check_errors(report)
            taken_ns = report.stamps_ns[0]
            if not valve.reads or not taken_ns:
                flags |= _ABSENT[number]
                continue
            ages[number] = time.monotonic_ns() - taken_ns
            if ages[number] > valve.max_age_ns:
                raise DeviceError(f"{valve.name} on {valve.device}: no pressure for {ages[number] / 1e6:.0f} ms")
            raws[number] = report.values[0]
            pressures[number] = valve.to_mpa(raws[number])
            if ages[number] > self._period_ns:
                flags |= STALE
        return Measurement(pressures[0], pressures[1], NAN, raws[0], raws[1], NAN, NAN, ages[0], ages[1], 0, flags)

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """Hand the set-points to the I/O processes: microseconds. What a busy wire has not sent yet is replaced."""
        if not (isfinite(p1_cmd_mpa) and isfinite(p2_cmd_mpa)):
            raise DeviceError(f"itv_serial: set-points of {p1_cmd_mpa} and {p2_cmd_mpa} MPa cannot be written")
        for valve, pressure_mpa in zip(self.valves, (p1_cmd_mpa, p2_cmd_mpa), strict=True):
            if valve and valve.drives:
                valve.io.drive((valve.counts(pressure_mpa),))

    def safe(self) -> None:
        """Order the safe set-points on every valve; DevicePending within a period while the wire carries them, which
        takes `safe_within_s`.

        Through its own I/O processes when open, else through those of whoever is, else by opening the port for just
        this.
        """
        problems: list[DeviceError] = []
        driven = [valve for valve in self._used() if valve.drives]
        begun = [_tell(valve) for valve in driven]  # every wire, before the first is waited for
        for valve, is_begun in zip(driven, begun, strict=True):
            try:
                self._await_rescue(valve) if is_begun else self._make_safe(valve)
            except DeviceError as error:
                problems.append(error)
        if problems:
            raise max(problems, key=_gravity)

    @staticmethod
    def _await_rescue(valve: _Valve) -> None:
        """By an I/O process that was begun for it, which stays until `close`: others who come meanwhile find it."""
        valve.io.await_start()
        valve.io.safe(2 * valve.safe_bound_s + 1.0)

    def _make_safe(self, valve: _Valve) -> None:
        patience_s = self._period_ns / 2e9 / len(self._used())
        if valve.io.running:
            try:
                return valve.io.safe(patience_s)
            except DeviceLost:
                if valve.io.alive:
                    raise  # its line is down: it writes the safe set-point as soon as it is back
                return valve.io.restart_safe(patience_s)  # the loop must not wait for it, but call again
        elif alarm(valve.device, patience_s, valve.standing):
            valve.standing.answered()
            return None
        valve.io.begin_rescue()
        return self._await_rescue(valve)

    def holds_safe(self) -> bool | None:
        """Whether every regulator has confirmed its safe set-point by a reply that repeats it; None where that cannot
        be told. DevicePending while it may still come."""
        held = [valve.holds_safe() for valve in self._used() if valve.drives]
        return False if False in held else None if None in held else True

    def close(self) -> None:
        """End the I/O processes; the valves keep their set-points. A safe order on its way is finished first."""
        for valve in self._used():
            valve.io.stop()


def _gravity(error: DeviceError) -> int:
    """Of several errors the gravest counts: what is only on its way comes last."""
    return 0 if isinstance(error, DevicePending) else 1


def _tell(valve: _Valve) -> bool:
    """Ask for the safe set-point by whoever holds the port, without waiting; True: nobody does, and an I/O process was
    begun for it."""
    with contextlib.suppress(DeviceError):
        if valve.io.running:
            valve.io.safe(0.0)
        elif not alarm(valve.device, 0.0, valve.standing):
            valve.io.begin_rescue()
            return True
    return False
