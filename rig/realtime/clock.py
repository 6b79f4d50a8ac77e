"""The two clocks: one that waits for the world, one that is turned by the loop itself."""

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
