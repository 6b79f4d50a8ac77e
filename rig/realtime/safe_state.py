"""The safe state as something that somebody writes, looks at and answers for: the one way in which a lost loop is
followed up.

Supervisor, control process and guardian all stand on `SafeStateAuthority`, which ends the loop, writes when nobody else
can write any more, reads back where the device can tell, and repeats until that is so. What came of it is a
`SafeReport` in memory that they share (`safe_report.py`): nobody says "safe" who has not seen it there.
"""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Self

from rig.interfaces import Device, abilities_of
from rig.realtime.ring import Ring
from rig.realtime.safe_report import LoopVerdict, Outcome, SafeBlock, SafeReport, Writer
from rig.realtime.watched_process import WatchedProcess

GONE_PATIENCE_S: Final = 0.5
"""A killed process is gone within milliseconds, unless it waits inside the kernel."""
RETRY_S: Final = 0.02
"""Between two attempts to write the safe state or to read it back."""
_PERSISTENCE_S: Final = 10.0
"""So long the attempts go on with a device that does not take it, and longer only where nobody else is left to try;
then its own watchdog is all that is left."""
_LATE_RETRY_S: Final = 0.25
"""Between two attempts from then on: a watcher looks as often that it is not released."""
_SAME_LOSS_NS: Final = 5_000_000_000
"""What was seen by others at most so long before is the same loss."""
_LOOKS: Final = 5
"""Attempts to read back what was written; then "written" is all that can be said."""


@dataclass(frozen=True)
class SecondPath:
    """A way to the device that does not need the loop."""

    safe: Callable[[], None]
    """Write the safe state; raises when the device could not be reached."""
    holds_safe: Callable[[], bool | None] = lambda: None
    """Whether it stands there by the device's own word; None when the device cannot tell."""
    close: Callable[[], None] = lambda: None
    """Let go of the device, whose outputs stay."""
    claim: Callable[[], contextlib.AbstractContextManager[None]] = contextlib.nullcontext
    """Held while it is written in the place of a process that is lost; raises when somebody else drives the device by
    now."""

    @classmethod
    def of(
        cls, device: Device, claim: Callable[[], contextlib.AbstractContextManager[None]] = contextlib.nullcontext
    ) -> Self:
        """The calls of a device of this process."""
        return cls(device.safe, abilities_of(device).holds_safe, device.close, claim)


def write_and_look(path: SecondPath) -> Outcome:
    """One attempt, in the place of a process that is lost. Whatever a driver raises is a failed attempt: others must
    follow."""
    return _attempt(path, path.claim)


def _attempt(path: SecondPath, claim: Callable[[], contextlib.AbstractContextManager[None]]) -> Outcome:
    try:
        with claim():
            path.safe()
    except Exception:  # noqa: BLE001  # a bug of a driver must not be the end of the attempts
        return Outcome.FAILED
    return look(path)


def insist(path: SecondPath, patience_s: float, beat: Callable[[], None] = lambda: None) -> Outcome:
    """Attempts by somebody's own word, until the device has taken it, or for `patience_s`; `beat` is called before
    each. FAILED: it has not."""
    deadline = time.monotonic() + patience_s
    while True:
        beat()
        outcome = _attempt(path, contextlib.nullcontext)
        if outcome >= Outcome.WRITTEN or time.monotonic() > deadline:
            return outcome
        time.sleep(RETRY_S)


def look(path: SecondPath) -> Outcome:
    """What the device says of a safe state that was just written."""
    try:
        held = path.holds_safe()
    except Exception:  # noqa: BLE001  # as above
        return Outcome.WRITTEN
    return {True: Outcome.SEEN, False: Outcome.FAILED, None: Outcome.WRITTEN}[held]


class SafeStateAuthority:
    """Takes a lost loop's place as the one who writes: ends it, makes safe, looks, repeats."""

    def __init__(
        self,
        writer: Writer,
        block: SafeBlock,
        ring: Ring,
        loop: WatchedProcess,
        path: SecondPath | None,
        goes_on: Callable[[], bool] = bool,
    ) -> None:
        """Without a `path` the plant is in the loop's process, and all there is to do is to end it. `goes_on`: whether
        to try on where the usual time for it is over."""
        self._writer, self._block, self._ring, self._loop, self._path = writer, block, ring, loop, path
        self._goes_on = goes_on

    def take_over(self, verdict: LoopVerdict, persistence_s: float = _PERSISTENCE_S) -> SafeReport:
        """Blocks until the safe state was seen at the device, or for `persistence_s` and as long as this one goes on;
        each step is published as it is known.

        The first write does not wait for the loop's end. A loop that is killed in the middle of a write may bring its
        old set-point after it, so only a write after its end counts, and a stopped loop that somebody continues never
        writes again.
        """
        report = SafeReport(self._writer, verdict, seen_ns=time.monotonic_ns(), last_beat_ns=self._ring.heartbeat_ns)
        deadline = time.monotonic() + persistence_s
        self._block.tell(report)  # before: who sees its end is to know of what
        self._loop.kill()
        if not self._loop.gone_within(0.0):
            report = self._told(report, self._attempt(), counts=False)
            self._wait_for_the_end()
        attempts = 0
        while True:
            gone, outcome = self._loop.gone_within(0.0), self._attempt()
            report = self._told(report, outcome if gone else Outcome.FAILED)
            attempts += report.outcome is Outcome.WRITTEN
            enough = report.outcome > Outcome.WRITTEN or attempts >= _LOOKS or (gone and self._seen_by_another(report))
            late = time.monotonic() > deadline
            if enough or self._block.released or (late and not self._goes_on()):
                return report
            time.sleep(_LATE_RETRY_S if late else RETRY_S)

    def _seen_by_another(self, report: SafeReport) -> bool:
        """Two who go on at once could each hold one of two wires."""
        return self._block.best(since_ns=report.seen_ns - _SAME_LOSS_NS).outcome is Outcome.SEEN

    def _attempt(self) -> Outcome:
        self._block.beat(self._writer)
        if self._path is not None:
            return write_and_look(self._path)
        return Outcome.ENDED if self._loop.gone_within(0.0) else Outcome.FAILED

    def _wait_for_the_end(self) -> None:
        deadline = time.monotonic() + GONE_PATIENCE_S
        while not self._loop.gone_within(RETRY_S) and time.monotonic() < deadline:
            self._block.beat(self._writer)

    def _told(self, report: SafeReport, outcome: Outcome, counts: bool = True) -> SafeReport:
        """What does not count yet is a time only."""
        now_ns = time.monotonic_ns()
        report = replace(
            report,
            outcome=outcome if counts else Outcome.UNKNOWN,
            written_ns=report.written_ns or (now_ns if outcome >= Outcome.WRITTEN else 0),
            confirmed_ns=now_ns if counts and outcome is Outcome.SEEN else report.confirmed_ns,
        )
        self._block.tell(report)
        return report
