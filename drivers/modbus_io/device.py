"""A Modbus analog module, TCP or RTU, as a Device of the loop."""

from collections.abc import Mapping
from math import isfinite
from typing import Final

from drivers.io_process.alarm import StandingAlarm, alarm, confirmed
from drivers.modbus_io.channels import Inputs, set_point_signals
from drivers.modbus_io.plan import make_plan
from drivers.modbus_io.routes import Direct, Process, Route, round_trip
from drivers.modbus_io.session import set_reply_time
from drivers.modbus_io.settings import ExchangeMode, ModbusSettings
from drivers.modbus_io.stations import Numbers, Stations, set_point_numbers
from rig.errors import DeviceError, DeviceLost, DevicePending
from rig.interfaces import Abilities, DeviceContext, Measurement
from rig.sample import STALE

_SHARE: Final = 0.6
"""Share of the period that the exchanges of a tick may take by the p99 of the measured round trip."""
_REPLY_SHARE: Final = 0.4
"""Share of the period after which a reply is late, unless the settings say otherwise; one in pieces may take twice
that."""
_RESCUE_S: Final = 0.02
"""Connecting for the sake of the safe set-points may take this long."""


class ModbusIo(Abilities):
    """Analog outputs and inputs of a Modbus module, TCP or RTU, from its register map.

    `open` measures the round trip and chooses how a tick's exchanges are made (see ExchangeMode); it changes no output,
    but arms the module's own fail-safe where the map has one. `close` stops that fail-safe, so outputs stay, unless the
    safe state is owed. `safe` from a second instance in another process goes through a connection of its own on TCP,
    and through the I/O process that holds the port on RTU.
    """

    Settings = ModbusSettings
    second_path = True

    def __init__(self, settings: ModbusSettings, context: DeviceContext) -> None:
        self.roles = context.roles
        self.further = tuple(settings.further)
        self._settings, self._context = settings, context
        self._plan = make_plan(settings, context.roles, looking=context.looking, where=context.where or "modbus_io")
        self._inputs = Inputs(settings, context, self._plan)
        self._signals = set_point_signals(settings, context)
        self._safe = self.numbers(context.safe_p1_mpa, context.safe_p2_mpa) if self._plan.driven else {}
        self._period_s = context.period_ns / 1e9
        self._route: Route | None = None
        self._standing = StandingAlarm()
        self._safe_owed = False
        """The last safe state that was asked for could not be written."""

    def numbers(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> Numbers:
        if not (isfinite(p1_cmd_mpa) and isfinite(p2_cmd_mpa)):
            raise DeviceError(
                f"{self._settings.resource}: set-points of {p1_cmd_mpa} and {p2_cmd_mpa} MPa cannot be written"
            )
        return set_point_numbers(self._plan, self._signals, (p1_cmd_mpa, p2_cmd_mpa))

    def open(self) -> Mapping[str, str]:
        """Connect, prove the module, arm its fail-safe, measure the round trip, choose the mode."""
        self.close()
        facts: dict[str, str] = {}
        if self._settings.serial is None and (self._settings.mode is not ExchangeMode.PROCESS or self._plan.looking):
            facts |= self._open_direct()
            if self._route is not None:
                return facts
        process = Process(self._settings, self._context, self._safe)
        facts |= {**process.io.start(), "mode": ExchangeMode.PROCESS.value}
        if line := self._settings.serial:
            facts["round_wire_s"] = f"{self._plan.round_s(line):.5f}"
            facts["rate_hz"] = f"{1 / self._plan.round_s(line):.1f} at best"
        self._route = process
        return facts

    def _open_direct(self) -> dict[str, str]:
        """The direct route, or none when the module is too slow for it."""
        settings = self._settings
        stations = Stations.on_tcp(settings, self._plan, settings.patience_s)
        try:
            facts = stations.prove_and_arm(settings.watchdog_s, self._safe)
            p50_s, p99_s = round_trip(stations)
            mode = self._choose(p99_s)
            facts |= {"round_trip_us": f"p50 {p50_s * 1e6:.0f}, p99 {p99_s * 1e6:.0f}", "mode": mode.value}
        except BaseException:  # whatever it was: nobody else knows of this line, nor feeds the watchdog behind it
            stations.close(disarm=stations.armed)
            raise
        if mode is ExchangeMode.PROCESS and not self._plan.looking:  # a process would write
            stations.close()
            return facts
        for session in (stations.outputs, stations.inputs):
            set_reply_time(session.client, settings.reply_s or _REPLY_SHARE * self._period_s)
        self._route = Direct(stations, self._context, self._safe, mode is ExchangeMode.COMBINED, settings.watchdog_s)
        return facts

    def _choose(self, p99_s: float) -> ExchangeMode:
        wanted = self._settings.mode
        if wanted is ExchangeMode.COMBINED and not self._plan.can_combine:
            raise DeviceLost(
                f"{self._settings.resource}: mode combined needs function 23, both valves side by side, and inputs"
            )
        if wanted is not ExchangeMode.AUTO:
            return wanted
        exchanges = len(self._plan.writes) + (self._plan.registers > 0)
        if exchanges * p99_s <= _SHARE * self._period_s:
            return ExchangeMode.SEPARATE
        if self._plan.can_combine and p99_s <= _SHARE * self._period_s:
            return ExchangeMode.COMBINED
        return ExchangeMode.PROCESS

    def read(self) -> Measurement:
        """All wanted inputs; DeviceError when the module did not answer in time or answered nonsense."""
        numbers, age_ns = self._opened().read()
        stale = STALE if age_ns > self._context.period_ns else 0
        return self._inputs.measurement(numbers, age_ns, stale)

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """Both set-points in one request when their channels lie side by side, so that they change together."""
        route = self._opened()
        if self._plan.driven:
            route.write(self.numbers(p1_cmd_mpa, p2_cmd_mpa))
            self._safe_owed = False

    def safe(self) -> None:
        """The safe set-points, through the open line or, when that fails or is not there, by a way of its own."""
        if not self._plan.driven:
            return
        self._safe_owed = True
        self._make_safe()
        self._safe_owed = False

    def _make_safe(self) -> None:
        feeding = False
        if self._route is not None:
            try:
                self._route.safe(self._safe)
                return
            except DevicePending:
                raise  # its I/O process writes them
            except DeviceLost:
                if isinstance(self._route, Process) and self._route.io.alive:
                    raise  # its line is down: it writes the safe set-points as soon as it is back
            except DeviceError:
                if isinstance(self._route, Process):
                    raise  # an exchange failed: it tries again
                feeding = True  # by the line that is still there; the way below may get through
        self._rescue(feeding)

    def _rescue(self, feeding: bool) -> None:
        settings = self._settings
        if isinstance(self._route, Process):
            self._route.restart_safe()
        elif self._route is not None:  # the loop calls, and must not wait
            self._rescue_on_tcp(_REPLY_SHARE * self._period_s, _REPLY_SHARE * self._period_s, feeding)
        elif alarm(settings.resource, self._period_s / 2, self._standing):
            self._standing.answered()
        elif settings.serial is None:
            self._rescue_on_tcp(settings.patience_s, _RESCUE_S, feeding)
        else:
            self._rescue_by_process()

    def _rescue_on_tcp(self, reply_s: float, connect_s: float, feeding: bool) -> None:
        """A connection for just this. Nobody feeds the watchdog after a rescue from outside, or past a line that is
        lost: it is stopped, so that the set-points stay. Not beside whoever goes on `feeding`, who would be without it
        from then on."""
        stations = Stations.to_outputs(self._settings, self._plan, reply_s, connect_s)
        try:
            stations.write_safe(self._safe, self._settings.watchdog_s)
        finally:
            stations.close(disarm=not feeding and not self._context.driven())

    def _rescue_by_process(self) -> None:
        process = Process(self._settings, self._context, self._safe)
        process.io.start_rescue()
        self._route = process  # it stays until `close`: others who come meanwhile find it, and what it has confirmed
        process.io.safe(1.0)

    def holds_safe(self) -> bool | None:
        """Whether the output registers hold the safe set-points, where the map says how to read them back: asked now on
        TCP, as the I/O process read them on RTU."""
        if self._route is not None:
            return self._route.holds_safe()
        if not self._plan.driven or self._plan.module.read_back is None:
            return None
        if self._settings.serial is not None:
            return confirmed(self._settings.resource)
        stations = Stations.to_outputs(self._settings, self._plan, self._settings.patience_s, _RESCUE_S)
        try:
            return stations.hold(self._safe)
        finally:
            stations.close(disarm=False)

    def keep(self) -> None:
        """Ask the module for something, so that its watchdog leaves the outputs as they are."""
        if self._plan.driven:
            self._opened().keep()

    def close(self) -> None:
        """Let go; outputs stay, but for a safe state that could not be written: that is left to the module's own
        fail-safe."""
        route, self._route = self._route, None
        owed, self._safe_owed = self._safe_owed, False
        if route is not None:
            route.close(disarm=not owed)

    def _opened(self) -> Route:
        if self._route is None:
            raise DeviceLost(f"{self._settings.resource}: not open")
        return self._route
