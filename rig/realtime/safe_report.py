"""What is known of the safe state: who may write it, how the loop was found, what came of it, and the memory in which
all processes of a session share that. Nothing is written to a device here.
"""

import time
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Final, Self

from rig.realtime.faults import Fault
from rig.realtime.shared import HEADER_WORDS, SharedBlock

NOT_SAFE: Final = "NOT SAFE as far as is known"
_READS: Final = 3
"""Attempts to read a report that another process may be writing meanwhile."""


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
