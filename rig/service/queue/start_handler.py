"""What becomes of a `start`: sweeps are checked, summed up and queued, one start after the other."""

import asyncio
from pathlib import Path
from typing import Any, Final

from rig.realtime.state import Event, State
from rig.service.connections.arguments import check_start
from rig.service.connections.protocol import Code, Refused
from rig.service.queue.job_queue import Queue
from rig.service.queue.planner import Planner
from rig.service.queue.queue_runner import QueueRunner
from rig.service.session.session_monitor import SessionMonitor

_MOST_STARTS: Final = 4
"""At a time: each holds a client's place for as long as its sweep takes to expand."""
_DECIDE: Final = (
    "say what is to become of it: `pamrig start --first` does it before the new sweeps, `pamrig start --only` leaves "
    "it where it is, `pamrig clear` drops it"
)


class StartHandler:
    """Queues what clients start."""

    def __init__(self, monitor: SessionMonitor, queue: Queue, runner: QueueRunner, checker: Planner) -> None:
        """`checker` stands apart from the queue runner's planner: what a client sends must not hold up a sweep that
        runs."""
        self._monitor, self._queue, self._runner, self._checker = monitor, queue, runner, checker
        self._turn, self._starts = asyncio.Lock(), 0

    async def start(self, sweeps: list[Any], pause_s: float, before: str) -> list[dict[str, Any]]:
        """Queue these sweeps and go on with the queue; the new jobs as plain data.

        Raises Refused when the state, the queue or too many other starts speak against it, or when somebody stopped the
        rig meanwhile; RigError for a sweep that does not fit.
        """
        holds = self._runner.holds
        if self._monitor.state is not State.RUNNING:
            self._monitor.require(Event.START)
        check_start(sweeps, pause_s, before)
        if self._starts >= _MOST_STARTS:
            raise Refused(Code.REFUSED, f"{_MOST_STARTS} starts are being looked at already; try again")
        self._starts += 1
        try:
            async with self._turn:  # what one start adds is not what the next finds left over
                return await self._queue_up([Path(sweep) for sweep in sweeps], pause_s, before, holds)
        finally:
            self._starts -= 1

    async def _queue_up(self, sweeps: list[Path], pause_s: float, before: str, holds: int) -> list[dict[str, Any]]:
        """`holds`: how often the queue had been stopped when the start was asked for."""
        await self._runner.check_space()
        planned = [(sweep, await self._checker.check(sweep)) for sweep in sweeps]
        self._require_unstopped(holds, "nothing was queued")
        waits = self._runner.interrupted
        if sweeps and waits and not before:
            raise Refused(Code.WRONG_STATE, f"the queue holds {waits}; {_DECIDE}")
        jobs = [await self._runner.add(path, summary, pause_s) for path, summary in planned]
        if self._queue.next() is None:
            raise Refused(Code.WRONG_STATE, "the queue is empty; give a sweep to start")
        self._require_unstopped(holds, "it waits in the queue, and nothing moves")
        self._runner.go_on([job.id for job in jobs] if waits and before == "leave" else None)
        return [{"id": job.id, "sweep": job.sweep, "records": job.total, "seconds": job.seconds} for job in jobs]

    def _require_unstopped(self, holds: int, so: str) -> None:
        if self._runner.holds != holds:
            raise Refused(Code.WRONG_STATE, f"the rig was stopped while this start was being looked at: {so}")
