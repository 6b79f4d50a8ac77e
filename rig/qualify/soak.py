"""A soak: a daemon that sweeps for hours, while memory, descriptors and losses are watched from outside."""

import contextlib
import os
import re
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from rig.errors import RigError
from rig.number_text import counted
from rig.qualify import stalls
from rig.qualify.faults.bench import FaultBench
from rig.qualify.witness import Witnesses

RIG: Final = """\
name: soak
period_ms: 5
safe: {{p1_mpa: 0.2, p2_mpa: 0.2}}
limits: {{misses_per_s: 1000, stall_periods: 1000}}
devices:
  main: {{kind: simulated, model: {model}, seed: 1}}
roles: {{valve_1: main, valve_2: main, monitor_1: main, monitor_2: main, angle: main}}
"""
SWEEP: Final = """\
settle_s: 2.0
duration_s: {duration_s}
repeats: {repeats}
records:
  - sine: {{frequency_hz: [0.2, 0.5, 0.8], amplitude_mpa: 0.2}}
  - triangle: {{frequency_hz: 0.5, amplitude_mpa: 0.2}}
  - multisine: {{amplitude_mpa: 0.2}}
"""
_RECORDS: Final = 5
_MOST_INTERRUPTIONS: Final = 100
_FIRST_PAUSE_S, _LONGER, _MOST_PAUSE_S = 0.5, 1.2, 5.0
"""Between two looks at the processes: at first often, so that a short soak has samples for a slope, then every 5 s, so
that looking costs a long one nothing."""
_AROUND_S: Final = 4.0  # settle, zero and ramps of a record


@dataclass
class Usage:
    """What one process held, sample after sample."""

    rss_mb: list[float] = field(default_factory=list)
    descriptors: list[int] = field(default_factory=list)

    def to_json(self) -> dict[str, float]:
        """After the first tenth, in which caches fill, and at the end."""
        start = len(self.rss_mb) // 10
        slope = _slope(self.rss_mb[start:])
        return {
            "rss_start_mb": self.rss_mb[start],
            "rss_end_mb": self.rss_mb[-1],
            "rss_slope_mb_per_sample": slope,
            "descriptors_start": self.descriptors[start],
            "descriptors_end": self.descriptors[-1],
        }


@dataclass
class Watched:
    """What was seen from outside while the soak ran."""

    last: dict[str, Any] = field(default_factory=dict)
    """The daemon's last status."""
    usage: dict[str, Usage] = field(default_factory=dict)
    interruptions: list[str] = field(default_factory=list)
    place: stalls.Place = field(default_factory=stalls.Place)


def soak(
    folder: Path,
    hours: float,
    virtual: bool,
    note: Callable[[float, str], None],
    record_s: float = 56.0,
    sweep: str = SWEEP,
) -> dict[str, Any]:
    """Sweep for `hours` of the rig's own time in `folder`; returns what was seen. `sweep`: five records of {duration_s}
    each, {repeats} times.

    In real time a witness on each core tells whether the machine itself stood still (`machine`, empty in virtual time).
    """
    with contextlib.ExitStack() as stack:
        witnesses = None if virtual else stack.enter_context(Witnesses(os.sched_getaffinity(0)))
        bench = stack.enter_context(FaultBench(folder, RIG, ("--clock", "virtual") if virtual else ()))
        result, place = _sweep(bench, hours, note, record_s, sweep)
        accounts = witnesses.accounts() if witnesses else []
    found = {} if virtual else stalls.judge(place, accounts, stalls.recorded_in(folder), result["not_valid"])
    return {"virtual": virtual, **result, "machine": found}


def _sweep(
    bench: FaultBench, hours: float, note: Callable[[float, str], None], record_s: float, sweep: str
) -> tuple[dict[str, Any], stalls.Place]:
    repeats = max(round(hours * 3600 / ((record_s + _AROUND_S) * _RECORDS)), 1)
    bench.sweep.write_text(sweep.format(repeats=repeats, duration_s=record_s), encoding="utf-8")
    bench.start()
    began = time.monotonic()
    with bench.client() as client:
        client.arm()
        client.start(bench.sweep)
        seen = _watch(client, note, repeats * _RECORDS)
    wall_s = time.monotonic() - began
    log = bench.log_text()
    (job,) = seen.last["queue"]
    return {
        "rig_hours": job["seconds"] / 3600,
        "wall_s": wall_s,
        "records": job["total"],
        "done": job["done"],
        "state": job["state"],
        "error": job["error"],
        "ticks": seen.last["loop"]["ticks"],
        "missed": seen.last["loop"]["missed"],
        "interruptions": seen.interruptions,
        "dropped": sum(map(int, re.findall(r"(\d+) dropped", log))),
        "not_valid": log.count(", not valid"),
        "processes": {name: one.to_json() for name, one in seen.usage.items()},
    }, seen.place


def _watch(client: Any, note: Callable[[float, str], None], total: int) -> Watched:
    """Until the job is over. What stops it on the way is noted, and it goes on as an operator would let it."""
    seen = Watched()
    pause_s = _FIRST_PAUSE_S
    while True:
        seen.last = status = client.status()
        _look(status["processes"], seen)
        job = status["queue"][0]
        note(job["done"], f"{job['done']} of {counted(total, 'record')}")
        if not status["working"]:
            if job["state"] != "stopped" or len(seen.interruptions) >= _MOST_INTERRUPTIONS:
                return seen
            seen.interruptions.append(job["error"])
            if status["state"] == "fault":
                client.reset()
                client.arm()
                seen.usage.clear()  # new processes
            client.start()
        time.sleep(pause_s)
        pause_s = min(pause_s * _LONGER, _MOST_PAUSE_S)


def _look(processes: dict[str, Any], seen: Watched) -> None:
    for name, process in processes.items():
        if process["alive"]:
            pid = int(process["pid"])
            _measure(pid, seen.usage.setdefault(name, Usage()))
            with contextlib.suppress(ProcessLookupError):  # it has just ended, and the next status says why
                seen.place.see(pid, is_loop=name == "loop")


def _measure(pid: int, usage: Usage) -> None:
    try:
        status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
        usage.descriptors.append(sum(1 for _ in Path(f"/proc/{pid}/fd").iterdir()))
    except OSError:
        raise RigError(f"process {pid} ended during the soak") from None
    usage.rss_mb.append(next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS")) / 1024)


def _slope(values: list[float]) -> float:
    """Least squares over the index."""
    n = len(values)
    if n < 2:
        return 0.0
    centre = (n - 1) / 2
    mean = sum(values) / n
    spread = sum((i - centre) ** 2 for i in range(n))
    return sum((i - centre) * (value - mean) for i, value in enumerate(values)) / spread
