"""Probing a rig's devices: do they answer, how fast, what do they see, and are the valves wired as the config says."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from rich.table import Table

from rig.app import compose, inventory, supervise, wire_locks
from rig.app.devices.bringup import DeviceTicker, StepResult, let_go, step_valves
from rig.app.devices.timing import DeviceTiming, time_reads
from rig.app.supervised_command import check_last_resort, supervised
from rig.app.terminal import listing
from rig.errors import CheckFailed, DeviceError, RigError, WatchdogTripped
from rig.realtime.clock import MonotonicClock
from rig.rig_config import DeviceEntry, RigConfig

WARM_UP_TICKS = 20
"""Reads before the timed ones, whose own times do not count."""
_LOOK_NS: Final = 100_000_000
"""How often a bystander asks whether the rig is still driven: a fifth of the usual watchdog's time."""
_MEASURED: Final = ("p1_mpa", "p2_mpa", "angle_deg", "excitation_raw")
_SEEN = {
    "BROKEN_WIRE": "a monitor reads below its live zero: 0 V on 1-5 V or 0 mA on 4-20 mA is a broken wire, not 0 MPa",
    "SUSPECT": "a value is out of range; for the angle: the potentiometer is open, without excitation, or in its "
    "dead zone",
}


class Bystander:
    """Looks at a rig for as long as whoever drives it does.

    A device's own watchdog is what makes safe when all processes that drive a rig are lost at once, and each reading
    feeds it: a bystander who reads on would keep their last set-points on the valves.
    """

    def __init__(self, wires: Sequence[str], now_ns: Callable[[], int]) -> None:
        self._wires, self._now_ns = wires, now_ns
        self._looked_ns, self._driver = now_ns(), wire_locks.who_drives(wires)
        self.alone = False
        """Whoever drove the rig has ended."""

    def look(self) -> None:
        """CheckFailed when nobody drives the rig any more, and somebody did; asked each `_LOOK_NS`."""
        if (now_ns := self._now_ns()) - self._looked_ns < _LOOK_NS:
            return
        before, self._driver, self._looked_ns = self._driver, wire_locks.who_drives(self._wires), now_ns
        self.alone = bool(before) and not self._driver
        if self.alone:
            raise CheckFailed(
                f"a moment ago {before}, and now by nobody: reading ended here, for it keeps a device's own watchdog "
                "from making the rig safe"
            )


@dataclass(frozen=True)
class DeviceAnswer:
    """How one device answered; without `timing` it did not."""

    name: str
    kind: str
    facts: Mapping[str, Any]
    """What it says of itself."""
    findings: tuple[str, ...] = ()
    timing: DeviceTiming | None = None
    tripped: bool = False
    """Its own watchdog keeps it from answering, and nobody drives it."""

    @property
    def sees(self) -> dict[str, float] | None:
        """What it measured last; None when it measured nothing."""
        last = None if self.timing is None else self.timing.last
        return None if last is None else {key: getattr(last, key) for key in _MEASURED}

    def to_json(self, period_ns: int) -> dict[str, Any]:
        plain = {"name": self.name, "kind": self.kind, "answers": self.timing is not None, "facts": dict(self.facts)}
        if self.timing is not None:
            timing = {key: value for key, value in dataclasses.asdict(self.timing).items() if key != "last"}
            plain |= timing | {
                "holds_period": self.timing.holds(period_ns),
                "values_fresh": self.timing.fresh(period_ns),
                "last": self.sees,
            }
        return plain | {"findings": list(self.findings)}


@dataclass(frozen=True)
class Probe:
    """What a probe of a rig found."""

    rig: str
    period_ns: int
    devices: tuple[DeviceAnswer, ...]
    findings: tuple[str, ...]
    warnings: tuple[str, ...]
    steps: tuple[StepResult, ...] | None = None
    """None where no valve was stepped."""

    def to_json(self) -> dict[str, Any]:
        """The JSON of the command."""
        plain: dict[str, Any] = {
            "rig": self.rig,
            "period_ms": self.period_ns / 1e6,
            "devices": [one.to_json(self.period_ns) for one in self.devices],
            "findings": list(self.findings),
            "warnings": list(self.warnings),
        }
        return plain if self.steps is None else plain | {"steps": [dataclasses.asdict(one) for one in self.steps]}


def probe(rig: RigConfig, ticks: int, update: Callable[[float, str], None] = lambda *_: None) -> Probe:
    """Open each device by itself, time `ticks` reads, close it. Nothing is written, armed or disarmed: a daemon may be
    driving the rig, and when that ends meanwhile, so does the probe."""
    found: list[DeviceAnswer] = []
    bystander = Bystander(compose.wires_of(rig), MonotonicClock().now_ns)
    for number, entry in enumerate(rig.devices):

        def tick_done(done: int, before: int = number * ticks, name: str = entry.name) -> None:
            update(before + done, name)

        found.append(_probe_one(rig, entry, ticks, tick_done, bystander))
        if bystander.alone:
            break
    findings = tuple(line for one in found for line in one.findings)
    return Probe(rig.name, rig.period_ns, tuple(found), findings, tuple(inventory.warnings(rig)))


