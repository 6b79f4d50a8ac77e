"""What stands between the loop and the air: limits on every set-point, and checks on every measurement.

The guard clips set-points to the envelope, keeps values that cannot be true away from the outputs, and says when a
fault is due. It knows neither device nor program.
"""

import math
from collections import deque
from dataclasses import dataclass, field

from rig.fields import bounded
from rig.interfaces import Measurement
from rig.realtime.faults import Fault
from rig.sample import (
    ANGLE_ABSENT,
    ANGLE_SUSPECT,
    BROKEN_WIRE,
    CLIPPED_RANGE,
    CLIPPED_SLEW,
    P1_ABSENT,
    P2_ABSENT,
    READ_ERROR,
    STALE,
    SUSPECT,
)

_NO_FAULT = Fault.NONE  # by a name of this module: looking a member up in its class takes as long as a call
_ROUNDING_MPA = 1e-9  # as the check before the start allows it: what is on a limit is not clipped
MOST_ANGLE_DEG = 720.0
"""A measured angle further than this either way, deg, cannot be true: a joint is allowed a turn from its zero at most
(`Limits.angle_deg`), and that zero lies within a turn of the sensor's own. Less: a sensor that is mounted a turn off
counts as broken; more: a value without sense is first told by its jump."""


@dataclass(frozen=True)
class Limits:
    """The envelope and the patience of the guard; a section of the rig's YAML."""

    pressure_mpa: tuple[float, float] = bounded(0.0, 1.0, "MPa", default=(0.0, 0.5))
    """Set-points; the ITV1030/2030 regulate 0.005 to 0.5 MPa."""
    slew_mpa_s: float = bounded(0.001, 100.0, "MPa/s", default=5.0)
    """Change of a set-point."""
    angle_deg: tuple[float, float] = bounded(-360.0, 360.0, "deg", default=(-90.0, 90.0))
    """Where the joint may be while set-points are written, from its zero."""
    angle_jump_deg: float = bounded(0.01, 360.0, "deg", default=20.0)
    """Change of the angle from one tick to the next that no joint can make."""
    pressure_jump_mpa: float = bounded(0.001, 1.0, "MPa", default=0.15)
    """Change of a measured pressure from one tick to the next that no regulator can make."""
    monitor_mpa: tuple[float, float] = bounded(-0.2, 2.0, "MPa", default=(-0.03, 0.6))
    """Measured pressures that are possible; the monitor may be off by 6 % of full scale."""
    follow_mpa: float = bounded(0.001, 1.0, "MPa", default=0.1)
    follow_s: float = bounded(0.01, 60.0, "s", default=1.0)
    """A pressure that is further than `follow_mpa` from its set-point for this long does not follow."""
    frozen_s: float = bounded(0.01, 60.0, "s", default=1.0)
    frozen_travel_mpa: float = bounded(0.001, 1.0, "MPa", default=0.02)
    """Identical raw values for `frozen_s`, while the set-points that move the sensor travel this far, are a frozen
    sensor."""
    max_age_s: float = bounded(0.001, 10.0, "s", default=0.1)
    """A value older than this fills a leaky bucket."""
    misses_per_s: int = bounded(1, 1000, default=3)
    """This many ticks that skipped periods, within one second, are a fault."""
    stall_periods: int = bounded(1, 1000, default=4)
    """A tick that comes this many periods late is a fault at once."""
    bucket: int = bounded(1, 1000, default=10)
    """Leaky bucket: +2 for an error, -1 for a success, fault when full."""


class Bucket:
    """A leaky bucket: forgives single errors, not a habit of them."""

    def __init__(self, size: int) -> None:
        self._size = size
        self.level = 0

    def add(self, failed: int) -> bool:
        """Count one outcome, a failure when not 0; True when the bucket is full. It never holds more than its size."""
        if failed:
            self.level = min(self.level + 2, self._size)
        elif self.level:
            self.level -= 1
        return self.level >= self._size


