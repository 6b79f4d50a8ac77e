"""The two ways in which a tick's exchanges are made: in the loop itself, or by an I/O process that goes round by
itself."""

import time
from dataclasses import replace
from typing import Final, Protocol

from drivers.io_process.owner import IoProcess
from drivers.io_process.worker import WorkerSetup
from drivers.modbus_io.plan import VALVES, make_plan
from drivers.modbus_io.read_back import OutputsShown
from drivers.modbus_io.settings import ModbusSettings
from drivers.modbus_io.stations import Numbers, Stations
from rig.config import unstructure
from rig.errors import DeviceError
from rig.interfaces import DeviceContext

_PROBES: Final = 200


class Route(Protocol):
    """One way to make the exchanges of a tick."""

    def read(self) -> tuple[Numbers, int]:
        """Inputs and their age (ns)."""

    def write(self, numbers: Numbers) -> None:
        """Set-points in counts."""

    def safe(self, numbers: Numbers) -> None:
        """The safe set-points, now."""

    def holds_safe(self) -> bool | None:
        """Whether the safe set-points stand at the outputs by the module's word; None when there is nobody to ask."""

    def keep(self) -> None:
        """Feed the module's watchdog."""

    def close(self, disarm: bool = True) -> None:
        """Let go; without `disarm` the module's own fail-safe goes on."""


def round_trip(stations: Stations) -> tuple[float, float]:
    """Median and 99th percentile of one exchange, in seconds; zero when there is nothing to read."""
    if not stations.plan.registers:
        return 0.0, 0.0
    times = []
    for _ in range(_PROBES):
        began = time.perf_counter()
        stations.read()
        times.append(time.perf_counter() - began)
    times.sort()
    return times[_PROBES // 2], times[-_PROBES // 100]


class Direct:
    """Exchanges made in the loop itself, each bounded by a share of the period."""

    def __init__(
        self, stations: Stations, context: DeviceContext, safe: Numbers, combined: bool, watchdog_s: float
    ) -> None:
        self._stations, self._now = stations, context.clock.now_ns
        self._back = OutputsShown(safe, self._now)
        self._combined, self._watchdog_s = combined, watchdog_s
        self._brought: tuple[Numbers, int] | None = None
        self._has_watchdog, self._must_feed = stations.plan.module.failsafe is not None, stations.plan.must_feed
        self._fed = False
        """Something was written since the last reading."""
        self._standing: Numbers | None = None

    def read(self) -> tuple[Numbers, int]:
        brought, self._brought = self._brought, None
        fed, self._fed = self._fed, False
        if self._back.owed:
            self._back.look(self._stations)
        elif self._must_feed and not fed:
            self._stations.feed(self._standing)
        if brought is None:
            if not self._stations.plan.registers:
                return {}, 0
            asked_ns = self._now()
            brought = self._stations.read(), asked_ns
        numbers, asked_ns = brought
        return numbers, self._now() - asked_ns

    def write(self, numbers: Numbers) -> None:
        self._fed, self._standing = True, numbers
        if self._combined:
            asked_ns = self._now()
            self._brought = self._stations.read_write(numbers), asked_ns
        else:
            self._stations.write(numbers)
        self._back.wrote(self._stations, numbers)

    def safe(self, numbers: Numbers) -> None:
        self._brought = None
        self._fed, self._standing = True, numbers
        self._stations.write_safe(numbers, self._watchdog_s)

    def holds_safe(self) -> bool | None:
        return self._back.holds_safe(self._stations)

    def keep(self) -> None:
        if self._has_watchdog:
            self._stations.feed(self._standing)

    def close(self, disarm: bool = True) -> None:
        self._stations.close(disarm)


class Process:
    """Exchanges made by an I/O process; here only its newest report is looked at."""

    def __init__(self, settings: ModbusSettings, context: DeviceContext, safe: Numbers) -> None:
        plan = make_plan(settings, context.roles, looking=context.looking)
        self._plan = plan
        job = WorkerSetup(
            "drivers.modbus_io.link",
            {
                "device": unstructure(settings),
                "roles": sorted(context.roles),
                "safe": {str(place): number for place, number in safe.items()},
                "looking": context.looking,
            },
            tuple(safe.get(place, 0.0) for place in (0, 1)) if safe else (),
            settings.silence_periods * context.period_ns,
        )
        round_s = plan.round_s(settings.serial) if settings.serial else 0.0
        worst_ns = int(1e9 * (2 * round_s + 2 * settings.patience_s))
        self._max_age_ns = 4 * worst_ns
        self._patience_s = context.period_ns / 2e9
        outputs = {
            "device": unstructure(replace(settings, further={})),
            "roles": sorted(context.roles & set(VALVES)),
            "rescue": True,
            "looking": False,
        }
        # the rescue is for the outputs alone: whether there are inputs to be had does not matter
        rescue = job._replace(settings=job.settings | outputs)
        self.io = IoProcess(settings.resource, job, rescue, hang_ns=4 * worst_ns + 100_000_000)

    def read(self) -> tuple[Numbers, int]:
        self.io.touch()
        report = self.io.report()
        self.io.check_errors(report)
        if not self._plan.picks:
            return {}, 0
        taken_ns = min(report.stamps_ns[place] for place in self._plan.picks)
        age_ns = time.monotonic_ns() - taken_ns
        if not taken_ns:
            return {}, 0
        if age_ns > self._max_age_ns:
            raise DeviceError(f"{self.io.resource}: no value for {age_ns / 1e6:.0f} ms")
        return {place: report.values[place] for place in self._plan.picks}, age_ns

    def write(self, numbers: Numbers) -> None:
        self.io.drive(tuple(numbers.get(place, 0.0) for place in (0, 1)))

    def safe(self, numbers: Numbers) -> None:
        self.io.safe(self._patience_s)

    def restart_safe(self) -> None:
        """The process is dead or stuck: another one, for which the loop must not wait, but call again."""
        self.io.restart_safe(self._patience_s)

    def holds_safe(self) -> bool | None:
        return self.io.confirmed() if self._plan.module.read_back is not None else None

    def keep(self) -> None:  # its I/O process does
        self.io.touch()

    def close(self, disarm: bool = True) -> None:  # its I/O process knows by itself what it has reached
        self.io.stop()
