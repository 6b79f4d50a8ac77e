"""Carries out runs on a rig: session, progress and stop keys. `run` and `replay` stand on it; where the records go is
in record_folders.py, what came of it in outcome.py."""

import math
import os
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rig.app import compose
from rig.app.loop_process import loop_process
from rig.app.runs.outcome import ASKED_FOR, RunOutcome
from rig.app.runs.record_folders import prepare_folder
from rig.app.supervise import watching
from rig.app.supervised_command import check_last_resort
from rig.app.terminal import console, progress, say
from rig.app.trying_on import TryingOn
from rig.app.watcher_process import driver_of
from rig.channels import Channels
from rig.errors import RigError
from rig.realtime import measures
from rig.realtime.faults import Fault, explain
from rig.realtime.program import Program
from rig.rig_config import RigConfig, apart
from rig.service.records.recorder_messages import RunOrder, message_of
from rig.service.session.operator_facts import facts_for_operator, is_warning
from rig.service.session.run_setup import order_of, session_facts
from rig.service.session.session import Session
from rig.service.signals import own_signals

_POLL_S = 0.05
"""Between two looks at processes and results, s. Longer: a lost recorder stops the rig later."""


@dataclass(frozen=True)
class Planned:
    """One run that is to come: what the loop follows, its name, and what the log says of it."""

    name: str
    program: Program
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class RunOptions:
    """How the runs are to be carried out."""

    out: Path
    virtual: bool = False
    seed: int | None = None
    force: bool = False
    """Go on real hardware although real-time measures were denied."""
    facts: Mapping[str, Any] = field(default_factory=dict)
    attachments: Mapping[str, bytes] = field(default_factory=dict)
    device_options: Mapping[str, Any] = field(default_factory=dict)
    """Settings of devices to override (a model for the simulated rig)."""


def carry_out(rig: RigConfig, runs: Sequence[Planned], options: RunOptions) -> RunOutcome:
    """Carry out the runs in order, one MCAP file each in `options.out`; the rig ends in its safe state on every
    path."""
    prepare_folder(options.out, [f"{planned.name}.mcap" for planned in runs])
    outcome = RunOutcome([], len(runs), channels=rig.channels)
    operator = _Operator()
    with own_signals(operator.signalled):
        session = Session(
            loop_process,
            rig,
            virtual=options.virtual,
            seed=options.seed,
            options=options.device_options,
            # a supervisor ends a loop that is 15 ms late; where nothing outlives the loop, nothing would be won by that
            watching=watching(rig) if compose.outlives_the_loop(rig) else None,
        )
        operator.command(session)
        if session.swept:
            console("-").print(session.swept)
        try:
            _run(session, rig, runs, options, operator, outcome)
        except _GivenUp:
            pass  # the outcome says so, as of any run that was interrupted
        except RigError:
            if not operator.asked_to_stop:  # by a signal that all processes may have heard, also one that was starting
                raise
    outcome.interrupted = operator.asked_to_stop
    return outcome


def _run(
    session: Session,
    rig: RigConfig,
    runs: Sequence[Planned],
    options: RunOptions,
    operator: "_Operator",
    outcome: RunOutcome,
) -> None:
    try:
        session.open([planned.program for planned in runs], scripted=True, meanwhile=operator.check)
        outcome.realtime = session.facts["realtime"]
        check_realtime(rig, outcome.realtime, options.force)
        announce(session.facts["device"])
        check_last_resort(rig, session.facts["device"], options.force)
        for order in _orders(session, rig, runs, options):
            session.recording.expect(order)
        watch(session, operator, outcome, sum(planned.program.ticks for planned in runs), rig.channels)
        if _recorder_is_lost(session, operator) and not outcome.recorder_lost:  # also where both ended unseen
            outcome.recorder_lost = True
            outcome.error = outcome.error or f"the rig was stopped: {explain(Fault.RECORDER_DIED)}"
        outcome.error = outcome.error or ending(session, operator.asked_to_stop)
    finally:
        _close(session, rig, operator, outcome)


def _close(session: Session, rig: RigConfig, operator: "_Operator", outcome: RunOutcome) -> None:
    """End the session, and put into `outcome` what became of the rig and of its last records."""
    last = session.ring.latest()
    cause = explain(last.fault, message_of(last.fault, session.ring)) if last is not None and last.fault else ""
    results = session.close(lambda line: say(line, "yellow"), lambda *how: _insist(rig, operator, *how))
    outcome.runs += results
    outcome.end = session.end
    if outcome.end.insisted and outcome.end.report.safe:
        say(outcome.end.words, "green")
    if session.recording.given_up:
        lost = [f"{run.file}: {run.error}" for run in results if run.error]
        outcome.error = outcome.error or "; ".join(lost) or session.recording.given_up
    if last is not None and last.run and not any(run.fault for run in outcome.runs):
        # its recorder was lost before it could tell
        asked_for = operator.asked_to_stop and last.fault in ASKED_FOR
        outcome.error = outcome.error or ("" if asked_for else cause)


def _insist(rig: RigConfig, operator: "_Operator", done: Callable[[], bool], attempt: Callable[[], None]) -> str:
    """Go on trying to make a rig safe whose device was lost, until the operator presses Ctrl-C once more."""
    before = operator.presses
    safe_mpa = rig.safe.p1_mpa, rig.safe.p2_mpa
    return TryingOn(safe_mpa, lambda: operator.presses > before, driver_of(rig, os.getpid())).go_on(done, attempt)


