"""The last attempts of a loop to leave its device safe: until it has taken the safe state, has failed too often, or the
time for it is over, by the clock on which the loop waits."""

from collections.abc import Callable
from typing import Final

from rig.interfaces import Clock

LEAVING_NS: Final = 1_000_000_000
"""For the safe state on the way out, longer than a wire of 1200 baud takes, and as long again for letting go of a
device that has taken it; then the supervisor takes over."""
_FAILURES: Final = 3
"""Failed writes of the safe state after which the supervisor is better placed."""
_ATTEMPT_NS: Final = 250_000_000
"""For one attempt, which waits for less than a period (100 ms at most) where the device is open."""


def leave_safe(attempt: Callable[[], bool | None], beat: Callable[[int], None], clock: Clock, period_ns: int) -> None:
    """Make attempts, half a period apart, until LEAVING_NS are over. `attempt` tells whether the device has taken it,
    None: it is on its way. `beat` is told before each how long it may take (ns)."""
    began_ns = now_ns = clock.now_ns()
    failures = 0
    while now_ns - began_ns < LEAVING_NS - period_ns:
        beat(_ATTEMPT_NS)
        taken = attempt()
        failures += taken is False
        if taken:
            beat(LEAVING_NS)
        if taken or failures >= _FAILURES:
            return
        clock.wait_until_ns(now_ns + period_ns // 2)
        now_ns = clock.now_ns()
