"""The daemon: what it does on each command and each turn of its own clock. Processes are the session monitor's, jobs
the queue runner's."""

import asyncio
import contextlib
import gc
import logging
import os
import sys
import time
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Final

from rig.channels import FACT as CHANNELS
from rig.errors import RigError
from rig.realtime.faults import explain
from rig.realtime.state import Event, State
from rig.service.aside import DiskWork, aside, aside_or_here, in_any_case
from rig.service.connections.arguments import check_line
from rig.service.connections.control import Server
from rig.service.connections.protocol import PROTOCOL_VERSION, ClientRequest, Code, Refused
from rig.service.processes import processes_json
from rig.service.queue.job_queue import Queue
from rig.service.queue.planner import Planner
from rig.service.queue.queue_runner import QueueRunner
from rig.service.queue.start_handler import StartHandler
from rig.service.records.blackbox import Owner
from rig.service.records.ledger import Ledger
from rig.service.records.operating_time import OperatingTime
from rig.service.records.retention import Retention
from rig.service.session.marks import MarkWriter
from rig.service.session.session_monitor import SessionMonitor
from rig.service.session.session_parts import SessionParts
from rig.service.session.telemetry import fault_json, safe_json
from rig.service.settings import DaemonSettings, make_daemon_folder, read_token
from rig.service.signals import ending_signals
from rig.service.state_folder import StateFolder
from rig.service.views import metrics
from rig.service.views.fault_reports import FaultReports
from rig.service.views.live import LiveView
from rig.service.views.notify import Notifier
from rig.service.web.host import Page, page_setup

_TURN_S: Final = 0.02
_SWITCH_S: Final = 0.0002
_NICE: Final = -10
"""Where it is allowed: the loop stops when this process does not get to its heartbeat for a second."""
_HOUSEKEEPING_S: Final = 10.0
_FEEDINGS: Final = 4
"""Within the time of systemd's watchdog (sd_notify(3) asks for two): three may be missed."""
_WITHOUT_WATCHDOG_S: Final = 1.0
_SOCKET_S: Final = 0.5
"""How often the socket is looked for."""
_END_US: Final = 20_000_000
"""What systemd is asked for while a recorder is waited for, again and again; the unit's TimeoutStopSec."""
_LOG = logging.getLogger("pamrig")
Given = Mapping[str, Any]
"""A command's arguments by name, of the types that the protocol asks for."""


