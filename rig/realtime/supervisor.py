"""The supervisor: a process above the loop that does one thing, write the safe state when the loop no longer can.

It knows nothing of experiments. It reads the loop's heartbeat in the ring and holds a file descriptor of the loop's process, so it
sees a killed loop at once and a stopped or hanging one after a few periods. It then ends what is left of the loop, so that
nothing writes after it, and brings the device to its safe state by a path of its own.
"""

import contextlib
import os
import select
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Final, Self

from rig.realtime.ring import Ring
from rig.realtime.shared import HEADER_WORDS, SharedBlock

GONE_PATIENCE_S: Final = 0.5
ATTEMPTS: Final = 5
_LOOK_S: Final = 0.05


class Verdict(IntEnum):
    """What the supervisor has seen."""

    WATCHING = 0
    ENDED = 1
    """The loop's process has ended, by itself or killed."""
    SILENT = 2
    """The process was there, but its heartbeat was not: stopped or hanging."""


@dataclass(frozen=True)
class Report:
    """What the supervisor saw and did; times are of the monotonic clock, 0: not yet."""

    verdict: Verdict
    seen_ns: int
    safe_ns: int
    """When the device had taken the safe state."""
    last_beat_ns: int
    failed: bool
    """The device could not be reached: its own watchdog is the last layer."""


class SupervisorBlock:
    """The words that the supervisor shares with the process that commands."""

    _BEAT, _VERDICT, _SEEN, _SAFE, _LAST_BEAT, _FAILED, _PID = range(HEADER_WORDS, HEADER_WORDS + 7)

    def __init__(self, block: SharedBlock) -> None:
        self.block = block
        self._words = block.words

    @classmethod
    def create(cls, name: str, session: int) -> Self:
        """A fresh block."""
        return cls(SharedBlock.create(name, session, 8 * 8))

    @classmethod
    def attach(cls, path: Path, session: int) -> Self:
        """The block of another process."""
        return cls(SharedBlock.attach(path, session))

    @property
    def beat_ns(self) -> int:
        """When the supervisor last looked; 0 before it began."""
        return self._words[self._BEAT]

    def beat(self) -> None:
        """Say that the supervisor lives."""
        self._words[self._BEAT] = time.monotonic_ns()

    def report(self) -> Report:
        """What there is to tell."""
        w = self._words
        return Report(Verdict(w[self._VERDICT]), w[self._SEEN], w[self._SAFE], w[self._LAST_BEAT], bool(w[self._FAILED]))

    def tell(self, report: Report) -> None:
        """Publish; the verdict goes last, because readers wait for it."""
        w = self._words
        w[self._SEEN], w[self._SAFE], w[self._LAST_BEAT] = report.seen_ns, report.safe_ns, report.last_beat_ns
        w[self._FAILED] = int(report.failed)
        w[self._VERDICT] = int(report.verdict)


class Supervisor:
    """Watches the loop's process `pid` until it is no more, or until `release` is called."""

    def __init__(
        self, ring: Ring, block: SupervisorBlock, pid: int, safe: Callable[[], None], period_ns: int, patience_periods: int = 3
    ) -> None:
        """`safe` writes the safe state without the loop's help; what it raises is a failed attempt.

        A heartbeat older than `patience_periods`, less a tenth of a period for the way to the device, is a loop that is stopped or
        hangs: a hang that strikes just after a look at the device is then safe within one period more. ProcessLookupError when `pid`
        is gone.
        """
        self._ring, self._block, self._safe = ring, block, safe
        self._period_ns, self._limit_ns = period_ns, patience_periods * period_ns - period_ns // 10
        self._looked_ns = time.monotonic_ns()
        self._longest_look_ns = max(self._limit_ns, round(_LOOK_S * 1e9)) + period_ns
        self._pid = pid
        self._process = os.pidfd_open(pid)
        self._released = False

    def release(self) -> None:
        """Stop watching; for signal handlers. The loop's own way out makes the rig safe."""
        self._released = True

    def run(self) -> Verdict:
        """Watch; returns what ended it, WATCHING when released."""
        try:
            while not self._released:
                self._block.beat()
                overslept, left_ns = self._overslept(), self._left_ns()
                if left_ns <= 0 and not overslept:
                    return self._act(Verdict.SILENT)
                wait_ns = left_ns if left_ns > 0 else self._period_ns
                if self._ended_within(wait_ns / 1e9):
                    return self._act(Verdict.ENDED)
            return Verdict.WATCHING
        finally:
            os.close(self._process)

    def _left_ns(self) -> int:
        """Until the newest heartbeat is too old; before the first, only the process's end counts."""
        beat_ns = self._ring.heartbeat_ns
        if beat_ns == 0:
            return round(_LOOK_S * 1e9)
        return min(beat_ns + self._limit_ns - time.monotonic_ns(), round(_LOOK_S * 1e9))

    def _overslept(self) -> bool:
        """This process did not run either: the machine stood still. Then the loop gets a period to find that out by itself."""
        now_ns, before_ns = time.monotonic_ns(), self._looked_ns
        self._looked_ns = now_ns
        return now_ns - before_ns > self._longest_look_ns

    def _ended_within(self, seconds: float) -> bool:
        return bool(select.select([self._process], [], [], seconds)[0])

    def _act(self, verdict: Verdict) -> Verdict:
        """End the loop, make safe, tell; and make safe once more when the loop is really gone.

        The second time is for a loop that was in the middle of a write when it was killed.
        """
        seen_ns = time.monotonic_ns()
        with contextlib.suppress(OSError):
            signal.pidfd_send_signal(self._process, signal.SIGKILL)
        reached = self._make_safe()
        self._block.tell(Report(verdict, seen_ns, time.monotonic_ns() if reached else 0, self._ring.heartbeat_ns, not reached))
        if verdict is Verdict.SILENT and self._ended_within(GONE_PATIENCE_S):
            self._make_safe()
        return verdict

    def _make_safe(self) -> bool:
        """A device that does not answer is tried again a few times; then its own watchdog has to do it."""
        for _ in range(ATTEMPTS):
            self._block.beat()
            with contextlib.suppress(Exception):  # whatever a driver raises here, the other attempts and the report must follow
                self._safe()
                return True
        return False
