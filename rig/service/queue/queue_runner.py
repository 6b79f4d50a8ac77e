"""Works on the queue: one sweep after the other, record by record, with pauses; stops when told, and at every fault."""

import asyncio
import logging
import time
from collections.abc import Collection, Coroutine
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

from rig.errors import RigError
from rig.log.mcap.schema import Ended
from rig.number_text import counted
from rig.outputs import file_name
from rig.realtime.commands import Request, program_path
from rig.realtime.state import State
from rig.rig_config import RigConfig, apart
from rig.service.aside import DiskWork, NoThread, aside
from rig.service.connections.protocol import Code, Refused
from rig.service.processes import DISK_PATIENCE_S
from rig.service.queue.expander import Published, Summary
from rig.service.queue.job_queue import Job, JobState, Queue
from rig.service.queue.planner import Planner
from rig.service.records.free_space import FreeSpace
from rig.service.records.ledger import Ledger
from rig.service.records.record_names import free, renamed, vacated
from rig.service.records.recorder_messages import RunOrder, RunResult
from rig.service.session.run_setup import order_of, session_facts
from rig.service.session.session import Session
from rig.service.session.session_monitor import SessionMonitor
from rig.service.settings import DaemonSettings

T = TypeVar("T")
_POLL_S: Final = 0.02
_FAULT_RESULT_S: Final = 5.0
"""For a recorder's word after a fault, which may be its own."""
_LAST_RESULT_S: Final = 0.1
"""For what a recorder said just before it ended."""
_LOG = logging.getLogger("pamrig")


class NoSpace(Refused):
    """The disk is too full for another record."""


class _Held(Exception):
    """A stop came before the record that was being prepared had begun."""