class Daemon:
    """One rig as a service. `serve` returns when it was told to end; the rig is safe then."""

    def __init__(self, parts: SessionParts, settings: DaemonSettings) -> None:
        """StateError when another daemon has the state folder: its queue and ledger are read here, and have one
        writer."""
        settings = settings.in_place()
        make_daemon_folder(settings.logs)
        self._state = StateFolder(settings.state)
        self._parts, self._settings = parts, settings
        self._owner = Owner.of(settings.state, parts.rig.name)
        self._monitor = SessionMonitor(parts, settings.force, str(self._owner))
        self._queue = Queue(self._state.file(settings.state / "queue.json"))
        self._operating = OperatingTime(self._state.file(settings.operating_time))
        self._ledger = Ledger(self._state.file(settings.ledger), self._operating.s)
        self._disks = DiskWork()
        self._retention = Retention(self._ledger, settings.retention, self._operating, self._disks)
        self._runner = QueueRunner(self._monitor, self._queue, parts.rig, settings, self._ledger, self._disks)
        self._checker = Planner(parts.rig)
        self._starting = StartHandler(self._monitor, self._queue, self._runner, self._checker)
        self._reports = FaultReports(self._monitor, settings.state / "blackbox", self._runner.hold, self._state.check)
        self._server = Server(self._handle, self.status, self._begin_estop)
        self._live = LiveView(settings.live.port)
        self._page = Page(settings.web, page_setup(parts, settings))
        self._armed_by = ""
        self._notifier = Notifier()
        # lives as long as the daemon: the loop is told when its maker's thread dies
        self._starter = ThreadPoolExecutor(1, "session")
        self._safe_mpa = parts.rig.safe.p1_mpa, parts.rig.safe.p2_mpa
        self._marks, self._resetting = MarkWriter(), False
        self._over = asyncio.Event()
        self._began = time.monotonic()
        self._tasks: list[asyncio.Task[None]] = []
        self._commands: dict[str, Callable[[Given], Awaitable[Any]]] = {
            "arm": self._arm,
            "start": self._start,
            "stop": self._stop,
            "estop": self._estop,
            "reset": self._reset,
            "mark": self._mark,
            "clear": self._clear,
        }

    async def serve(self) -> None:
        """Listen, start the session, work; until SIGTERM, SIGINT or `end`."""
        with contextlib.nullcontext() if self._parts.virtual else attention():
            try:
                await self._server.listen(self._settings.socket, self._settings.group)
                try:
                    await self._begin()
                    await self._over.wait()
                finally:
                    await self._finish()
            finally:
                self._state.close()

    def end(self) -> None:
        """Leave `serve`, without waiting for a rig that is still being opened."""
        self._over.set()
        self._monitor.give_up_opening()

    async def _begin(self) -> None:
        loop = asyncio.get_running_loop()
        for number in ending_signals():
            loop.add_signal_handler(number, self.end)
        if self._settings.view.port and self._settings.view.token_file:
            token = read_token(self._settings.view.token_file)
            port = await self._server.listen_for_viewers(self._settings.view.host, self._settings.view.port, token)
            _LOG.info("viewers may look at %s:%d", self._settings.view.host, port)
        await self._reports.salvage(self._owner)
        await aside(self._page.open)
        await loop.run_in_executor(self._starter, self._monitor.open)
        await self._show_live()
        self._tasks = [asyncio.create_task(planner.warm()) for planner in (self._checker, self._runner.planner)]
        self._tasks += [asyncio.create_task(work) for work in self._own_work()]
        for task in self._tasks:
            task.add_done_callback(self._task_ended)
        gc.collect()
        gc.freeze()  # what is there now stays: a full collection would walk through all of it, for tens of milliseconds
        self._notifier.say(READY=1, STATUS=self._monitor.state.name.lower())
        _LOG.info(
            "listening at %s, rig %s, %s", self._settings.socket, self._parts.rig.name, self._monitor.state.name.lower()
        )

    def _own_work(self) -> Iterator[Coroutine[Any, Any, None]]:
        yield from (self._turn(), self._runner.run(), self._house(), self._retention.run(), self._page.watch())
        yield from (self._live.watch(self._starter), self._stay_reachable(), self._runner.space.watch())

    def _task_ended(self, task: "asyncio.Task[None]") -> None:
        """A task of the daemon ends only at the end; otherwise it is a bug, and the rig is not to go on with it."""
        error = None if task.cancelled() else task.exception()
        if task.cancelled() and not self._over.is_set():
            error = RuntimeError(f"{task.get_coro()} was cancelled")
        if error is not None:
            _LOG.critical("error in the daemon itself, please report it: %r", error, exc_info=error)
            self._over.set()

    async def _finish(self) -> None:
        self._notifier.say(STOPPING=1)
        for task in self._tasks:
            task.cancel()
        self._monitor.begin_close()  # before anybody is waited for
        await in_any_case(*(aside(planner.close) for planner in (self._checker, self._runner.planner)))
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await in_any_case(aside(self._live.close), aside(self._page.close))
        left = await asyncio.get_running_loop().run_in_executor(self._starter, self._monitor.close, self._wait_on)
        lost = await self._reports.end(self._wait_on)
        late = await self._disks.end(self._keep_last, self._wait_on)
        await self._server.close()
        for executor in (self._starter, self._marks.executor):
            executor.shutdown()
        self._notifier.close()
        _LOG.info("ended; %s", "; ".join(filter(None, (left, lost, late))))

    def _keep_last(self) -> None:
        """What a disk that was full, or away, did not take before."""
        try:
            self._queue.save()
        except RigError as error:
            _LOG.error("%s; the next daemon knows the queue as it was kept last", error)
        self._retention.remember()

    def _wait_on(self, why: str) -> None:
        """Say what the end waits for; whoever told us to end is to wait too."""
        _LOG.warning("%s", why)
        self._notifier.say(EXTEND_TIMEOUT_USEC=_END_US, STATUS=why)

    async def _show_live(self) -> None:
        """The session that stands now; the process that showed the one before may take its time to end."""
        await asyncio.get_running_loop().run_in_executor(self._starter, self._live.follow, self._monitor.session)

    # its own clock

    async def _turn(self) -> None:
        """Many times a second: look after the session, report faults, feed the watchdog."""
        fed, beat_ns = 0.0, -1
        period_s = (self._notifier.watchdog_s or _WITHOUT_WATCHDOG_S) / _FEEDINGS
        while True:
            if not self._resetting:
                self._monitor.check()
                self._reports.look()
            session = self._monitor.session
            now, now_ns = (
                time.monotonic(),
                session.ring.heartbeat_ns if session is not None and not self._resetting else 0,
            )
            known = self._resetting or self._monitor.state is State.FAULT
            if now - fed >= period_s and (now_ns != beat_ns or known):
                # a loop that is alive, or a fault that is known and shown; a loop that hangs unseen is for systemd
                fed, beat_ns = now, now_ns
                self._notifier.say(WATCHDOG=1, STATUS=self._monitor.state.name.lower())
            await asyncio.sleep(_TURN_S)

    async def _house(self) -> None:
        """Metrics, out of the way of everything else."""
        while True:
            if self._settings.metrics is not None:
                with contextlib.suppress(OSError, RigError):
                    await self._disks.do(partial(metrics.write, self._settings.metrics, self.status(None)))
            await asyncio.sleep(_HOUSEKEEPING_S)

    async def _stay_reachable(self) -> None:
        """Somebody may clean up where the socket lies; who wants to stop the rig must find it. Or where the queue
        lies."""
        last_warned = ""
        while True:
            await asyncio.sleep(_SOCKET_S)
            try:
                found = "was removed, and is there again" if self._server.stay_reachable() else ""
            except RigError as error:
                found = f"was removed, and cannot be made anew: {error}"
            if found and found != last_warned:
                _LOG.warning("%s %s", self._settings.socket, found)
            last_warned = found
            if await aside_or_here(self._state.came_back):
                with contextlib.suppress(OSError):  # gone again
                    self._monitor.belong_to(str(Owner.of(self._settings.state, self._parts.rig.name)))
                await self._runner.keep()

    # commands

    async def _handle(self, request: ClientRequest) -> Any:
        name, given = request.command, request.arguments
        if name == "status":
            return self.status(None)
        _LOG.info("command %s %s", name, given or "")
        return await self._commands[name](given)

    async def _arm(self, given: Given) -> list[str]:
        check_line("arm: by", given.get("by", "-"))
        known = await self._monitor.arm()
        self._armed_by = given.get("by", "")
        return [*known, *self._of_before()]

    async def _start(self, given: Given) -> list[dict[str, Any]]:
        return await self._starting.start(
            given.get("sweeps", []), float(given.get("pause_s", 0.0)), given.get("before", "")
        )

    async def _estop(self, _: Given) -> dict[str, Any] | None:
        self._runner.hold()
        return safe_json(await self._monitor.estop(), self._safe_mpa)

    async def _clear(self, _: Given) -> dict[str, Any]:
        return {"cleared": await self._disks.do(self._queue.clear)}

    async def _mark(self, given: Given) -> dict[str, str]:
        """Into the log of the record that runs."""
        text = given.get("text", "")
        check_line("mark: text", text)
        session, record = self._monitor.session, self._runner.current
        if session is None or record is None:
            raise Refused(Code.WRONG_STATE, "no record runs; a marker goes into the log of the record that does")
        await self._marks.write(session, text)
        return {"record": record.name, "text": text}

    def _begin_estop(self) -> None:
        self._runner.hold()
        self._monitor.begin_estop()

    def _of_before(self) -> list[str]:
        """What the operator is to know before anything moves."""
        waits = self._runner.interrupted
        return [f"the queue holds {waits}; `pamrig start` goes on with it, `pamrig clear` drops it"] if waits else []

    async def _stop(self, given: Given) -> dict[str, str]:
        after_current = bool(given.get("after_current", False))
        running = self._monitor.state is State.RUNNING
        self._runner.hold()
        session = self._monitor.session
        if running and session is not None:
            if not after_current:
                session.mailbox.stop()
            return {"did": "stops after the record that runs" if after_current else "ramping down"}
        self._monitor.require(Event.DISARM)
        try:
            await self._monitor.disarm()
        except Refused:
            if session is None or self._monitor.state is not State.RUNNING:
                raise
            session.mailbox.stop()  # a record began while this was on its way
            return {"did": "ramping down"}
        return {"did": "disarmed"}

    def _refuse_beside_a_reset(self) -> None:
        if self._resetting:
            raise Refused(Code.WRONG_STATE, "a reset is under way")

    async def _reset(self, _: Given) -> dict[str, str]:
        self._refuse_beside_a_reset()
        self._monitor.require(Event.RESET)
        estops = self._monitor.estops
        self._runner.hold()
        await self._runner.idle()
        if self._monitor.needs_new_session or not await self._monitor.clear_fault(estops):
            self._refuse_beside_a_reset()  # that waited for the same record
            self._resetting = True
            try:
                await asyncio.get_running_loop().run_in_executor(self._starter, self._monitor.reopen, estops)
            finally:
                self._resetting = False
            await self._show_live()
        self._monitor.check()
        self._monitor.refuse_after_estop(estops)
        self._reports.tell_fault()
        if fault := self._monitor.fault:
            raise Refused(Code.REFUSED, f"the cause is not gone: {explain(fault, self._monitor.message)}")
        return {"state": self._monitor.state.name.lower()}

    def status(self, cursor: int | None) -> dict[str, Any]:
        """The whole status as plain data; with a `cursor`, also the samples since then and the next cursor."""
        monitor, session = self._monitor, self._monitor.session
        status: dict[str, Any] = {
            "version": PROTOCOL_VERSION,
            "rig": self._parts.rig.name,
            "period_s": self._parts.rig.period_ns / 1e9,
            CHANNELS: None if self._parts.rig.channels.has_valves else self._parts.rig.channels.plain(),
            "simulated": self._parts.simulated,
            "state": monitor.state.name.lower(),
            "fault": fault_json(monitor.fault, monitor.message),
            "fault_since_s": self._reports.since_s,
            "safe_state": safe_json(monitor.safe, self._safe_mpa),
            "session": f"{session.id:016x}" if session else None,
            "uptime_s": time.monotonic() - self._began,
            "loop": monitor.telemetry.to_json() if monitor.telemetry else None,
            **self._runner.to_json(),
            "processes": processes_json(session),
            "realtime": session.facts.get("realtime", {}) if session else {},
            "disk_free_gb": self._runner.space.gb,
            "logs": str(self._settings.logs),
            "retention": self._retention.to_json(),
            "clients": self._server.clients,
            "dropped_events": self._server.dropped_events,
            "page": self._page.to_json(),
            "armed_by": self._armed_by if monitor.state in _ARMED else None,
            "black_boxes": [str(path) for path in self._reports.black_boxes[-5:]],
        }
        if cursor is not None and monitor.telemetry:
            status["cursor"], status["samples"] = monitor.telemetry.columns(cursor)
        return status


_ARMED: Final = (State.ARMED, State.RUNNING, State.DONE)


@contextlib.contextmanager
def attention(session: Path = Path("/proc/self/autogroup")) -> Iterator[None]:
    """A better place in the scheduler; without the right to it the daemon goes on as it is.

    And the interpreter back soon from a thread of our own, such as one that writes a black box: an emergency stop needs
    it half a dozen times, and would wait 5 ms for it each time. Where the kernel shares time out by sessions, nice
    counts inside a session only (sched(7), autogroup): the place of the whole `session` is given back at the end, for a
    shell may live on in it.
    """
    sys.setswitchinterval(_SWITCH_S)
    former = None
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _NICE)
        # empty in the session of a machine's first process, as in some containers: it has no place to give back
        if place := session.read_text(encoding="ascii").split():
            former = place[-1]
            session.write_text(str(_NICE), encoding="ascii")
    try:
        yield
    finally:
        if former is not None:
            with contextlib.suppress(OSError):
                session.write_text(former, encoding="ascii")
