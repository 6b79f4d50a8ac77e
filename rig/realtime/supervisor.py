"""The supervisor: a process above the loop that does one thing, see to the safe state when the loop no longer can.

It knows nothing of experiments. It reads the loop's heartbeat in the ring and holds a file descriptor of the loop's
process, so it sees a killed loop at once and a stopped or hanging one after a few periods. What follows is the
authority's business. The guardian is the same with more patience: it stands by in case the supervisor is lost together
with the loop.
"""

import time
from typing import Final

from rig.realtime.ring import Ring
from rig.realtime.safe_report import LoopVerdict, SafeBlock, Writer
from rig.realtime.safe_state import SafeStateAuthority
from rig.realtime.watched_process import WatchedProcess

_LOOK_S: Final = 0.05
"""The longest wait for the loop's end before a watcher beats again itself and looks whether it is released; others take
it for lost after six of them (`rig.service.session.watchers.WATCHER_PATIENCE_S`)."""
_OTHERS_LOOK_S: Final = 0.005
"""How often the guardian looks, in its grace, whether somebody else has made the rig safe."""


class Supervisor:
    """Watches the loop's process until it is no more, or until everybody is released."""

    def __init__(
        self, writer: Writer, ring: Ring, block: SafeBlock, loop: WatchedProcess, authority: SafeStateAuthority, *,
        patience_ns: int, period_ns: int, grace_ns: int = 0,
    ) -> None:  # fmt: skip
        """A heartbeat older than `patience_ns` is a loop that is stopped or hangs. Others get `grace_ns` to see
        to the safe state of one that has ended; for one that is silent they had the patience."""
        self._writer, self._ring, self._block, self._loop, self._authority = writer, ring, block, loop, authority
        self._period_ns, self._limit_ns, self._grace_ns = period_ns, patience_ns, grace_ns
        self._looked_ns = time.monotonic_ns()
        self._back_ns = 0
        """When this process went on again after the last standstill."""
        self._longest_look_ns = max(self._limit_ns, round(_LOOK_S * 1e9)) + period_ns

    def run(self) -> LoopVerdict:
        """Watch; returns what ended it, WATCHING when released."""
        while not self._block.released:
            self._block.beat(self._writer)
            overslept, left_ns = self._overslept(), self._left_ns()
            if left_ns <= 0 and not overslept:
                return self._act(LoopVerdict.STALLED if self._not_back() else LoopVerdict.SILENT)
            wait_ns = left_ns if left_ns > 0 else self._period_ns
            if self._loop.gone_within(wait_ns / 1e9):
                return self._act(LoopVerdict.ENDED)
        return LoopVerdict.WATCHING

    def _left_ns(self) -> int:
        """Until the newest heartbeat is too old; before the first, only the process's end counts."""
        beat_ns = self._ring.heartbeat_ns
        if beat_ns == 0:
            return round(_LOOK_S * 1e9)
        return min(beat_ns + self._limit_ns - time.monotonic_ns(), round(_LOOK_S * 1e9))

    def _overslept(self) -> bool:
        """This process did not run either: the machine stood still. Then the loop gets a period to find that out by
        itself."""
        now_ns, before_ns = time.monotonic_ns(), self._looked_ns
        self._looked_ns = now_ns
        if now_ns - before_ns <= self._longest_look_ns:
            return False
        self._back_ns = now_ns
        return True

    def _not_back(self) -> bool:
        """A loop that is silent has been so since a standstill that this process shared, or since the first ticks after
        it: what it has to make up for may take it longer than it may be silent."""
        return self._back_ns != 0 and self._ring.heartbeat_ns < self._back_ns + self._limit_ns

    def _act(self, verdict: LoopVerdict) -> LoopVerdict:
        """A loop that never ticked has written nothing, perhaps because the device is somebody else's."""
        if self._ring.heartbeat_ns and not self._others_did(self._grace_ns if verdict is LoopVerdict.ENDED else 0):
            self._authority.take_over(verdict)
        return verdict

    def _others_did(self, grace_ns: int) -> bool:
        """Whether somebody else has made the rig safe after the loop's end, within the grace."""
        until_ns = time.monotonic_ns() + grace_ns
        while time.monotonic_ns() < until_ns:
            if self._block.released or (self._block.best().safe and self._loop.gone_within(0.0)):
                return True
            self._block.beat(self._writer)
            time.sleep(_OTHERS_LOOK_S)
        return False
