"""The clocks: one that waits for the world, one that does so punctually, and one that is turned by the loop itself."""

import time
from collections.abc import Callable
from typing import Final

_WORTH_IT: Final = 2
"""Who wakes with less than 1/2 of `early_ns` left does not rehearse: a rehearsal takes about as long, and one that is
late delays the tick."""
_SPARE: Final = 8
"""A further rehearsal begins only when it would leave 1/8 of `early_ns`, if it takes as long as the last one."""
_LONGEST_PAUSE: Final = 1000
"""Waits without a rehearsal, after many that were late."""


class MonotonicClock:
    """The machine's monotonic clock; wall-clock jumps do not touch it."""

    def now_ns(self) -> int:
        """Nanoseconds of CLOCK_MONOTONIC."""
        return time.monotonic_ns()

    def wait_until_ns(self, deadline_ns: int) -> None:
        """Sleep to an absolute deadline. `time.sleep` may return a little early by rounding, hence the loop."""
        while (left := deadline_ns - time.monotonic_ns()) > 0:
            time.sleep(left / 1e9)


class WarmUpClock(MonotonicClock):
    """Wakes `early_ns` before each deadline, has the coming work rehearsed, and waits out the rest on the processor.

    So neither waking up nor what the processor forgot while it slept is left for the deadline; it costs at most
    `early_ns` of the processor a wait. Who wakes with less than half of that left does not rehearse. After a rehearsal
    that was not over in time some waits do without: one after a single one, up to _LONGEST_PAUSE on a machine that is
    always too slow.
    """

    def __init__(self, early_ns: int, rehearse: Callable[[], None]) -> None:
        self.early_ns, self.rehearse = early_ns, rehearse
        self._pause = self._left_out = 0

    def wait_until_ns(self, deadline_ns: int) -> None:
        """Sleep until shortly before the deadline, rehearse, and watch the clock."""
        super().wait_until_ns(deadline_ns - self.early_ns)
        if self._left_out:
            self._left_out -= 1
        else:
            self._rehearse_until(deadline_ns)
        while time.monotonic_ns() < deadline_ns:
            pass

    def _rehearse_until(self, deadline_ns: int) -> None:
        """Rehearse as often as there is time for, so that the last one is fresh; double the pause when that was late,
        else halve it."""
        now_ns, needs_ns = time.monotonic_ns(), self.early_ns // _WORTH_IT
        if deadline_ns - now_ns <= needs_ns:
            return
        while deadline_ns - now_ns > needs_ns:
            began_ns = now_ns
            self.rehearse()
            now_ns = time.monotonic_ns()
            needs_ns = now_ns - began_ns + self.early_ns // _SPARE
        in_time = now_ns <= deadline_ns
        self._pause = self._pause // 2 if in_time else min(2 * self._pause + 1, _LONGEST_PAUSE)
        self._left_out = 0 if in_time else self._pause


class VirtualClock:
    """Time that passes only when somebody waits for it: the same loop, as fast as it can, the same every time.

    `pace` is called before time passes; it may hold the loop back until a reader of its data has caught up, which costs
    no virtual time.
    """

    def __init__(self, start_ns: int = 0, pace: Callable[[], None] | None = None) -> None:
        self._now_ns = start_ns
        self._pace = pace

    def now_ns(self) -> int:
        """Nanoseconds that have been waited for since the start."""
        return self._now_ns

    def wait_until_ns(self, deadline_ns: int) -> None:
        """Turn the clock to the deadline."""
        if self._pace is not None:
            self._pace()
        if deadline_ns > self._now_ns:
            self._now_ns = deadline_ns