class Misses:
    """Ticks that came so late that whole periods were skipped: single ones are forgiven, a stall or a habit is not."""

    def __init__(self, limits: Limits, period_ns: int) -> None:
        self._limits, self._period_ns = limits, period_ns
        self._window_ticks = 1_000_000_000 // period_ns
        self._ticks: deque[int] = deque()

    def add(self, tick: int, missed: int, late_ns: int) -> Fault:
        """The fault that is due after tick number `tick` came `missed` periods late, and `late_ns` have gone by since
        it was due: a stall in its middle is not left to the next one, or what it writes is as old as that."""
        if max(missed, late_ns // self._period_ns - 1) >= self._limits.stall_periods:
            return Fault.LONG_STALL
        if not missed:
            return _NO_FAULT
        self._ticks.append(tick)
        while self._ticks[0] < tick - self._window_ticks:
            self._ticks.popleft()
        return Fault.MISSED_TICKS if len(self._ticks) >= self._limits.misses_per_s else _NO_FAULT


@dataclass
class Guard:
    """Checks and clips for one loop with a period of `period_s`."""

    limits: Limits
    period_s: float
    expected: int = 0
    """The flags *_ABSENT of the sensors this rig has: without a value, they count as giving a bad one."""
    _command: tuple[float, float] | None = None
    _last_command: tuple[float, float] | None = None
    _previous: Measurement = field(default_factory=Measurement)
    _frozen_ticks: list[int] = field(default_factory=lambda: [0, 0, 0])
    _travel_mpa: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    _apart_ticks: list[int] = field(default_factory=lambda: [0, 0])

    def __post_init__(self) -> None:
        limits = self.limits
        self._bad_value, self._stale, self._broken_wire, self._outside = (Bucket(limits.bucket) for _ in range(4))
        self._counted = 0
        """What the first three buckets hold: while that is nothing, a good measurement changes none of them."""
        self._max_step_mpa = limits.slew_mpa_s * self.period_s
        self._max_age_ns = int(limits.max_age_s * 1e9)
        self._period_ns = int(self.period_s * 1e9)
        self._frozen_limit = max(round(limits.frozen_s / self.period_s), 2)
        self._follow_limit = max(round(limits.follow_s / self.period_s), 1)

    def start_from(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """Where the set-points stand now, so that the slew limit counts from there."""
        self._command = (p1_cmd_mpa, p2_cmd_mpa)

    def command(self, p1_cmd_mpa: float, p2_cmd_mpa: float, periods: int = 1) -> tuple[float, float, int]:
        """Both set-points inside range and slew over the `periods` since the last, and the flags of what was
        clipped."""
        low, high = self.limits.pressure_mpa
        step = self._max_step_mpa * periods
        too_far = step + _ROUNDING_MPA
        flags = 0
        safe1, safe2 = p1_cmd_mpa, p2_cmd_mpa
        inside = low <= p1_cmd_mpa <= high and low <= p2_cmd_mpa <= high
        if not inside:
            safe1, safe2 = min(max(p1_cmd_mpa, low), high), min(max(p2_cmd_mpa, low), high)
        before1, before2 = self._command or (low if safe1 != safe1 else safe1, low if safe2 != safe2 else safe2)
        # written so that NaN counts as clipped: min and max may let it through
        if not (inside or (abs(safe1 - p1_cmd_mpa) <= _ROUNDING_MPA and abs(safe2 - p2_cmd_mpa) <= _ROUNDING_MPA)):
            flags |= CLIPPED_RANGE
            safe1 = safe1 if math.isfinite(p1_cmd_mpa) else before1
            safe2 = safe2 if math.isfinite(p2_cmd_mpa) else before2
        if abs(safe1 - before1) > too_far or abs(safe2 - before2) > too_far:
            flags |= CLIPPED_SLEW
            safe1 = before1 + min(max(safe1 - before1, -step), step)
            safe2 = before2 + min(max(safe2 - before2, -step), step)
        self._command = (safe1, safe2)
        return safe1, safe2, flags

    def check(self, now: Measurement, angle_deg: float, commanding: bool) -> tuple[int, Fault]:
        """Flags of this measurement and the fault that is due, if any.

        `angle_deg` is the angle from its zero; `commanding` says whether set-points are being written.
        """
        flags = now.flags
        if missing := 0 if flags & READ_ERROR else flags & self.expected:
            flags |= SUSPECT | ANGLE_SUSPECT if missing & ANGLE_ABSENT else SUSPECT
        if self._implausible_angle(now):
            flags |= SUSPECT | ANGLE_SUSPECT
        elif self._implausible_pressure(now):
            flags |= SUSPECT
        oldest = max(now.p1_age_ns, now.p2_age_ns, now.angle_age_ns)
        if oldest > self._period_ns:
            flags |= STALE
        too_old = oldest > self._max_age_ns
        to_count = too_old or flags & (SUSPECT | BROKEN_WIRE) or self._counted
        fault = self._count(flags, too_old) if to_count else _NO_FAULT
        if commanding and not flags & SUSPECT:  # a value that cannot be true is no evidence of a joint or a valve
            fault = self._moving_faults(now, angle_deg, flags) or fault
        if not flags & READ_ERROR:  # what follows a failed read is compared with what came before it
            self._previous = now
        return flags, fault

    def _count(self, flags: int, too_old: bool) -> Fault:
        """Count what is wrong with this measurement, and forgive what is right; the fault of a bucket that is full."""
        fault = _NO_FAULT
        if self._bad_value.add(flags & SUSPECT):
            fault = Fault.BAD_VALUE
        if self._stale.add(too_old):
            fault = Fault.STALE_VALUE
        if self._broken_wire.add(flags & BROKEN_WIRE):
            fault = Fault.BROKEN_WIRE
        self._counted = self._bad_value.level + self._stale.level + self._broken_wire.level
        return fault

    def _implausible_pressure(self, now: Measurement) -> bool:
        """A pressure that is present cannot be true: not finite, out of range, or further from the last than physics
        allows."""
        limits, before, flags = self.limits, self._previous, now.flags
        low, high = limits.monitor_mpa
        jump = limits.pressure_jump_mpa
        if not flags & P1_ABSENT and (not low <= now.p1_mpa <= high or abs(now.p1_mpa - before.p1_mpa) > jump):
            return True
        return not flags & P2_ABSENT and (not low <= now.p2_mpa <= high or abs(now.p2_mpa - before.p2_mpa) > jump)

    def _implausible_angle(self, now: Measurement) -> bool:
        """The same of the angle."""
        return not now.flags & ANGLE_ABSENT and (
            not -MOST_ANGLE_DEG <= now.angle_deg <= MOST_ANGLE_DEG
            or abs(now.angle_deg - self._previous.angle_deg) > self.limits.angle_jump_deg
        )

    def _moving_faults(self, now: Measurement, angle_deg: float, flags: int) -> Fault:
        """Faults that only make sense while set-points are written. An angle that cannot be true is no angle outside
        its limits."""
        low, high = self.limits.angle_deg
        outside = not flags & (ANGLE_ABSENT | SUSPECT) and not low <= angle_deg <= high
        if (outside or self._outside.level) and self._outside.add(outside):
            return Fault.ANGLE_LIMIT
        if self._not_following(now):
            return Fault.NOT_FOLLOWING
        return Fault.FROZEN_SENSOR if self._frozen(now) else _NO_FAULT

    def _not_following(self, now: Measurement) -> bool:
        """A pressure has been far from its set-point for too long; a missing monitor (NaN) never is. A reply that was
        lost says nothing: what was counted before it stands."""
        p1_mpa, p2_mpa = now.p1_mpa, now.p2_mpa
        p1_cmd_mpa, p2_cmd_mpa = self._command or (p1_mpa, p2_mpa)
        apart, far_mpa = self._apart_ticks, self.limits.follow_mpa
        if p1_mpa == p1_mpa:
            apart[0] = apart[0] + 1 if abs(p1_mpa - p1_cmd_mpa) > far_mpa else 0
        if p2_mpa == p2_mpa:
            apart[1] = apart[1] + 1 if abs(p2_mpa - p2_cmd_mpa) > far_mpa else 0
        return apart[0] > self._follow_limit or apart[1] > self._follow_limit

    def _frozen(self, now: Measurement) -> bool:
        """A sensor gave the same raw value again and again while the set-points that move it travelled.

        The time counts from the first movement: a rig at rest, or a joint that both muscles hold, may well repeat
        itself.
        """
        before = self._previous
        moved1, moved2, turned = self._moved()
        return (
            self._repeats(0, now.p1_raw, before.p1_raw, moved1)
            or self._repeats(1, now.p2_raw, before.p2_raw, moved2)
            or self._repeats(2, now.angle_raw, before.angle_raw, turned)
        )

    def _repeats(self, sensor: int, raw: float, before: float, moved_mpa: float) -> bool:
        """Whether it has for too long; a missing value (NaN) says nothing, of a sensor that is not there ever."""
        ticks, travel = self._frozen_ticks, self._travel_mpa
        if raw != raw or before != before:
            return False
        if raw != before:
            ticks[sensor], travel[sensor] = 0, 0.0
            return False
        travel[sensor] += moved_mpa
        ticks[sensor] += travel[sensor] > 0.0
        return ticks[sensor] >= self._frozen_limit and travel[sensor] > self.limits.frozen_travel_mpa

    def _moved(self) -> tuple[float, float, float]:
        """How far p1, p2 and their difference, which turns the joint, went with the last command; MPa."""
        command, last = self._command, self._last_command
        self._last_command = command
        if command is None or last is None:
            return 0.0, 0.0, 0.0
        step1, step2 = command[0] - last[0], command[1] - last[1]
        return abs(step1), abs(step2), abs(step1 - step2)
