"""Reads, expands and checks sweeps in a process of its own: what a client sends may be large, slow or a trap, and is
kept away from the process that answers to an emergency stop.

The process also writes a record's program into shared memory, so that no set-point ever passes through the process
that commands the loop.
"""

import signal
from collections.abc import Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

from rig.errors import EnvelopeError, RigError
from rig.excite.envelope import check_run
from rig.excite.run_plan import RunPlan, expand
from rig.excite.sweep import Sweep, load_sweep
from rig.realtime.commands import program_name
from rig.rig_config import RigConfig
from rig.service.requests import serve_requests
from rig.service.session.run_setup import program_of

MEMORY_BYTES: Final = 2 * 1024**3
"""Limit of the process that expands sweeps; one that needs more is refused, and the daemon lives."""


@dataclass(frozen=True)
class Summary:
    """What a sweep amounts to."""

    records: int
    seconds: float
    text: bytes
    """The sweep's file as it was read."""


@dataclass(frozen=True)
class Published:
    """A record whose program lies in shared memory."""

    name: str
    facts: Mapping[str, Any]
    ticks: int
    sweep_ticks: int


def plans_of(path: Path, rig: RigConfig) -> list[RunPlan]:
    """Every run of the sweep at `path`, checked against the rig's envelope. RigError, one line, when it does not
    fit."""
    return _fitting(load_sweep(path), path, rig)


def _fitting(sweep: Sweep, path: Path, rig: RigConfig) -> list[RunPlan]:
    plans = expand(sweep, rig.period_ns)
    checked = set()
    for plan in plans:
        way = (id(plan.dp_mpa), plan.p0_mpa, plan.ramp_in_ticks, plan.ramp_out_ticks)
        if way not in checked:  # repeats go the same way
            try:
                check_run(plan, rig.limits, rig.period_ns)
            except EnvelopeError as error:
                raise EnvelopeError(f"{path.name}: {error}") from None
            checked.add(way)
    return plans


def serve(pipe: Connection, rig: RigConfig) -> None:
    """Entry of the process: answer requests until the other end closes."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        # they are for the process that commands; the end of the pipe ends this one
        signal.signal(number, signal.SIG_IGN)
    expander = Expander(rig)
    serve_requests(pipe, lambda what, *arguments: what(expander, *arguments), MEMORY_BYTES)


class Expander:
    """What the process does."""

    def __init__(self, rig: RigConfig) -> None:
        self._rig = rig
        self._plans: list[RunPlan] = []

    def warm(self) -> None:
        """There is nothing to do once the process runs."""

    def check(self, path: Path) -> Summary:
        return self._expanded(path)[1]

    def open(self, path: Path) -> Summary:
        self._plans = []
        self._plans, summary = self._expanded(path)
        return summary

    def publish(self, index: int, run: int, session: int) -> Published:
        if index >= len(self._plans):
            raise RigError("the process that read the sweep was replaced; start the sweep again")
        plan = self._plans[index]
        program = program_of(plan, run)
        program.publish(program_name(session, run), session).close()
        return Published(plan.name, plan.facts, program.ticks, len(program.p1_cmd_mpa))

    def _expanded(self, path: Path) -> tuple[list[RunPlan], Summary]:
        """The file is read once: what is kept of it in each record is what the record was made from."""
        sweep = load_sweep(path)
        plans = _fitting(sweep, path, self._rig)
        seconds = sum(plan.ticks for plan in plans) * self._rig.period_ns / 1e9
        return plans, Summary(len(plans), seconds, sweep.text.encode())
