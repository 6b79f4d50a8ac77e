"""The safe state as something that somebody writes, looks at and answers for: the one way in which a lost loop is
followed up.

Supervisor, control process and guardian all stand on `SafeStateAuthority`, which ends the loop, writes when nobody else
can write any more, reads back where the device can tell, and repeats until that is so. What came of it is a
`SafeReport` in memory that they share: nobody says "safe" who has not seen it there.
"""

import contextlib
import os
import select
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum
from pathlib import Path
from typing import Final, Self

from rig.interfaces import Device, abilities_of
from rig.realtime.faults import Fault
from rig.realtime.ring import Ring
from rig.realtime.shared import HEADER_WORDS, SharedBlock

GONE_PATIENCE_S: Final = 0.5
"""A killed process is gone within milliseconds, unless it waits inside the kernel."""
NOT_SAFE: Final = "NOT SAFE as far as is known"
RETRY_S: Final = 0.02
"""Between two attempts to write the safe state or to read it back."""
_PERSISTENCE_S: Final = 10.0
"""So long the attempts go on with a device that does not take it, and longer only where nobody else is left to try;
then its own watchdog is all that is left."""
_LATE_RETRY_S: Final = 0.25
"""Between two attempts from then on: a watcher looks as often that it is not released."""
_FD_SETSIZE: Final = 1024
"""select(2) knows no descriptor from there on, of which a notebook may hold many."""
_SAME_LOSS_NS: Final = 5_000_000_000
"""What was seen by others at most so long before is the same loss."""
_READS: Final = 3
"""Attempts to read a report that another process may be writing meanwhile."""
_LOOKS: Final = 5
"""Attempts to read back what was written; then "written" is all that can be said."""


class Writer(IntEnum):
    """Who can bring the device to its safe state, in the order in which they do it."""

    NOBODY = 0
    LOOP = 1
    SUPERVISOR = 2
    CONTROL = 3
    """The process that commands: the daemon, or `pamrig run`."""
    GUARDIAN = 4


_NAMES: Final = {
    Writer.NOBODY: "nobody",
    Writer.LOOP: "the loop",
    Writer.SUPERVISOR: "the supervisor",
    Writer.CONTROL: "the commanding process",
    Writer.GUARDIAN: "the guardian",
}


class LoopVerdict(IntEnum):
    """How the loop was found."""

    WATCHING = 0
    ENDED = 1
    """The loop's process has ended, by itself or killed."""
    SILENT = 2
    """The process was there, but its heartbeat was not: stopped or hanging."""
    STALLED = 3
    """The same, and whoever listened had stood still himself until just before, as under `docker pause`: it did not
    hang, it had not come back yet."""

    @property
    def fault(self) -> Fault:
        """What it is called where nothing is known of the loop but how it was found."""
        return Fault.LONG_STALL if self is LoopVerdict.STALLED else Fault.LOOP_DIED


class Outcome(IntEnum):
    """What is known of the safe state; of two the greater is the better."""

    UNOPENED = -2
    """Nobody of ours has had the device, and nobody tries; known to whoever looks, told by nobody."""
    OVERRULED = -1
    """Another process drives the device, and what stands there is its own; known to whoever looks, told by nobody."""
    UNKNOWN = 0
    FAILED = 1
    """The device could not be reached, or holds something else."""
    DOUBTED = 2
    """The device took it, and was lost or out of reach after that: it may have left it, by its own watchdog or when it
    was switched on anew."""
    WRITTEN = 3
    """The device took it; it was not read back."""
    SEEN = 4
    """Read back from the device when nobody else could write any more."""
    ENDED = 5
    """A modelled plant in the loop's own process ended with it: there is nothing under pressure."""


@dataclass(frozen=True)
class SafeReport:
    """What one writer saw and did; times are of the monotonic clock in ns, 0: not yet."""

    writer: Writer = Writer.NOBODY
    verdict: LoopVerdict = LoopVerdict.WATCHING
    outcome: Outcome = Outcome.UNKNOWN
    seen_ns: int = 0
    """When the loss was seen."""
    last_beat_ns: int = 0
    """The loop's last heartbeat before it."""
    written_ns: int = 0
    """When the device had first taken the safe set-points."""
    confirmed_ns: int = 0
    """When they were last read back from it."""

    @property
    def safe(self) -> bool:
        """The device took the safe state, whether or not it could be read back, and nothing is known that speaks
        against it: the flag of what `words` says."""
        return self.outcome >= Outcome.WRITTEN

    @property
    def words(self) -> str:
        """For a person: what is known, and who says so."""
        who = _NAMES[self.writer]
        if self.outcome is Outcome.SEEN:
            return f"safe state written by {who}, seen at the device"
        if self.outcome is Outcome.WRITTEN:
            return f"safe state written by {who}, not confirmed: the device has not been read back"
        if self.outcome is Outcome.ENDED:
            return "nothing is under pressure: the simulated plant ended with the loop's process"
        if self.outcome is Outcome.OVERRULED:
            return "NOT SAFE: another process drives the device, and what stands there is its own"
        if self.outcome is Outcome.UNOPENED:
            return (
                f"{NOT_SAFE}: the device could not be opened, so that what stands at its valves, as whoever drove them "
                "before may have left it, is not known; nobody writes to it before a reset opens it or an emergency "
                "stop is asked for"
            )
        if self.outcome is Outcome.DOUBTED:
            return (
                f"{NOT_SAFE}: the device took the safe state from {who}, and was lost or out of reach "
                "after that; what stands there now is not known"
            )
        if self.outcome is Outcome.FAILED:
            return f"{NOT_SAFE}: {who} could not bring the device to its safe state; old set-points may stand"
        return "nobody has reported the safe state yet; old set-points may stand"


