"""What the commanding process does about a lost process: see it, demand the safe state, and see to it that the device
takes it.

One watch for all who have a session: the daemon, `pamrig run` and `pamrig replay`. Whoever is left writes, in this
order: the loop, the supervisor, this process, the guardian, the device's own watchdog.
"""

import math
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from multiprocessing.process import BaseProcess
from typing import Final

from rig.realtime.commands import Mailbox
from rig.realtime.faults import Fault
from rig.realtime.ring import Ring
from rig.realtime.safe_report import LoopVerdict, Outcome, SafeReport, Writer
from rig.realtime.safe_state import SafeStateAuthority, SecondPath, look
from rig.realtime.watched_process import WatchedProcess
from rig.service.aside import ReadyThread
from rig.service.processes import is_stopped
from rig.service.session.watchers import Watchers
from rig.silence import Silence

LOOP_PATIENCE_S: Final = 0.1
"""Silence of a loop, or of one that was told to make safe, that the supervisor has not ended before: it is lost too."""
_UNWATCHED_PATIENCE_S: Final = 1.0
"""Without a supervisor the plant ends with the loop, and there is no hurry."""
_PATIENCE_PERIODS: Final = 6
"""At long periods the patience is so many of them: a loop beats once in each, and may skip some before it is a fault of
its own."""
_GRACE_S: Final = 0.1
"""What a supervisor that works has for the safe state of a loop that is gone."""
CONFIRMING_NS: Final = 100_000_000
"""A safe state that was written so long ago would have been read back by now if the device could tell; after it no more
than that it was written can be said. Shorter: a slow wire's answer is not waited for; longer: so is the answer to an
emergency stop."""
RECORDER_STOPPED_S: Final = 0.2
"""After taking nothing for so long a recorder is asked for: one that somebody has stopped by a signal does not come
back by itself."""
_LET_GO_S: Final = 3.0
"""For an attempt that is under way at the end: to connect, to write, and to look, a second each at most."""
_POLL_S: Final = 0.002
_LOOK_NS: Final = 200_000_000
_LOOKS: Final = 3
"""At the device, for a loop that cannot read back; and the time between them."""
_HOW: Final = {
    LoopVerdict.WATCHING: "ended",
    LoopVerdict.ENDED: "ended",
    LoopVerdict.SILENT: "hung or was stopped",
    LoopVerdict.STALLED: "stood still with all the others, and had not come back when its patience was over",
}
_SUSPENDED_S: Final = 0.1
"""No machine sleeps and wakes again in less."""


@dataclass(frozen=True)
class Loss:
    """A process that the rig must not run without is lost."""

    fault: Fault
    message: str
    of_the_loop: bool = field(default=False, compare=False)
    """It is the loop, which can be asked for nothing any more."""


PathMaker = Callable[[], SecondPath]


def is_final(report: SafeReport) -> bool:
    """Seen at the device; or written, and so long ago that it would have been seen if it could be."""
    return report.outcome > Outcome.WRITTEN or (report.safe and time.monotonic_ns() - report.written_ns > CONFIRMING_NS)


def reported_by_loop(ring: Ring, seen_ns: int = 0) -> SafeReport:
    """What a loop says of the safe state that is there, or has left in good order; without a writer while it commands.
    `seen_ns`: when somebody else read it back for the loop."""
    if not ring.safe_ns:
        return SafeReport()
    seen_ns = max(ring.safe_seen_ns, seen_ns)
    outcome = Outcome.SEEN if seen_ns >= ring.safe_ns else Outcome.WRITTEN
    if ring.safe_is_doubted:
        outcome = Outcome.DOUBTED
    return SafeReport(Writer.LOOP, outcome=outcome, written_ns=ring.safe_ns, confirmed_ns=seen_ns)


def _suspended_s() -> float:
    """For how long this machine has been suspended since it was started: the clock by which the loop ticks, and with it
    every silence, stands still meanwhile. Never too long: who is held up between the two looks sees less."""
    return time.clock_gettime(time.CLOCK_BOOTTIME) - time.clock_gettime(time.CLOCK_MONOTONIC)