def _probe_one(
    rig: RigConfig, entry: DeviceEntry, ticks: int, tick_done: Callable[[int], None], bystander: Bystander
) -> DeviceAnswer:
    device = compose.make_device(dataclasses.replace(rig, devices=(entry,)), MonotonicClock(), looking=True)
    facts: Mapping[str, Any] = {}
    try:
        facts = dict(device.open())
        time_reads(device, rig.period_ns, WARM_UP_TICKS, before_read=bystander.look)
        timing = time_reads(device, rig.period_ns, ticks, tick_done, bystander.look)
    except WatchdogTripped as error:
        driver = wire_locks.who_drives(compose.wires_of(rig))
        line = f"{entry.name}: {_after_a_trip(rig, driver)} ({error})"
        return DeviceAnswer(entry.name, entry.kind, facts, (line,), tripped=not driver)
    except (DeviceError, CheckFailed) as error:
        return DeviceAnswer(entry.name, entry.kind, facts, (f"{entry.name}: {error}",))
    finally:
        let_go(device)
    return DeviceAnswer(entry.name, entry.kind, facts, tuple(_findings(entry, timing, rig.period_ns)), timing)


def _after_a_trip(rig: RigConfig, driver: str) -> str:
    """What it means, and what to do about it."""
    tripped = "its own watchdog has tripped, as when a computer is lost, and refuses all until it is started anew"
    if driver:
        return f"{tripped}: {driver}: reset it there"
    return (
        f"{tripped}, which a probe that only looks does not do: `pamrig service safe --rig {rig.path}` does, and "
        f"writes the safe pressures, {rig.safe.p1_mpa:g} and {rig.safe.p2_mpa:g} MPa (MOVES THE RIG); so does --step"
    )


def clear_trips(rig: RigConfig, found: Probe) -> bool:
    """Whether the watchdog of a device had tripped, and was started anew by the safe state: MOVES THE RIG. RigError
    when the device does not take it."""
    if tripped := any(one.tripped for one in found.devices):
        supervise.make_safe(rig)
    return tripped


def _findings(entry: DeviceEntry, timing: DeviceTiming, period_ns: int) -> list[str]:
    lines = []
    if not timing.holds(period_ns):
        lines.append(
            f"{entry.name}: cannot hold {period_ns / 1e6:g} ms: reads take {timing.read_p99_us / 1e3:.2f} ms at p99, "
            f"{timing.failed} of {timing.ticks} failed{': ' + timing.last_error if timing.last_error else ''}"
        )
    for flag, meaning in _SEEN.items():
        if timing.flags.get(flag, 0) > timing.ticks // 2:
            lines.append(f"{entry.name}: {meaning}")
    return lines


def check_step(rig: RigConfig, step_mpa: float) -> None:
    """RigError for a step that would leave the rig's envelope: there is no guard of a loop behind it."""
    top = rig.limits.pressure_mpa[1]
    if (reached := max(rig.safe.p1_mpa, rig.safe.p2_mpa) + step_mpa) > top + 1e-9:
        raise RigError(
            f"--step-mpa {step_mpa:g}: from the safe pressure that reaches {reached:g} MPa, above {top:g} MPa, the end "
            f"of limits.pressure_mpa of {rig.path}"
        )


def stepped(rig: RigConfig, found: Probe, step_mpa: float, settle_s: float, *, force: bool = False) -> Probe:
    """What was found, with what followed when each valve was stepped alone; MOVES THE RIG, and leaves it in its safe
    state. RigError for a step that leaves the envelope, and for a watchdog that takes too long, unless forced."""
    check_step(rig, step_mpa)
    device = compose.make_device(rig, MonotonicClock())
    safe = rig.safe.p1_mpa, rig.safe.p2_mpa
    try:
        with (
            wire_locks.held(compose.held_wires(rig)),
            DeviceTicker(device, rig.period_ns, safe, supervised(rig)) as ticker,
        ):
            check_last_resort(rig, ticker.facts, force)
            results = step_valves(ticker, safe, step_mpa, settle_s)
    except DeviceError as error:
        return dataclasses.replace(found, steps=(), findings=(str(error),))
    findings = tuple(filter(None, (one.finding() for one in results)))
    return dataclasses.replace(found, steps=tuple(results), findings=findings)


def table(found: Probe) -> Table:
    """For a person: what each device answers."""
    holds = f"holds {found.period_ns / 1e6:g} ms"
    shown = listing("device", "answers", "read us\np50 / p99", "age ms\np50 / p99", holds, "sees")
    for one in found.devices:
        timing = one.timing
        if timing is None:
            shown.add_row(one.name, "no", "", "", "", "")
            continue
        sees = "\n".join(f"{key} {value:.3f}" for key, value in (one.sees or {}).items() if value == value)
        fresh = "yes" if timing.fresh(found.period_ns) else "yes, with\nold values"
        holding = fresh if timing.holds(found.period_ns) else "no"
        took = f"{timing.read_p50_us:.0f} / {timing.read_p99_us:.0f}"
        shown.add_row(one.name, "yes", took, f"{timing.age_p50_ms:.2f} / {timing.age_p99_ms:.2f}", holding, sees)
    return shown


def moved(found: Probe) -> list[str]:
    """What followed from each step, one line a valve."""
    return [
        f"valve {one.valve} stepped {one.step_mpa:+g} MPa: p1 {one.moved_1_mpa:+.3f} MPa, "
        f"p2 {one.moved_2_mpa:+.3f} MPa, angle {one.moved_deg:+.2f} deg"
        for one in found.steps or ()
    ]


def facts(found: Probe) -> list[str]:
    """What each device said of itself, one line a fact."""
    return [f"{one.name}: {key} {value}" for one in found.devices for key, value in one.facts.items()]


def judge(findings: Sequence[str]) -> None:
    """CheckFailed with the first finding, when there is one."""
    if findings:
        first, *others = findings
        count = f"; {len(others)} other finding{'s' * (len(others) > 1)} above" if others else ""
        raise CheckFailed(first + count)
