"""Runs that are under way: what is seen of the session's processes, of the records and of the operator until the loop
has ended, and what comes of it."""

import math
import os
import signal
import time
from collections.abc import Callable

from rig.app.runs.operator import Operator
from rig.app.runs.outcome import ASKED_FOR, RunOutcome
from rig.app.terminal import progress, say
from rig.app.trying_on import TryingOn
from rig.app.watcher_process import driver_of
from rig.realtime.faults import Fault, explain
from rig.rig_config import RigConfig
from rig.service.records.recorder_messages import message_of
from rig.service.session.session import Session

_POLL_S = 0.05
"""Between two looks at processes and results, s. Longer: a lost recorder stops the rig later."""


class RunsUnderWay:
    """The runs of an open session: `watch`, `judge_end`, and `close` on every path."""

    def __init__(self, session: Session, rig: RigConfig, operator: Operator, planned: int) -> None:
        self.session, self.rig, self.operator = session, rig, operator
        self.outcome = RunOutcome([], planned, channels=rig.channels)
        """What has come of them so far."""

    def watch(self, total_ticks: int) -> None:
        """Let the loop begin to tick. Until it ends: beat, show progress, gather results, and end the runs where the
        recorder is dead or its file gone."""
        session, warned = self.session, ""
        with progress("running", total_ticks) as update:
            # only now: what progress imports takes a while on a busy machine, and the loop waits for our beat
            session.go()
            while session.loop_alive:
                session.beat()
                self.outcome.runs += session.recording.results()
                self._show(update)
                self._look_at_processes()
                warned = self._say_trouble(warned)
                self._stop_without_a_file()
                time.sleep(_POLL_S)

    def judge_end(self) -> None:
        """Once the loop has ended: why it did, where it should not have."""
        if self._recorder_is_lost() and not self.outcome.recorder_lost:  # also where both ended unseen
            self.outcome.recorder_lost = True
            self.outcome.error = self.outcome.error or f"the rig was stopped: {explain(Fault.RECORDER_DIED)}"
        self.outcome.error = self.outcome.error or ending(self.session, self.operator.asked_to_stop)

    def close(self) -> None:
        """End the session, with what became of the rig and of its last records."""
        session, outcome = self.session, self.outcome
        last = session.ring.latest()
        cause = explain(last.fault, message_of(last.fault, session.ring)) if last is not None and last.fault else ""
        results = session.close(lambda line: say(line, "yellow"), self._insist)
        outcome.runs += results
        outcome.end = session.end
        if outcome.end.insisted and outcome.end.report.safe:
            say(outcome.end.words, "green")
        if session.recording.given_up:
            lost = [f"{run.file}: {run.error}" for run in results if run.error]
            outcome.error = outcome.error or "; ".join(lost) or session.recording.given_up
        if last is not None and last.run and not any(run.fault for run in outcome.runs):
            # its recorder was lost before it could tell
            asked_for = self.operator.asked_to_stop and last.fault in ASKED_FOR
            outcome.error = outcome.error or ("" if asked_for else cause)

    def _insist(self, done: Callable[[], bool], attempt: Callable[[], None]) -> str:
        """Go on trying to make a rig safe whose device was lost, until the operator presses Ctrl-C once more."""
        before, safe_mpa = self.operator.presses, (self.rig.safe.p1_mpa, self.rig.safe.p2_mpa)
        trying = TryingOn(safe_mpa, lambda: self.operator.presses > before, driver_of(self.rig, os.getpid()))
        return trying.go_on(done, attempt)

    def _say_trouble(self, warned: str) -> str:
        """Warn at once when the record cannot be written, also into a pipe: by the end it may be lost. `warned`: the
        last warning; returns the one that holds now."""
        trouble = self.session.recording.trouble
        if trouble is not None and trouble.final:
            return warned  # it ends the run, which says why
        now = trouble.error if trouble is not None else ""
        if now != warned:
            line = f"warning: {now}; the samples wait in memory" if now else "the record can be written again"
            say(line, "yellow")
        return now

    def _stop_without_a_file(self) -> None:
        """Once a record has no file any more: what came after it would be lost."""
        outcome, trouble = self.outcome, self.session.recording.trouble
        missing = len(outcome.runs) < outcome.planned
        lost = [run.error for run in outcome.runs if run.error and not run.valid and missing]
        gone = [trouble.error] if trouble is not None and trouble.final else []
        if (lost or gone) and not outcome.error:
            outcome.error = f"the rig was stopped: {[*gone, *lost][0]}"
            self.session.mailbox.stop()

    def _recorder_is_lost(self) -> bool:
        """Whether the recorder has ended and should not have. When the operator stops a run by a signal, that may reach
        all its processes; a recorder that ended so has finished its file."""
        session = self.session
        codes = (0, -signal.SIGTERM)  # by a second one it ends on the spot, its file finished, and hears no more
        asked = self.operator.asked_to_stop and session.recorder is not None and session.recorder.exitcode in codes
        return not session.recorder_alive and not asked

    def _look_at_processes(self) -> None:
        """End the runs, by the safe state at once, when one of the session's processes is lost."""
        session = self.session
        loss = session.watch.look() if session.watch is not None else None
        if loss is None or loss.of_the_loop:
            return  # the loop's end is told when it has ended
        if loss.fault is Fault.RECORDER_DIED and not session.recorder_alive and not self._recorder_is_lost():
            return
        self.outcome.recorder_lost = loss.fault is Fault.RECORDER_DIED
        self.outcome.error = f"the rig was stopped: {explain(loss.fault, loss.message)}"

    def _show(self, update: Callable[[float, str], None]) -> None:
        own, latest, trouble = self.rig.channels, self.session.ring.latest(), self.session.recording.trouble
        if latest is None:
            return
        output = own.own_output(latest.angle_deg)
        angle = f"{output:+6.1f} {own.output.unit}" if math.isfinite(output) else ""
        stopping = "ramping down  " if self.operator.asked_to_stop else ""
        line = f"{stopping}run {latest.run}  {angle}  missed {latest.missed}"
        update(latest.tick, line if trouble is None else f"{line}  {trouble.error}")


def ending(session: Session, interrupted: bool = False) -> str:
    """Why the loop ended, when it did not end as it should."""
    if error := session.loop_error():
        return error
    if session.loop is not None and session.loop.exitcode:
        if session.watch is None:
            return explain(Fault.LOOP_DIED)
        return explain(session.watch.loop_fault, session.watch.how_it_ended())
    last = session.ring.latest()
    if last is not None and last.fault and not last.run and not (interrupted and last.fault in ASKED_FOR):
        # outside a record, so that none of them tells it
        return explain(last.fault, message_of(last.fault, session.ring))
    return ""
