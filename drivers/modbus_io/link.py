"""A Modbus line as its I/O process drives it, going round as fast as the modules answer. RTU, or TCP that is too slow
for the loop.

On RTU the asyncio client is used, one exchange at a time: the synchronous one polls with sleeps and would add 2 to 8
ms.
"""

import asyncio
import contextlib
import termios
import time
from collections.abc import Awaitable, Mapping
from dataclasses import replace
from typing import Any, Final

from pymodbus.client import AsyncModbusSerialClient

from drivers.io_process.worker import Exchange
from drivers.modbus_io.codec import rtu_silence_s
from drivers.modbus_io.plan import ExchangePlan, make_plan
from drivers.modbus_io.read_back import OutputsShown
from drivers.modbus_io.session import ModbusSession, hush, never_give_up
from drivers.modbus_io.settings import ModbusSettings, SerialLine
from drivers.modbus_io.stations import Stations, rebuild
from rig.errors import DeviceError, DeviceLost, WatchdogTripped
from rig.interfaces import Role

_ECHO: Final = "; each request comes back as it was sent: switch the echo of the adapter off"
_FEEDING: Final = 0.25
"""Of the time of the module's watchdog: how often it is asked for something where nothing else is."""


class ModbusLink:
    """A `drivers.io_process.worker.WireLink`: outputs are counts by place, values are counts by place (see plan)."""

    def __init__(
        self, settings: ModbusSettings, roles: frozenset[Role], safe_numbers: dict[int, float], *,
        rescue: bool = False, looking: bool = False,
    ) -> None:  # fmt: skip
        """`rescue`: opened to make safe, for which a module that is not heard is told all the same. `looking`: its
        fail-safe is neither armed nor stopped, unless somebody has it made safe from here."""
        self._settings, self._safe = settings, safe_numbers
        self._back = OutputsShown(safe_numbers, time.monotonic_ns)
        self._safe_wanted = rescue
        """Outputs were driven from here, or are somebody's who is gone: what stands there is not to stay."""
        self._plan: ExchangePlan = make_plan(settings, roles, looking=looking)
        self._loop = asyncio.new_event_loop()
        self._stations: Stations | None = None
        self._failed = False
        """The last exchange did."""
        self._was_up = self._arm_owed = False
        self._read_next = False
        self._blind = False
        """After an outage: the input module has not been looked for again, and is not read."""
        line = settings.serial
        self._silence_s = rtu_silence_s(line.baud, line.bits_per_byte) if line else 0.0
        self._fed_s = 0.0
        """When the module with the outputs was asked for something, where that has to be seen to."""
        self._quiet_s = 0.0
        """Until then the line is to be silent."""
        self._sent = b""
        self._echoed = False
        """What was sent came back as it was."""
        self._busy = line is not None  # a serial line is worth keeping busy; on TCP every order wakes us anyway

    def connect(self) -> Mapping[str, str]:
        """Open the line, prove the modules, arm their fail-safe; after an outage the outputs come first, then the
        fail-safe, and an input module of its own is left for later: it may be what the line was lost by."""
        self.close()  # an attempt before this one may have got as far as a line
        self._blind = self._was_up and not self._plan.one_station and bool(self._plan.writes)
        self._stations = self._open()
        self._failed = self._echoed = False
        try:
            if self._was_up:
                self._arm_owed = True
                return self._stations.prove_outputs() if self._blind else self._stations.prove()
            facts = self._stations.prove_and_arm(self._settings.watchdog_s, self._safe)
        except (DeviceLost, WatchdogTripped):
            raise
        except DeviceError as error:
            self._tell_unheard(self._stations)
            raise DeviceError(f"{error}{_ECHO if self._echoed else ''}") from None
        self._was_up = True
        return facts

    def _tell_unheard(self, stations: Stations) -> None:
        """The safe set-points to a module that does not answer: it may hear what it cannot answer to any more."""
        if self._safe_wanted and stations.outputs.doubtful:
            with contextlib.suppress(DeviceError):
                stations.write(self._safe)

    def _open(self) -> Stations:
        settings = self._settings
        if settings.serial is None and self._blind:
            return Stations.to_outputs(settings, self._plan, settings.patience_s, settings.connect_s)
        if settings.serial is None:
            return Stations.on_tcp(settings, self._plan, settings.patience_s)
        session = self._open_serial()
        return Stations(session, session, self._plan)

    def _open_serial(self) -> ModbusSession:
        hush()
        line = self._settings.serial
        assert line
        reply_s = self._plan.round_s(line) + self._settings.patience_s
        try:
            client, opened = self._loop.run_until_complete(_connected(line, reply_s))
        except (OSError, ValueError, termios.error) as error:
            raise DeviceError(f"{line.device}: cannot be opened: {error}") from None
        if not opened:
            raise DeviceError(
                f"{line.device}: cannot be opened: no such port, in use by another program, or not allowed"
            )
        never_give_up(client.ctx)
        client.ctx.trace_packet = self._trace
        return ModbusSession(client, line.device, self._loop_until, self._get_ready)

    def exchange(self, outputs: tuple[float, ...] | None, fresh: bool, urgent: bool) -> Exchange:
        """Function 23 where there is one; else outputs when they are new, and inputs in between unless it is urgent."""
        self._read_next = self._read_next and not urgent
        stations = self._stations
        if stations is None:
            raise DeviceLost(f"{self._settings.resource}: not connected")
        self._settle()
        numbers = {place: outputs[place] for place in self._plan.driven} if outputs else None
        self._safe_wanted = self._safe_wanted or numbers is not None
        if self._safe_wanted and self._plan.looking:
            self._plan = stations.plan = replace(self._plan, looking=False)
        try:
            if self._blind and numbers is None:
                stations = self._see_again(stations)
            done = self._round(stations, numbers, fresh, urgent)
            self._failed = False
            if urgent and done.sent and self._back.holds_safe(stations) is False:
                raise DeviceError(f"{self._settings.resource}: the outputs do not hold the safe set-points")
            self._pay_arming(stations)
            return done
        except DeviceError:
            self._failed = True
            self._pay_arming(stations)  # it may have tripped meanwhile, and refuse writes until it is armed anew
            raise

    def _see_again(self, stations: Stations) -> Stations:
        """Look for the input module after an outage, once nothing is to be written any more."""
        if self._settings.serial is None:
            whole = Stations.on_tcp(self._settings, self._plan, self._settings.patience_s)
            stations.close(disarm=False)
            self._stations = stations = whole
        stations.prove()
        self._blind = False
        return stations

    def _pay_arming(self, stations: Stations) -> None:
        if self._arm_owed:
            stations.arm(self._settings.watchdog_s, self._safe)
            self._arm_owed = False

    def _round(self, stations: Stations, numbers: dict[int, float] | None, fresh: bool, urgent: bool) -> Exchange:
        if self._back.owed and not urgent:
            self._back.look(stations)
        asked_ns, reads = time.monotonic_ns(), self._plan.registers > 0 and not self._blind
        if numbers is not None and fresh and urgent:
            stations.write_safe(numbers, self._settings.watchdog_s)
            return Exchange(sent=True, busy=reads)
        if numbers is not None and self._plan.can_combine:
            found = stations.read_write(numbers)
            self._back.wrote(stations, numbers)
            return Exchange(True, _stamped(found, asked_ns), self._busy)
        if numbers is not None and (fresh or not reads) and not self._read_next:
            stations.write(numbers)
            self._back.wrote(stations, numbers)
            self._fed_s = time.monotonic()
            self._read_next = reads
            return Exchange(sent=True, busy=self._read_next)
        self._read_next = False
        if self._plan.must_feed and time.monotonic() - self._fed_s > _FEEDING * self._settings.watchdog_s:
            self._fed_s = time.monotonic()
            stations.feed(numbers)
            return Exchange(busy=self._busy)
        if not reads:
            return Exchange(busy=False)
        return Exchange(values=_stamped(stations.read(), asked_ns), busy=self._busy)

    def _get_ready(self) -> None:
        """The silence that parts two frames, which asyncio would round up to whole milliseconds; then whatever came
        unasked is thrown away, or a reply that was sent twice would answer the next request, and each from then on."""
        if (left_s := self._quiet_s - time.monotonic()) > 0:
            time.sleep(left_s)
        self._loop.run_until_complete(asyncio.sleep(0))

    def _loop_until(self, response: Awaitable[Any]) -> Any:
        try:
            return self._loop.run_until_complete(response)
        finally:
            self._quiet_s = time.monotonic() + self._silence_s

    def _trace(self, sending: bool, data: bytes) -> bytes:
        """pymodbus shows every frame."""
        if sending:
            self._sent = data
        elif self._sent and data.startswith(self._sent):
            self._echoed = True
        return data

    def _settle(self) -> None:
        """RTU replies have no number: after a failure, wait until a late one has come and been thrown away."""
        line = self._settings.serial
        if self._failed and line is not None:
            self._loop.run_until_complete(asyncio.sleep(self._plan.round_s(line) + self._settings.patience_s / 2))
        self._failed = False

    def close(self, settled: bool = False) -> None:
        """Let go of the line; a fail-safe that would change outputs that are `settled` is stopped."""
        stations, self._stations = self._stations, None
        if stations is not None:
            ours = stations.armed or self._was_up  # else it may be another module's, and none of our business
            stations.close(disarm=settled and ours, get_ready=self._settle)
            self._loop.run_until_complete(asyncio.sleep(0))


async def _connected(line: SerialLine, reply_s: float) -> tuple[AsyncModbusSerialClient, bool]:
    """The client wants to be made where its event loop runs."""
    client = AsyncModbusSerialClient(
        line.device,
        baudrate=line.baud,
        parity=line.parity,
        stopbits=line.stop_bits,
        timeout=reply_s,
        retries=0,
        reconnect_delay=0,
    )
    return client, await client.connect()


def _stamped(numbers: Mapping[int, float], asked_ns: int) -> dict[int, tuple[float, int]]:
    """Values with the time of the request: the module sampled after it, so they are a little younger than they are said
    to be."""
    return {place: (number, asked_ns) for place, number in numbers.items()}


def link(settings: dict[str, Any]) -> ModbusLink:
    """The link from plain JSON data, as the owner sends it."""
    safe = {int(place): number for place, number in settings["safe"].items()}
    roles = frozenset(Role(role) for role in settings["roles"])
    how = {key: settings.get(key, False) for key in ("rescue", "looking")}
    return ModbusLink(rebuild(settings["device"]), roles, safe, **how)
