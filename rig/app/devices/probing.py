"""Probing a rig's devices: do they answer, how fast, what do they see, and are the valves wired as the config says."""

import dataclasses
from collections.abc import Callable
from typing import Any

from rich.table import Table

from rig.app import compose, inventory
from rig.app.devices.bringup import DeviceTicker, Timing, let_go, step_valves, time_reads
from rig.app.overseen import check_last_resort, overseen
from rig.app.terminal import listing
from rig.errors import CheckFailed, DeviceError
from rig.realtime.clock import MonotonicClock
from rig.rig_config import DeviceEntry, RigConfig

WARM_UP_TICKS = 20
_SEEN = {
    "BROKEN_WIRE": "a monitor reads below its live zero: 0 V on 1-5 V or 0 mA on 4-20 mA is a broken wire, not 0 MPa",
    "SUSPECT": "a value is out of range; for the angle: the potentiometer is open, without excitation, or in its "
    "dead zone",
}


def probe(rig: RigConfig, ticks: int, update: Callable[[float, str], None] = lambda *_: None) -> dict[str, Any]:
    """Open each device by itself, time `ticks` reads, close it. Nothing is written."""
    found: list[dict[str, Any]] = []
    for number, entry in enumerate(rig.devices):

        def tick_done(done: int, before: int = number * ticks, name: str = entry.name) -> None:
            update(before + done, name)

        found.append(_probe_one(rig, entry, ticks, tick_done))
    findings = [line for one in found for line in one["findings"]]
    return {
        "rig": rig.name,
        "period_ms": rig.period_ns / 1e6,
        "devices": found,
        "findings": findings,
        "warnings": inventory.warnings(rig),
    }


def _probe_one(rig: RigConfig, entry: DeviceEntry, ticks: int, tick_done: Callable[[int], None]) -> dict[str, Any]:
    device = compose.make_device(dataclasses.replace(rig, devices=(entry,)), MonotonicClock())
    row: dict[str, Any] = {"name": entry.name, "kind": entry.kind, "answers": False, "facts": {}, "findings": []}
    try:
        row["facts"] = dict(device.open())
        time_reads(device, rig.period_ns, WARM_UP_TICKS)
        timing = time_reads(device, rig.period_ns, ticks, tick_done)
    except (DeviceError, CheckFailed) as error:
        row["findings"].append(f"{entry.name}: {error}")
        return row
    finally:
        let_go(device)
    row |= {"answers": True, **_timing_facts(timing, rig.period_ns)}
    row["findings"] += _findings(entry, timing, rig.period_ns)
    return row


def _timing_facts(timing: Timing, period_ns: int) -> dict[str, Any]:
    facts: dict[str, Any] = {key: value for key, value in dataclasses.asdict(timing).items() if key != "last"}
    last = timing.last
    facts["holds_period"] = timing.holds(period_ns)
    facts["values_fresh"] = timing.fresh(period_ns)
    facts["last"] = (
        None
        if last is None
        else {key: getattr(last, key) for key in ("p1_mpa", "p2_mpa", "angle_deg", "excitation_raw")}
    )
    return facts


def _findings(entry: DeviceEntry, timing: Timing, period_ns: int) -> list[str]:
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


def steps(rig: RigConfig, step_mpa: float, settle_s: float, *, force: bool = False) -> dict[str, Any]:
    """Step each valve alone; MOVES THE RIG, and leaves it in its safe state. RigError for a watchdog that takes too
    long, unless forced."""
    device = compose.make_device(rig, MonotonicClock())
    safe = rig.safe.p1_mpa, rig.safe.p2_mpa
    try:
        with DeviceTicker(device, rig.period_ns, safe, overseen(rig)) as ticker:
            check_last_resort(rig, ticker.facts, force)
            results = step_valves(ticker, safe, step_mpa, settle_s)
    except DeviceError as error:
        return {"steps": [], "findings": [str(error)]}
    return {
        "steps": [dataclasses.asdict(one) for one in results],
        "findings": list(filter(None, (one.finding() for one in results))),
    }


def table(result: dict[str, Any]) -> Table:
    """For a person: what each device answers."""
    holds = f"holds {result['period_ms']:g} ms"
    shown = listing("device", "answers", "read us\np50 / p99", "age ms\np50 / p99", holds, "sees")
    for row in result["devices"]:
        if not row["answers"]:
            shown.add_row(row["name"], "no", "", "", "", "")
            continue
        last = row["last"] or {}
        sees = "\n".join(f"{key} {value:.3f}" for key, value in last.items() if value == value)
        fresh = "yes" if row["values_fresh"] else "yes, with\nold values"
        shown.add_row(
            row["name"], "yes", f"{row['read_p50_us']:.0f} / {row['read_p99_us']:.0f}",
            f"{row['age_p50_ms']:.2f} / {row['age_p99_ms']:.2f}", fresh if row["holds_period"] else "no", sees,
        )  # fmt: skip
    return shown


def moved(result: dict[str, Any]) -> list[str]:
    """What followed from each step, one line a valve."""
    return [
        f"valve {one['valve']} stepped {one['step_mpa']:+g} MPa: p1 {one['moved_1_mpa']:+.3f} MPa, "
        f"p2 {one['moved_2_mpa']:+.3f} MPa, angle {one['moved_deg']:+.2f} deg"
        for one in result.get("steps", ())
    ]


def facts(result: dict[str, Any]) -> list[str]:
    """What each device said of itself, one line a fact."""
    return [f"{row['name']}: {key} {value}" for row in result["devices"] for key, value in row["facts"].items()]


def judge(result: dict[str, Any]) -> None:
    """CheckFailed with the first finding, when there is one."""
    if result["findings"]:
        first, *others = result["findings"]
        count = f"; {len(others)} other finding{'s' * (len(others) > 1)} above" if others else ""
        raise CheckFailed(first + count)