class ProcessWatch:
    """Looks after the processes of one session from its `open` on. `look` many times a second; it never blocks."""

    def __init__(
        self, ring: Ring, mailbox: Mailbox, watchers: Watchers, loop: BaseProcess, recorder: BaseProcess, *,
        second_path: PathMaker | None, period_ns: int, timed: bool = True,
    ) -> None:  # fmt: skip
        """Without a `second_path` the plant lives in the loop's process and ends with it; one that is not `timed` is
        never late."""
        self._ring, self._mailbox, self._watchers, self._loop, self._recorder = ring, mailbox, watchers, loop, recorder
        self._second_path, self._period_ns = second_path, period_ns
        self._descriptor = WatchedProcess(loop.pid or 0)  # now: a pid that is free again may be somebody else's
        patience_s = LOOP_PATIENCE_S if watchers.processes else _UNWATCHED_PATIENCE_S
        self._patience_ns = max(patience_s * 1e9, _PATIENCE_PERIODS * period_ns) if timed else math.inf
        self._silence, self._deafness = Silence(self._patience_ns), Silence(self._patience_ns)
        self._recorder_seen = (0, time.monotonic_ns())
        """How far it had read, and since when it has stood there."""
        self._fills_ns = ring.capacity / 2 * period_ns
        self._standing, self._stopped = Silence(self._fills_ns), Silence(RECORDER_STOPPED_S * 1e9)
        self._demanded_ns = self._gone_ns = self._seen_ns = self._asked_ns = 0
        self._looked_for = (0, 0)
        """A write of the loop, and how often it was looked at for it."""
        self._loss: Loss | None = None
        self._timed, self._suspended_s = timed, max(_suspended_s() for _ in range(3))
        self._hands = ReadyThread()
        """Who takes over, or looks at the device, while others are looked after."""

    # what is wrong

    def look(self) -> Loss | None:
        """The first loss, once. Every loss is followed up until the device has taken the safe state."""
        loss = self._find()
        first = loss if self._loss is None else None
        if loss is not None and self._loss is None:
            self._loss = loss
            if not loss.of_the_loop:
                self.demand(loss.fault)
        self.follow_up()
        return first

    def _find(self) -> Loss | None:
        if not self._loop.is_alive():
            return Loss(self.loop_fault, "", of_the_loop=True)
        if self._timed and (slept_s := _suspended_s() - self._suspended_s) > _SUSPENDED_S:
            message = f"the machine was suspended for {slept_s:.0f} s, and the rig was in nobody's hands"
            return Loss(Fault.LONG_STALL, message)
        if self._silent():
            message = f"the loop has not moved for {self._patience_ns / 1e9:g} s"
            return Loss(Fault.LOOP_DIED, message, of_the_loop=True)
        if not self._recorder.is_alive():
            return Loss(Fault.RECORDER_DIED, "the recorder's process is gone")
        if why := self._recorder_stands():
            return Loss(Fault.RECORDER_DIED, why)
        if why := self._watchers.trouble():
            return Loss(Fault.SUPERVISOR_DIED, why)
        return None

    def _silent(self) -> bool:
        """The loop does not beat, and not because the machine stood still."""
        return self._silence.too_long(self._ring.heartbeat_ns)

    def _deaf(self) -> bool:
        """The loop has not done what was demanded, though it had the time; a slow wire may still be carrying it."""
        return not (self._taken or self._ring.safe_is_coming) and self._deafness.too_long(self._demanded_ns)

    def _recorder_stands(self) -> str:
        """Why the recorder, which does not take what there is to read, is given up; empty while it is not.

        One that waits for a slow disk loses nothing as long as the ring has room; one that somebody stopped is not
        coming back.
        """
        ring, (cursor, since_ns) = self._ring, self._recorder_seen
        if ring.recorded != cursor or ring.head == ring.recorded:
            self._recorder_seen = (ring.recorded, time.monotonic_ns())
            return ""
        if self._standing.too_long(since_ns):
            why = "the disk does not keep up, or it hangs"
            return f"the recorder has not moved for {self._fills_ns / 1e9:.0f} s: {why}"
        stopped = self._stopped.too_long(since_ns) and is_stopped(self._recorder.pid)
        return "the recorder was stopped by a signal" if stopped else ""

    # the safe state

    def demand(self, fault: Fault) -> None:
        """The safe state, now: by the loop, and when that does not take it, by whoever is left.

        Patience counts from the first demand that is not answered: who asks again and again does not start it anew.
        """
        self._mailbox.estop(fault)
        if not self._demanded_ns or self.answer.safe:
            self._demanded_ns = time.monotonic_ns()

    def withdraw(self) -> None:
        """The rig may move again: nothing is demanded any more."""
        self._demanded_ns = 0
        self._mailbox.estop(Fault.NONE)

    @property
    def answer(self) -> SafeReport:
        """What became of the last demand; not safe as long as nobody has carried it out since."""
        if self._by_loop and self._taken:
            return self.safe
        return SafeReport() if self._loop.is_alive() else self._watchers.block.best(since_ns=self._demanded_ns)

    @property
    def safe(self) -> SafeReport:
        """What is known of the safe state now; without a writer while the loop commands."""
        return reported_by_loop(self._ring, self._seen_ns) if self._by_loop else self._watchers.block.best()

    @property
    def _by_loop(self) -> bool:
        """The loop answers for the outputs: it is there, or it has left in good order."""
        ring = self._ring
        return self._loop.is_alive() or (self._loop.exitcode == 0 and ring.safe_ns != 0 and not ring.safe_is_doubted)

    @property
    def _taken(self) -> bool:
        """The loop has ticked since the demand, and the safe state stands."""
        return self._ring.heartbeat_ns > self._demanded_ns and self._ring.safe_ns != 0

    def follow_up(self) -> None:
        """Take over where nobody else has made the rig safe; goes on in a thread of its own."""
        verdict = self._needed()
        if self._hands.busy:
            return
        if verdict is not LoopVerdict.WATCHING:
            self._hands.begin(partial(self._take_over, verdict))
        elif self._unseen():
            self._hands.begin(self._see_for_the_loop)

    def _unseen(self) -> bool:
        """After a fault the loop wrote the safe state, and cannot read it back by itself."""
        report, latest = self.safe, self._ring.latest()
        if (
            report.writer is not Writer.LOOP
            or report.outcome is not Outcome.WRITTEN
            or latest is None
            or not latest.fault
        ):
            return False
        if self._looked_for[0] == report.written_ns and self._looked_for[1] >= _LOOKS:
            return False
        return self._second_path is not None and time.monotonic_ns() - max(report.written_ns, self._asked_ns) > _LOOK_NS

    def _see_for_the_loop(self) -> None:
        """By this process's own way to the device, which reads and writes nothing."""
        written_ns, self._asked_ns = self._ring.safe_ns, time.monotonic_ns()
        before = self._looked_for[1] if self._looked_for[0] == written_ns else 0
        self._looked_for = written_ns, before + 1
        assert self._second_path is not None
        path = self._second_path()
        if look(path) is Outcome.SEEN and self._ring.safe_ns == written_ns:
            self._seen_ns = time.monotonic_ns()
        path.close()

    def _needed(self) -> LoopVerdict:
        """How this process has to take over; WATCHING: it has not."""
        if self._loop.is_alive():
            self._gone_ns = 0
            return LoopVerdict.SILENT if self._deaf() or self._silent() else LoopVerdict.WATCHING
        if self.answer.safe:
            return LoopVerdict.WATCHING
        now_ns = time.monotonic_ns()
        self._gone_ns = self._gone_ns or now_ns
        grace_ns = _GRACE_S * 1e9 if self._watchers.works(Writer.SUPERVISOR) else 0
        return LoopVerdict.ENDED if now_ns - self._gone_ns >= grace_ns else LoopVerdict.WATCHING

    def _take_over(self, verdict: LoopVerdict) -> None:
        path = None if self._second_path is None else self._second_path()
        if path is not None and self._demanded_ns:  # somebody wants it written, whoever drives by now
            path = replace(path, claim=nullcontext)
        authority = SafeStateAuthority(Writer.CONTROL, self._watchers.block, self._ring, self._descriptor, path)
        authority.take_over(verdict)
        if path is not None:
            path.close()

    def settle(self, patience_s: float) -> SafeReport:
        """Wait until the safe state of a loop that has ended is known, or for `patience_s`; blocks."""
        deadline = time.monotonic() + patience_s
        while not self.is_settled() and time.monotonic() < deadline:
            self.follow_up()
            time.sleep(_POLL_S)
        return self.safe

    def is_settled(self) -> bool:
        """All is known of the safe state that can be, and the device has taken it."""
        return is_final(self.safe)

    def close(self) -> None:
        """Let go of the loop's process; somebody who still takes over keeps it. He is waited for: a process that ends
        in the middle of it would leave the device's own watchdog armed anew, and nobody to feed it."""
        deadline = time.monotonic() + _LET_GO_S
        while self._hands.busy and time.monotonic() < deadline:
            time.sleep(_POLL_S)
        if not self._hands.busy:
            self._descriptor.close()
        self._hands.end()

    @property
    def loop_fault(self) -> Fault:
        """What the end of the loop is called."""
        return self._watchers.block.loop_fault

    def how_it_ended(self) -> str:
        """How the loop's process ended, and when the one who took over saw it and had written."""
        report = self.safe
        code = self._loop.exitcode
        how = "" if code is None else f"killed by signal {-code}" if code < 0 else f"exit status {code}"
        if report.writer in (Writer.NOBODY, Writer.LOOP):
            return how
        what = _HOW[report.verdict]
        seen_ms = (report.seen_ns - report.last_beat_ns) / 1e6
        wrote = (
            f", {'gone' if report.outcome is Outcome.ENDED else 'written'} "
            f"{(report.written_ns - report.seen_ns) / 1e6:.1f} ms later"
            if report.written_ns
            else ""
        )
        return f"{how}; it {what}: seen {seen_ms:.1f} ms after its last heartbeat{wrote}"