class SafeBlock:
    """A slot for each writer in shared memory: its heartbeat and its report. A writer touches its own slot only."""

    _SLOT: Final = 8
    _BEAT, _VERDICT, _OUTCOME, _SEEN, _LAST_BEAT, _WRITTEN, _CONFIRMED, _SEQUENCE = range(8)
    _RELEASED = HEADER_WORDS + len(Writer) * _SLOT

    def __init__(self, block: SharedBlock) -> None:
        self.block = block
        self._words = block.words

    @classmethod
    def create(cls, name: str, session: int) -> Self:
        """A fresh block."""
        return cls(SharedBlock.create(name, session, (len(Writer) * cls._SLOT + 1) * 8))

    @classmethod
    def attach(cls, path: Path, session: int) -> Self:
        """The block of another process."""
        return cls(SharedBlock.attach(path, session))

    def beat_ns(self, writer: Writer) -> int:
        """When that watcher last looked; 0 before it began."""
        return self._words[self._at(writer) + self._BEAT]

    def beat(self, writer: Writer) -> None:
        """Say that this watcher lives."""
        self._words[self._at(writer) + self._BEAT] = time.monotonic_ns()

    @property
    def released(self) -> bool:
        """The loop's end is not to be followed up: whoever owned the rig has left it safe himself."""
        return self._words[self._RELEASED] != 0

    def release(self) -> None:
        """Let the watchers go."""
        self._words[self._RELEASED] = 1

    def report(self, writer: Writer) -> SafeReport:
        """What that writer published last."""
        at = self._at(writer)
        for _ in range(_READS):  # odd: it is being written
            sequence = self._words[at + self._SEQUENCE]
            verdict, outcome, *times = (self._words[at + self._VERDICT + i] for i in range(6))
            if sequence % 2 == 0 and sequence == self._words[at + self._SEQUENCE]:
                return SafeReport(writer, LoopVerdict(verdict), Outcome(outcome), *times)
        return SafeReport(writer)

    def tell(self, report: SafeReport) -> None:
        """Publish."""
        at, words = self._at(report.writer), self._words
        words[at + self._SEQUENCE] += 1
        published = (
            report.verdict, report.outcome, report.seen_ns, report.last_beat_ns, report.written_ns, report.confirmed_ns,
        )  # fmt: skip
        for i, word in enumerate(published):
            words[at + self._VERDICT + i] = int(word)
        words[at + self._SEQUENCE] += 1

    @property
    def loop_fault(self) -> Fault:
        """What the end of the loop is called: by whoever took it for lost first, as the fault of a loop that ended by
        itself where nobody did."""
        verdicts = [report for writer in Writer if (report := self.report(writer)).verdict is not LoopVerdict.WATCHING]
        first = min(verdicts, key=lambda report: report.seen_ns, default=SafeReport(verdict=LoopVerdict.ENDED))
        return first.verdict.fault

    def best(self, since_ns: int = 0) -> SafeReport:
        """The report that knows most, of those of a loss seen at `since_ns` or later; of equal ones the earliest
        write."""
        outcomes = [report for writer in Writer if (report := self.report(writer)).outcome is not Outcome.UNKNOWN]
        recent = [report for report in outcomes if report.seen_ns >= since_ns]
        return max(recent, key=lambda report: (report.outcome, -report.written_ns), default=SafeReport())

    def _at(self, writer: Writer) -> int:
        return HEADER_WORDS + writer * self._SLOT


class WatchedProcess:
    """A process by its descriptor: whether it is gone, and its end. A pid that is gone already is a process that is
    gone; OSError for one that cannot be watched, which may well be there."""

    def __init__(self, pid: int) -> None:
        try:
            self._descriptor: int | None = os.pidfd_open(pid)
        except ProcessLookupError:
            self._descriptor = None

    def gone_within(self, seconds: float) -> bool:
        """Wait that long for its end."""
        if self._descriptor is None:
            return True
        if self._descriptor < _FD_SETSIZE:  # to the microsecond
            return bool(select.select([self._descriptor], [], [], seconds)[0])
        look = select.poll()
        look.register(self._descriptor, select.POLLIN)
        return bool(look.poll(seconds * 1e3))

    def kill(self) -> None:
        """SIGKILL, which ends a stopped process too."""
        if self._descriptor is not None:
            with contextlib.suppress(OSError):
                signal.pidfd_send_signal(self._descriptor, signal.SIGKILL)

    def close(self) -> None:
        """Let go of the descriptor."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)


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
