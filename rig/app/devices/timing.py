"""How a device answers when nothing is written to it: its reads timed on the period's grid."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from rig.errors import CheckFailed, DeviceError, DeviceLost
from rig.interfaces import Device, Measurement
from rig.realtime.clock import MonotonicClock
from rig.sample import Flag


@dataclass(frozen=True)
class DeviceTiming:
    """How a device answers when nothing is written."""

    ticks: int
    failed: int
    read_p50_us: float
    read_p99_us: float
    age_p50_ms: float
    age_p99_ms: float
    flags: dict[str, int]
    last_error: str
    last: Measurement | None

    def holds(self, period_ns: int) -> bool:
        """Every read answered within the period, but for one in a hundred."""
        return self.failed <= max(self.ticks // 100, 1) and self.read_p99_us * 1e3 < period_ns

    def fresh(self, period_ns: int) -> bool:
        """Values are no older than a period, but for one in a hundred."""
        return self.age_p99_ms * 1e6 <= period_ns


def time_reads(
    device: Device,
    period_ns: int,
    ticks: int,
    tick_done: Callable[[int], None] = lambda _: None,
    before_read: Callable[[], None] = lambda: None,
) -> DeviceTiming:
    """Read an open device `ticks` times on the period's grid; nothing is written. What `before_read` raises ends it."""
    clock = MonotonicClock()
    took, ages, flags = [], [], Counter[str]()
    failed, last_error, last = 0, "", None
    due_ns = clock.now_ns()
    for tick in range(ticks):
        due_ns = max(due_ns + period_ns, clock.now_ns())
        clock.wait_until_ns(due_ns)
        before_read()
        began_ns = clock.now_ns()
        try:
            last = device.read()
        except DeviceError as error:
            failed, last_error = failed + 1, str(error)
            if isinstance(error, DeviceLost):
                raise
            continue
        took.append(clock.now_ns() - began_ns)
        ages.append(max(last.p1_age_ns, last.p2_age_ns, last.angle_age_ns))
        flags.update(flag.name or "" for flag in Flag if flag & last.flags)
        tick_done(tick + 1)
    if not took:
        raise CheckFailed(f"no answer in {ticks} ticks; last: {last_error}")
    took.sort()
    ages.sort()
    share = len(took) - 1
    return DeviceTiming(
        ticks, failed, took[share // 2] / 1e3, took[share * 99 // 100] / 1e3, ages[share // 2] / 1e6,
        ages[share * 99 // 100] / 1e6,
        dict(flags), last_error, last,
    )  # fmt: skip
