"""The clocks: one that waits for the world, one that does so punctually, and one that is turned by the loop itself."""

import time
from collections.abc import Callable


class MonotonicClock:
    """The machine's monotonic clock; wall-clock jumps do not touch it."""

    def now_ns(self) -> int:
        """Nanoseconds of CLOCK_MONOTONIC."""
        return time.monotonic_ns()

    def wait_until_ns(self, deadline_ns: int) -> None:
        """Sleep to an absolute deadline. `time.sleep` may return a little early by rounding, hence the loop."""
        while (left := deadline_ns - time.monotonic_ns()) > 0:
            time.sleep(left / 1e9)


class RehearsingClock(MonotonicClock):
    """Wakes `early_ns` before each deadline, has the coming work rehearsed, and waits out the rest on the processor.

    So neither waking up nor what the processor forgot while it slept is left for the deadline; it costs at most `early_ns` of
    the processor a wait. A rehearsal that would not be over in time, as the last ones tell, is left out.
    """

    def __init__(self, early_ns: int, rehearse: Callable[[], None]) -> None:
        self._early_ns, self._rehearse = early_ns, rehearse
        self._takes_ns = early_ns // 2
        """How long a rehearsal is expected to take: the longest of late, forgotten little by little."""

    def wait_until_ns(self, deadline_ns: int) -> None:
        """Sleep until shortly before the deadline, rehearse, and watch the clock."""
        super().wait_until_ns(deadline_ns - self._early_ns)
        began_ns = time.monotonic_ns()
        if deadline_ns - began_ns > self._takes_ns:
            self._rehearse()
            took_ns = min(time.monotonic_ns() - began_ns, 2 * self._early_ns)  # the machine may have stood still
            self._takes_ns = max(took_ns, self._takes_ns - self._takes_ns // 16)
        else:
            self._takes_ns -= self._takes_ns // 64
        while time.monotonic_ns() < deadline_ns:
            pass


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
        self._now_ns = max(self._now_ns, deadline_ns)