def check_realtime(rig: RigConfig, report: Mapping[str, str], force: bool) -> None:
    """RigError on hardware when the loop did not get what it needs to be punctual; on a simulated rig a line."""
    what = measures.denied(report)
    if not what:
        return
    if compose.is_simulated(rig):
        console("-").print(f"real-time measures not granted ({what}); the simulated rig runs without", style="yellow")
    elif not force:
        raise RigError(
            f"{rig.name}: real-time measures not granted ({what}); run as root or with an rtprio limit, or give --force"
        )


def announce(device: Mapping[str, str]) -> None:
    """What the operator must know of the devices before anything moves: the pace of slow ones, fail-safes, warnings."""
    terminal = console("-")
    for key, said in facts_for_operator(device).items():
        terminal.print(f"{key}: {said}", style="yellow" if is_warning(key) else "", markup=False)


def _orders(session: Session, rig: RigConfig, runs: Sequence[Planned], options: RunOptions) -> list[RunOrder]:
    common = (
        session_facts(session, rig) | ({} if options.seed is None else {"seed": options.seed}) | dict(options.facts)
    )
    chosen = [value for value in options.device_options.values() if isinstance(value, Path)]  # not the rig's
    attachments = apart(options.attachments, {path.name: path.read_bytes() for path in chosen}, rig.files)
    return [
        order_of(
            session,
            planned.program.run,
            len(planned.program.p1_cmd_mpa),
            options.out / f"{planned.name}.mcap",
            {**common, "name": planned.name, **planned.facts},
            attachments,
        )
        for planned in runs
    ]


class _GivenUp(Exception):
    """The operator asked to stop before the rig was open."""


class _Operator:
    """Ctrl-C: the first ramps down and finishes the file, the second is an emergency stop. Listens before there is a
    session."""

    def __init__(self) -> None:
        self._session: Session | None = None
        self.asked_to_stop = False
        self.presses = 0
        """How often he has asked for the end; a terminal that is gone asks for nothing more than the first stop."""

    def command(self, session: Session) -> None:
        self._session = session
        if self.asked_to_stop:
            session.mailbox.stop()

    def check(self) -> None:
        """_GivenUp once he has asked: a device that does not answer is not waited for any more."""
        if self.asked_to_stop:
            raise _GivenUp

    def signalled(self, number: int, _: object) -> None:
        again, self.asked_to_stop = self.asked_to_stop, True
        self.presses += number != signal.SIGHUP
        if self._session is not None:
            if again and number == signal.SIGINT:
                self._session.mailbox.estop()
            self._session.mailbox.stop()


def watch(session: Session, operator: _Operator, outcome: RunOutcome, total_ticks: int, own: Channels) -> None:
    """Let the loop begin to tick. Until it ends: beat, show progress, gather results, and end the runs where the
    recorder is dead or its file gone."""
    warned = ""
    with progress("running", total_ticks) as update:
        session.go()  # only now: what progress imports takes a while on a busy machine, and the loop waits for our beat
        while session.loop_alive:
            session.beat()
            outcome.runs += session.recording.results()
            _show(session, own, update, operator.asked_to_stop)
            _look(session, operator, outcome)
            warned = _say_trouble(session, warned)
            _stop_without_a_file(session, outcome)
            time.sleep(_POLL_S)


def _say_trouble(session: Session, warned: str) -> str:
    """Warn at once when the record cannot be written, also into a pipe: by the end it may be lost. `warned`: the last
    warning; returns the one that holds now."""
    trouble = session.recording.trouble
    if trouble is not None and trouble.final:
        return warned  # it ends the run, which says why
    now = trouble.error if trouble is not None else ""
    if now != warned:
        line = f"warning: {now}; the samples wait in memory" if now else "the record can be written again"
        say(line, "yellow")
    return now


def _stop_without_a_file(session: Session, outcome: RunOutcome) -> None:
    lost = [run.error for run in outcome.runs if run.error and not run.valid and len(outcome.runs) < outcome.planned]
    trouble = session.recording.trouble
    gone = [trouble.error] if trouble is not None and trouble.final else []
    if (lost or gone) and not outcome.error:
        outcome.error = f"the rig was stopped: {[*gone, *lost][0]}"
        session.mailbox.stop()


def _recorder_is_lost(session: Session, operator: _Operator) -> bool:
    """Whether the recorder has ended and should not have. When the operator stops a run by a signal, that may reach all
    its processes; a recorder that ended so has finished its file."""
    codes = (0, -signal.SIGTERM)  # by a second one it ends on the spot, its file finished, and hears no more
    asked = operator.asked_to_stop and session.recorder is not None and session.recorder.exitcode in codes
    return not session.recorder_alive and not asked


def _look(session: Session, operator: _Operator, outcome: RunOutcome) -> None:
    """End the runs, by the safe state at once, when one of the session's processes is lost."""
    loss = session.watch.look() if session.watch is not None else None
    if loss is None or loss.of_the_loop:
        return  # the loop's end is told when it has ended
    if loss.fault is Fault.RECORDER_DIED and not session.recorder_alive and not _recorder_is_lost(session, operator):
        return
    outcome.recorder_lost = loss.fault is Fault.RECORDER_DIED
    outcome.error = f"the rig was stopped: {explain(loss.fault, loss.message)}"


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


def _show(session: Session, own: Channels, update: Callable[[float, str], None], stopping: bool) -> None:
    latest = session.ring.latest()
    if latest is None:
        return
    output = own.own_output(latest.angle_deg)
    angle = f"{output:+6.1f} {own.output.unit}" if math.isfinite(output) else ""
    trouble = f"  {session.recording.trouble.error}" if session.recording.trouble is not None else ""
    update(
        latest.tick, f"{'ramping down  ' if stopping else ''}run {latest.run}  {angle}  missed {latest.missed}{trouble}"
    )