class QueueRunner:
    """Turns jobs into runs of the monitor's session."""

    def __init__(
        self, monitor: SessionMonitor, queue: Queue, rig: RigConfig, settings: DaemonSettings, ledger: Ledger,
        disks: DiskWork,
    ) -> None:  # fmt: skip
        self._monitor, self._queue, self._rig, self._settings, self._ledger = monitor, queue, rig, settings, ledger
        self._disks = disks
        self.planner = Planner(rig)
        self.space = FreeSpace(settings.logs)
        """On the disk where the records go."""
        self._held = True
        """Nothing is started by itself: not after a restart, not after a stop or a fault."""
        self._only: frozenset[int] | None = None
        """The jobs that were asked for; None: the whole queue."""
        self._planning: asyncio.Future[Any] | None = None
        """What the planner is asked for at present."""
        self._wake = asyncio.Event()
        self._last_run = 0
        self._running: tuple[Published, int] | None = None
        """The record that runs, and the loop's tick when it began."""
        self.current: Path | None = None
        """Its file, from before it begins."""
        self._pause_until = 0.0
        self.holds = 0
        """How often somebody has stopped the queue: who began before it is not to go on after it."""

    async def add(self, path: Path, sweep: Summary, pause_s: float) -> Job:
        """A sweep at the end of the queue."""
        return await self._disks.do(lambda: self._queue.add(path, path.stem, sweep.records, sweep.seconds, pause_s))

    def go_on(self, only: Collection[int] | None = None) -> None:
        """Work until the queue, or what of it was asked for, is done; more may be asked for meanwhile."""
        asked = self._only if self._going and self._only is not None else frozenset[int]()
        self._only = None if only is None else asked.union(only)
        self._held = False
        self._wake.set()

    def hold(self) -> None:
        """Start no further record, of a start that is still being looked at neither."""
        self._held = True
        self.holds += 1
        self._pause_until = 0.0
        if self._planning is not None:
            self._planning.cancel()

    @property
    def interrupted(self) -> str:
        """What is left in the queue and nobody goes on with, with its length; empty for nothing."""
        return self._queue.described(self._left_out)

    @property
    def _left_out(self) -> list[int]:
        """The jobs of it: all after a stop or a fault, and while some are worked on alone the others."""
        left = [job.id for job in self._queue.left()]
        if not self._going:
            return left
        return [] if self._only is None else [number for number in left if number not in self._only]

    @property
    def _going(self) -> bool:
        """Another record will be begun without being asked again."""
        return not self._held and self._next is not None

    @property
    def _next(self) -> Job | None:
        return self._queue.next(self._only)

    async def idle(self) -> None:
        """Until the record that runs, if any, has been given up or finished."""
        while any(job.state is JobState.RUNNING for job in self._queue.jobs):
            await asyncio.sleep(_POLL_S)

    @property
    def working(self) -> bool:
        """Something runs, or will without being asked again."""
        return self._running is not None or self._going

    async def run(self) -> None:
        """For ever: wait for work, do it."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            while not self._held and (job := self._next) is not None:
                await self._job(job)
                if not self._held and self._next is not None:
                    await self._rest(job.pause_s)

    async def _rest(self, seconds: float) -> None:
        self._pause_until = time.monotonic() + seconds
        while time.monotonic() < self._pause_until:
            await asyncio.sleep(min(_POLL_S, seconds))

    async def _job(self, job: Job) -> None:
        job.state, job.error = JobState.RUNNING, ""
        await self.keep()
        try:
            sweep = await self._planned(self.planner.open(Path(job.sweep)))
            if sweep.records != job.total:
                raise RigError(
                    f"{job.sweep}: has {sweep.records} records now and had {job.total} when it was queued; start it "
                    "anew"
                )
            await self._records(job, sweep)
        except _Held:
            pass  # stopped, below
        except (Refused, NoThread) as error:  # as things stand now: the sweep is as good as before
            self._give_up(job, JobState.STOPPED, str(error))
        except RigError as error:
            self._give_up(job, JobState.FAILED, str(error))
        if job.state is JobState.RUNNING:
            job.state = JobState.DONE if job.done == job.total else JobState.STOPPED
        await self.keep()

    async def _planned(self, asked: Coroutine[Any, Any, T]) -> T:
        """What the planner answers, which may take minutes; _Held as soon as nothing is to be begun any more, for a
        reset waits for us, and already when a stop came before it was asked."""
        if self._held:
            asked.close()
            raise _Held
        self._planning = task = asyncio.ensure_future(asked)
        try:
            return await task
        except asyncio.CancelledError:
            this = asyncio.current_task()
            if this is not None and not this.cancelling():  # else the daemon ends; somebody may have started anew
                raise _Held from None
            raise
        finally:
            self._planning = None

    async def _records(self, job: Job, sweep: Summary) -> None:
        await self.check_space()
        if not job.folder:
            job.folder = str(await self._disks.do(lambda: self._folder(job.name)))
            await self.keep()  # before anything lies there: a daemon may be killed in the first record
        await self._disks.do(lambda: _make(Path(job.folder)))
        for index in range(job.done, job.total):
            await self.check_space()
            if self._held:
                return
            result = await self._record(job, sweep, index)
            if result is None or result.fault or result.error or self._monitor.fault:
                self._give_up(job, JobState.STOPPED, self._why(result))
                return
            stopped = result.ended is Ended.STOPPED
            file = await self._disks.do(partial(renamed, result.file, result.ended)) if stopped else result.file
            job.made(file, valid=result.valid or stopped)
            await self._remember(file)
            if stopped:
                return  # by the operator: it is made again when the job goes on
            if not result.complete:
                lost = f"{counted(result.missed, 'tick')} missed and {result.dropped} dropped"
                self._give_up(job, JobState.STOPPED, f"{result.file.name}: {lost}: the sweep is not whole")
                return
            job.done += 1
            await self.keep()

    async def keep(self) -> None:
        """The queue onto the disk. One that takes nothing is told, and is no end of the daemon: the queue goes on in
        memory, and is kept by the next change that can be."""
        try:
            await self._disks.do(self._queue.save)
        except RigError as error:
            _LOG.error("%s; after a restart the daemon knows the queue as it was kept last", error)

    async def _remember(self, file: Path) -> None:
        """Write down that the daemon made it. A record that cannot be written down stays for ever, which is no reason
        to stop."""
        try:
            await self._disks.do(lambda: self._ledger.add(file))
        except RigError as error:
            _LOG.error("%s", error)

    async def _record(self, job: Job, sweep: Summary, index: int) -> RunResult | None:
        """Carry out one run; None when the session broke under it."""
        monitor, session = self._monitor, self._monitor.session
        if session is None:
            return None
        self._last_run += 1
        run, holds = self._last_run, self.holds
        try:
            plan = await self._planned(self.planner.publish(index, run, session.id))
        except _Held:
            program_path(session.id, run).unlink(missing_ok=True)  # what was written of it so far
            raise
        except RigError as error:  # no room in memory, or no process: the sweep has been read and is as good as before
            raise Refused(Code.REFUSED, str(error)) from None
        session.adopt(run)
        try:
            self.current = await self._disks.do(lambda: vacated(Path(job.folder) / f"{plan.name}.mcap"))
            facts: dict[str, Any] = {
                **session_facts(session, self._rig),
                **plan.facts,
                "name": plan.name,
                "job": job.id,
            }
            attachments = apart({"sweep.yaml": sweep.text}, self._rig.files)
            order = order_of(session, run, plan.sweep_ticks, self.current, facts, attachments)
            await self._begin(session, order, holds)
            self._running = plan, monitor.telemetry.latest.tick if monitor.telemetry and monitor.telemetry.latest else 0
            _LOG.info("%s started, run %d", plan.name, run)
            return await self._result(session, run)
        finally:
            self._running = self.current = None
            session.retire(run)

    async def _begin(self, session: Session, order: RunOrder, holds: int) -> None:
        """Tell the recorder, who takes an order that is longer than a pipe when his disk lets him, and then the loop.
        _Held when there are more than so many `holds` meanwhile: the rig may even be armed anew by then, and a reset
        waits for us."""
        telling = asyncio.ensure_future(aside(lambda: session.recording.expect(order)))
        try:
            while not telling.done():
                await asyncio.wait({telling}, timeout=_POLL_S)
                if self.holds != holds:
                    raise _Held
            session.mailbox.stop(False)
            await self._monitor.request(Request.START, order.run)
        except (_Held, Refused):
            session.recording.call_off(order.run)
            raise

    async def _result(self, session: Session, run: int) -> RunResult | None:
        """What the recorder says of the run, once it is over; None when nobody is left to say it."""
        over_since = None
        while run not in self._monitor.results:
            running = self._monitor.state is State.RUNNING
            if session.recording.trouble is not None and session.recording.trouble.final:
                session.mailbox.stop()  # it would sweep for nothing
            over_since = None if running else over_since or time.monotonic()
            patience_s = _FAULT_RESULT_S if self._monitor.fault else DISK_PATIENCE_S
            patience_s = patience_s if session.recorder_alive else _LAST_RESULT_S
            if over_since is not None and time.monotonic() - over_since > patience_s:
                return None
            await asyncio.sleep(_POLL_S)
        result = self._monitor.results.pop(run)
        verdict = "valid" if result.valid else "stopped" if result.ended is Ended.STOPPED else "not valid"
        _LOG.info(
            "%s: %d ticks, %d missed, %d dropped, %s",
            result.file.name,
            result.ticks,
            result.missed,
            result.dropped,
            verdict,
        )
        return result

    def _give_up(self, job: Job, state: JobState, why: str) -> None:
        """STOPPED by a fault, after which `start` goes on; FAILED for a sweep that cannot be carried out."""
        job.state, job.error = state, why
        self.hold()
        _LOG.error("%s %s: %s", job.name, state.value, why)

    def _why(self, result: RunResult | None) -> str:
        fault = self._monitor.fault
        if result is None or fault:
            return f"{fault.name}: {self._monitor.message}".rstrip(": ") if fault else "the recorder gave no result"
        return result.error or "the run ended in a fault"

    @property
    def recording_error(self) -> str:
        """Why records cannot be written at present; empty when nothing is known against it."""
        session = self._monitor.session
        if session is not None and session.recording.trouble is not None:
            return session.recording.trouble.error
        return self.space.trouble

    async def check_space(self) -> None:
        """NoSpace when the disk has less free than is to be spared, or does not say."""
        await self.space.look()
        logs, spare_gb, free_gb = self._settings.logs, self._settings.spare_gb, self.space.gb
        if trouble := self.space.trouble:
            remedy = "make it again" if free_gb is None else "see what holds it up"
            raise NoSpace(Code.REFUSED, f"{trouble}; {remedy}, then go on")
        if free_gb is not None and free_gb < spare_gb:
            raise NoSpace(Code.REFUSED, f"{logs}: {free_gb:.2f} GB free; {spare_gb:g} GB are to be spared (`spare_gb`)")

    def _folder(self, name: str) -> Path:
        """A new one for a sweep's records; another daemon may have the same logs."""
        stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
        while True:
            folder = free(self._settings.logs / f"{stamp}_{file_name(name)}")
            if _make(folder, own=True):
                return folder

    def to_json(self) -> dict[str, Any]:
        """What is being done, how far it is, and how long the rest takes."""
        shown: dict[str, Any] = {
            "working": self.working,
            "held": self._held,
            "interrupted": self._left_out,
            "queue": list(self._queue.shown()),
            "left_s": 0.0,
            "record": None,
        }
        shown["recording_error"] = self.recording_error
        shown["pause_s"] = max(self._pause_until - time.monotonic(), 0.0)
        done_s = 0.0
        if self._running is not None and self._monitor.telemetry and self._monitor.telemetry.latest:
            plan, started = self._running
            tick = min(self._monitor.telemetry.latest.tick - started, plan.ticks)
            done_s = tick * self._rig.period_ns / 1e9
            shown["record"] = {
                "name": plan.name,
                "done": tick / plan.ticks,
                "left_s": (plan.ticks - tick) * self._rig.period_ns / 1e9,
            }
        shown["left_s"] = (
            max(self._queue.seconds_left(self._only if self._going else None) - done_s, 0.0) + shown["pause_s"]
        )
        return shown


def _make(folder: Path, own: bool = False) -> bool:
    """Whether the folder is there; with `own`, whether it was made just now. NoSpace when it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=not own)
        return True
    except FileExistsError:
        if own and folder.is_dir():
            return False
        raise NoSpace(Code.REFUSED, f"{folder}: cannot be made: something else is there") from None
    except OSError as error:
        raise NoSpace(Code.REFUSED, f"{folder}: cannot be made: {error.strerror}") from None
