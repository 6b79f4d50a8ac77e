"""Carries out runs on a rig: opens a session, sends the programs, and says what the operator must know before anything
moves. `run`, `track` and `replay` stand on it; what happens meanwhile is in under_way.py, who stops it in operator.py,
where the records go in record_folders.py, what came of it in outcome.py."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rig.app import compose
from rig.app.loop_process import loop_process
from rig.app.runs.operator import GivenUp, Operator
from rig.app.runs.outcome import RunOutcome
from rig.app.runs.record_folders import prepare_folder
from rig.app.runs.under_way import RunsUnderWay
from rig.app.supervise import watching
from rig.app.supervised_command import check_last_resort
from rig.app.terminal import console
from rig.errors import RigError
from rig.realtime import measures
from rig.realtime.program import Program
from rig.rig_config import RigConfig, apart
from rig.service.records.recorder_messages import RunOrder
from rig.service.session.operator_facts import facts_for_operator, is_warning
from rig.service.session.run_setup import order_of, session_facts
from rig.service.session.session import Session
from rig.service.signals import own_signals


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
    operator = Operator()
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
        under_way = RunsUnderWay(session, rig, operator, len(runs))
        try:
            _run(under_way, runs, options)
        except GivenUp:
            pass  # the outcome says so, as of any run that was interrupted
        except RigError:
            if not operator.asked_to_stop:  # by a signal that all processes may have heard, also one that was starting
                raise
    under_way.outcome.interrupted = operator.asked_to_stop
    return under_way.outcome


def _run(under_way: RunsUnderWay, runs: Sequence[Planned], options: RunOptions) -> None:
    session, rig = under_way.session, under_way.rig
    try:
        session.open([planned.program for planned in runs], scripted=True, meanwhile=under_way.operator.check)
        under_way.outcome.realtime = session.facts["realtime"]
        check_realtime(rig, session.facts["realtime"], options.force)
        announce(session.facts["device"])
        check_last_resort(rig, session.facts["device"], options.force)
        for order in _orders(session, rig, runs, options):
            session.recording.expect(order)
        under_way.watch(sum(planned.program.ticks for planned in runs))
        under_way.judge_end()
    finally:
        under_way.close()


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
    for key, text in facts_for_operator(device).items():
        terminal.print(f"{key}: {text}", style="yellow" if is_warning(key) else "", markup=False)


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
