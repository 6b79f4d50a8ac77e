"""What the daemon knows of the loop, from the ring alone: the newest sample, counts, lateness. The loop is never
asked."""

import itertools
import time
from bisect import bisect_right
from collections import deque
from typing import Any, Final

from rig.realtime.faults import EXPLANATIONS, Fault
from rig.realtime.ring import Ring, RingReader
from rig.realtime.safe_report import Outcome, SafeReport
from rig.realtime.state import State
from rig.sample import Phase, Sample, unpack
from rig.service.records.lateness import quantiles

LATENESS_EDGES_US: Final = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
"""Upper edges of the histogram's classes; one more class lies above."""
COLUMNS: Final = ("tick", "p1_cmd_mpa", "p2_cmd_mpa", "p1_mpa", "p2_mpa", "angle_deg")
"""What subscribers get of each sample, and its phase by name."""
STALE_S: Final = 0.5
"""Values older than this are shown as the last ones seen, not as the rig's now."""
_WINDOW: Final = 4000
"""Ticks whose lateness is summed up: 20 s at 5 ms."""
_TRAIL: Final = 1024
"""Newest samples that are kept for subscribers: 5 s at 5 ms. Fewer: who asks seldom misses some."""
_SUM_UP_TICKS: Final = 40
"""Ticks after which the lateness is summed up again: 0.2 s at 5 ms."""
_PHASES: Final = {int(phase): phase.name.lower() for phase in Phase}


class Telemetry:
    """Reads one ring; call `update` a few times a second."""

    def __init__(self, ring: Ring) -> None:
        self._ring = ring
        self._reader = RingReader(ring)
        self._lateness_ns: deque[int] = deque(maxlen=_WINDOW)
        self._trail: deque[Sample] = deque(maxlen=_TRAIL)
        self.latest: Sample | None = None
        self.first_fault: Sample | None = None
        """The sample in which the fault appeared that stands now; None while there is none."""
        self.missed = 0
        self.ticks = 0
        self._lateness: dict[str, Any] = {}
        self._summed_up_at = 0

    def update(self) -> None:
        """Take in what was published since the last call."""
        for packed in self._reader:
            sample = unpack(packed)
            self.ticks += 1
            self.missed += sample.missed
            self._lateness_ns.append(sample.woken_ns - sample.scheduled_ns)
            self._trail.append(sample)
            if sample.fault and self.first_fault is None:
                self.first_fault = sample
            elif not sample.fault:
                self.first_fault = None
            self.latest = sample

    @property
    def age_s(self) -> float | None:
        """How long ago the loop last began a tick, and so the age of what is shown of it; None before the first."""
        beat_ns = self._ring.heartbeat_ns
        return max(time.monotonic_ns() - beat_ns, 0) / 1e9 if beat_ns else None

    @property
    def state(self) -> State:
        """What the loop last said; DISARMED before it said anything."""
        return State(self.latest.state) if self.latest else State.DISARMED

    def columns(self, since: int) -> tuple[int, dict[str, list[Any]]]:
        """Samples after number `since`, as columns, and the number to ask with the next time; a slow asker gets a
        gap."""
        newest = itertools.islice(reversed(self._trail), min(max(self.ticks - since, 0), len(self._trail)))
        samples = list(newest)[::-1]
        columns: dict[str, list[Any]] = {name: [getattr(sample, name) for sample in samples] for name in COLUMNS}
        return self.ticks, columns | {"phase": [_PHASES[sample.phase] for sample in samples]}

    def lateness(self) -> dict[str, Any]:
        """p50, p99, maximum (us) and histogram of the last 20 s or so; made anew a few times a second, however many
        ask."""
        if self.ticks - self._summed_up_at >= _SUM_UP_TICKS or not self._lateness:
            self._summed_up_at, self._lateness = self.ticks, self._sum_up()
        return self._lateness

    def _sum_up(self) -> dict[str, Any]:
        ordered = sorted(self._lateness_ns)
        if not ordered:
            return {}
        below = [bisect_right(ordered, edge * 1000) for edge in LATENESS_EDGES_US]
        return {
            **{name: ns / 1e3 for name, ns in quantiles(ordered).items()},
            "edges_us": list(LATENESS_EDGES_US),
            "histogram": [high - low for low, high in itertools.pairwise([0, *below, len(ordered)])],
        }

    def to_json(self) -> dict[str, Any]:
        """The loop as the status shows it."""
        now = self.latest
        lag = self._ring.head - self._ring.recorded
        shown: dict[str, Any] = {
            "ticks": self.ticks,
            "missed": self.missed,
            "lateness_us": self.lateness(),
            "ring_fill": min(lag / self._ring.capacity, 1.0),
            "age_s": self.age_s,
            "live": self.age_s is not None and self.age_s < STALE_S,
        }
        if now is not None:
            names = ("tick", "dp_cmd_mpa", "p1_cmd_mpa", "p2_cmd_mpa", "p1_mpa", "p2_mpa", "angle_deg", "flags", "run")
            shown |= {name: getattr(now, name) for name in names} | {"phase": Phase(now.phase).name.lower()}
        return shown


def fault_json(fault: Fault, message: str) -> dict[str, Any] | None:
    """A fault as the status shows it; None for none. `message` is what is known beside its cause."""
    if fault is Fault.NONE:
        return None
    cause, hint = EXPLANATIONS[fault]
    return {"code": int(fault), "name": fault.name, "cause": cause, "hint": hint, "said": message}


def safe_json(report: SafeReport | None, safe_mpa: tuple[float, float]) -> dict[str, Any] | None:
    """What is known of the safe state as the status shows it; None while the loop commands."""
    if report is None:
        return None
    now_ns = time.monotonic_ns()

    def ago_s(then_ns: int) -> float | None:
        return (now_ns - then_ns) / 1e9 if then_ns else None

    return {
        "outcome": report.outcome.name.lower(),
        "safe": report.safe,
        "confirmed": report.outcome in (Outcome.SEEN, Outcome.ENDED),
        "by": report.writer.name.lower(),
        "p1_mpa": safe_mpa[0],
        "p2_mpa": safe_mpa[1],
        "written_ago_s": ago_s(report.written_ns),
        "confirmed_ago_s": ago_s(report.confirmed_ns),
        "words": report.words,
    }
