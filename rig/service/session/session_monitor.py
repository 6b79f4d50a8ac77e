"""Keeps one session alive and knows what is wrong with it: the processes, the latched fault, the requests to the loop.

`check` must be called many times a second; it never blocks. Opening and closing a session does, and belongs on a thread
of its own.
"""

import asyncio
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import replace

from rig.errors import ConfigError, DeviceError, RigError
from rig.realtime import measures
from rig.realtime.commands import Answer, Request
from rig.realtime.faults import Fault
from rig.realtime.safe_report import Outcome, SafeReport, Writer
from rig.realtime.shared import KEPT_RING
from rig.realtime.state import Event, State
from rig.service.aside import aside_or_here
from rig.service.connections.protocol import Code, Refused
from rig.service.records.recorder_messages import RunResult, message_of
from rig.service.session.asking import POLL_S, SHOWN_S, ask, require, while_faulted
from rig.service.session.emergency_stop import NOT_CARRIED_OUT, carried_out, refuse_if_overruled, written_here
from rig.service.session.heir import Heir
from rig.service.session.last_resort import last_resort
from rig.service.session.left_unsafe import LeftUnsafe
from rig.service.session.operator_facts import facts_for_operator
from rig.service.session.process_watch import PathMaker
from rig.service.session.refusals import BY_HAND, NOT_OPEN, NOT_READY
from rig.service.session.session import Session
from rig.service.session.session_parts import SessionParts
from rig.service.session.telemetry import Telemetry

_LOG = logging.getLogger("pamrig")


class SessionMonitor:
    """One rig under the daemon."""

    def __init__(self, parts: SessionParts, force: bool = False, owner: str = "") -> None:
        """`owner` stands in the ring, which outlives a daemon that is killed."""
        self._parts, self._force, self._owner = parts, force, owner
        self.session: Session | None = None
        self._opening: Session | None = None
        """The session that comes to be."""
        self._left = LeftUnsafe(self._appoint)
        """By the session before, as long as there is no other."""
        self.telemetry: Telemetry | None = None
        self.results: dict[int, RunResult] = {}
        self._broken = Fault.NONE
        """A fault of the processes, which only a new session cures."""
        self._message = ""
        self.estops = 0
        """How often an emergency stop was asked for: a reset that began before one does not end after it."""
        self._busy = asyncio.Lock()

    # life of the session

    def open(self, estops: int = 0) -> None:
        """Start a session. A device that does not answer is a fault like any other: the daemon stays, and says so. One
        for whose opening less `estops` were known than have come begins stopped."""
        parts, session = self._parts, None
        self._left.pause()
        try:
            session = self._opening = Session(
                parts.loop, parts.rig, virtual=parts.virtual,
                watching=parts.watching, ring_suffix=KEPT_RING,
            )  # fmt: skip
            session.ring.owner = self._owner
            if session.swept:
                _LOG.info("%s", session.swept)
            if self.estops != estops:
                session.mailbox.estop(Fault.ESTOP)
            parts.driver()  # looks up the names of the wires, here on a thread of its own
            session.open()
            session.go()
        except (RigError, OSError) as error:  # OSError: the machine gives no process, descriptor or memory
            if session is not None:
                session.close()
                self._left.take(session)
            if isinstance(error, DeviceError):
                self._left.doubt()
            fault = Fault.DEVICE_LOST if isinstance(error, DeviceError | ConfigError) else Fault.LOOP_DIED
            no_room = f"this machine gives no process, descriptor or memory for it: {getattr(error, 'strerror', error)}"
            self._break(fault, no_room if isinstance(error, OSError) else str(error))
            self._left.begin(self._second_path, parts.driver)
        else:
            left, self._left = self._left, LeftUnsafe(self._appoint)
            left.pause()  # an emergency stop may have begun to try on, beside this
            self.session, self.telemetry = session, Telemetry(session.ring)
            self._broken, self._message = Fault.NONE, ""
            left.end()  # now that the loop, which goes already, hears of this process
        finally:
            self._opening = None

    def _appoint(self) -> Heir | None:
        watching = self._parts.watching
        return watching.heir() if watching is not None and watching.heir is not None else None

    @property
    def _second_path(self) -> PathMaker | None:
        """This process's own way to the device; None where the plant ends with the loop's process."""
        return self._parts.watching.second_path if self._parts.watching is not None else None

    def belong_to(self, owner: str) -> None:
        """Another owner for the session that stands, or comes to be, and for those after it."""
        self._owner = owner
        for session in (self._opening, self.session):
            if session is not None:
                session.ring.owner = owner

    def begin_close(self) -> None:
        """Let the loop leave through the safe state, without waiting for it; `close` does the rest."""
        if self.session is not None:
            self.session.dismiss_loop()

    def give_up_opening(self) -> None:
        """Let the loop of a session that comes to be end: nobody waits for it any more."""
        if (coming := self._opening) is not None:
            coming.dismiss_loop()

    def close(self, say: Callable[[str], None] = _LOG.warning, *, again: bool = False) -> str:
        """End the session through the safe state; returns what became of the rig. `say` gets a line every few seconds
        while the recorder is waited for, the log what is lost of records. `again`: another is to be opened."""
        session, self.session = self.session, None
        if session is None:
            return self._left.end() or "the rig was not open, and nothing was written to it"
        self._left.begin_with(session)  # what is known until it has ended
        left = session.close(say, self._left.insist if again else None)
        self._left.take(session)
        self.results |= {result.run: result for result in left}
        for result in left:
            if result.error:
                _LOG.error("%s: %s", result.file, result.error)
        return session.end.words

    def reopen(self, estops: int) -> None:
        """A new session for one that is broken; `estops` as they were when it was asked for. The fault stands until
        then, also that of a loop which has gone."""
        self._break(self.fault, self.message)
        if self.session is not None:
            self.close(again=True)
        self.telemetry = None
        self.open(estops)

    # what is wrong

    @property
    def fault(self) -> Fault:
        """The fault that stands; the first cause, not what followed from it."""
        first = self.telemetry.first_fault if self.telemetry else None
        if first is not None and first.fault:
            return Fault(first.fault)
        return self._broken

    @property
    def message(self) -> str:
        """What is known of the fault beside its cause."""
        session = self.session
        if session is None:
            return self._message
        ended = session.watch.how_it_ended() if session.watch is not None and not session.loop_alive else ""
        own = self._message or message_of(self.fault, session.ring)
        return "; ".join(part for part in (own, ended, self._elsewhere()) if part)

    @property
    def safe(self) -> SafeReport | None:
        """What is known of the safe state; None while the loop commands, and before there is a rig."""
        watch = self.session.watch if self.session is not None else None
        report = watch.safe if watch is not None else self._left.report
        if not report.writer and self.state is not State.FAULT:
            return None
        if self._elsewhere():
            return replace(report, outcome=Outcome.OVERRULED)
        unopened = not report.writer and self.session is None and self._second_path is not None
        return replace(report, outcome=Outcome.UNOPENED) if unopened else report

    def _elsewhere(self) -> str:
        """Which other process drives the rig while we have no loop; empty when none does."""
        return "" if self.session is not None and self.session.loop_alive else self._parts.driver()

    @property
    def state(self) -> State:
        """State of the rig as far as anybody knows it."""
        if self._broken or self.telemetry is None:
            return State.FAULT if self._broken else State.DISARMED
        return self.telemetry.state

    def check(self) -> None:
        """Beat, read the ring, look after the processes."""
        session = self.session
        if session is None or self.telemetry is None:
            return
        session.beat()
        self.telemetry.update()
        self.results |= {result.run: result for result in session.recording.results()}
        loss = session.watch.look() if session.watch is not None else None
        if loss is not None and not self._broken:
            self._break(loss.fault, loss.message or session.loop_error())
        if self._broken and not session.loop_alive:
            session.end_recording()

    def _break(self, fault: Fault, message: str) -> None:
        self._broken, self._message = fault, message

    # requests

    async def request(self, request: Request, run: int = 0) -> Answer:
        """Ask the loop; Refused when it does not fit the state, or not now. DONE, or GONE."""
        async with self._busy:
            session = self.session
            if session is None or self._broken:
                raise while_faulted(request.name.lower(), self.fault)
            answer = await ask(session, request, run)
        if self.telemetry is not None:
            self.telemetry.update()
        if answer is Answer.REFUSED:
            raise Refused(Code.WRONG_STATE, f"the loop refused {request.name.lower()} while {self.state.name.lower()}")
        if answer is Answer.NOT_READY:
            raise Refused(Code.REFUSED, NOT_READY.get(request, "not now"))
        return answer

    async def arm(self) -> list[str]:
        """ARM, when the machine keeps time or nothing real moves. Returns what the operator should know, a line
        each."""
        self.require(Event.ARM)
        if self.session is None:  # the socket listens before the rig is open
            raise Refused(Code.REFUSED, NOT_OPEN)
        what = measures.denied(self.session.facts["realtime"])
        if what and not self._parts.simulated and not self._force:
            raise Refused(
                Code.REFUSED,
                f"real-time measures not granted ({what}); see docs/how-to/install_service.md, or set force: true",
            )
        known = [*self._parts.warnings(), *self._of_the_device(self.session.facts["device"])]
        self.session.mailbox.stop(False)
        await self.request(Request.ARM)
        return known

    def _of_the_device(self, facts: Mapping[str, str]) -> list[str]:
        """Pace, fail-safe and warnings, and what would be left without us; Refused when that takes too long."""
        facts_lines = [f"{key}: {text}" for key, text in facts_for_operator(facts).items()]
        if self._parts.simulated:
            return facts_lines
        left = last_resort(self._parts.rig, facts)
        if left.problems and not self._force:
            raise Refused(Code.REFUSED, f"{left.problems[0]}; shorten it, or set force: true in the daemon's settings")
        return [*facts_lines, *left.problems, *left.lines]

    async def disarm(self) -> None:
        """Let go of the rig: the safe set-points stay."""
        await self.request(Request.DISARM)

    def require(self, event: Event) -> None:
        """Refused, with what to do first, when `event` does not fit the state."""
        require(event, self.state, self.fault)

    def begin_estop(self) -> None:
        """Demand the safe state, without waiting to see it; `estop` does the rest. A loop that is only being started
        finds the demand when it begins to tick."""
        self.estops += 1
        if self.session is not None and self.session.watch is not None:
            self.session.watch.demand(Fault.ESTOP)
        elif (coming := self._opening) is not None:
            coming.mailbox.estop(Fault.ESTOP)

    async def estop(self) -> SafeReport:
        """Safe state at once, by whoever is left to write it; Refused when the device has not taken it."""
        watch = self.session.watch if self.session is not None else None
        self.begin_estop()
        if watch is None:
            return await self._write_alone()
        report = await carried_out(watch)
        await self._see_the_stop()
        refuse_if_overruled(self._elsewhere())
        return report

    async def _see_the_stop(self) -> None:
        """Whoever is answered and asks on is to find the fault, which the loop tells at the end of the tick that made
        safe."""
        deadline = time.monotonic() + SHOWN_S
        while self.telemetry is not None and time.monotonic() < deadline:
            self.telemetry.update()
            if self.state is State.FAULT:
                return
            await asyncio.sleep(POLL_S)

    async def _write_alone(self) -> SafeReport:
        """The safe state by this process; a device that does not take it is tried on."""
        make = self._second_path
        if make is None:
            return SafeReport(Writer.CONTROL, outcome=Outcome.ENDED)
        path = await aside_or_here(make)
        try:
            outcome = await written_here(path)
        except RigError as error:
            tried_on = self._try_on()
            raise Refused(
                Code.REFUSED, f"{NOT_CARRIED_OUT}: there is no loop, and {error}; {BY_HAND}{tried_on}"
            ) from None
        finally:
            await aside_or_here(path.close)
        refuse_if_overruled(self._elsewhere())
        return self._left.tell(outcome)

    def _try_on(self) -> str:
        """Go on with an emergency stop that the device did not take, where no session does; returns that, for the end
        of a line."""
        if self.session is not None or self._opening is not None:
            return ""  # it finds the demand
        self._left.owe()
        self._left.begin(self._second_path, self._parts.driver)
        return ". The safe state is written as soon as the device is back, or until a reset: keep clear of the joint"

    @property
    def needs_new_session(self) -> bool:
        """A reset has to open the device anew."""
        return self.session is None or bool(self._broken) or self.fault is Fault.DEVICE_LOST

    def refuse_after_estop(self, estops: int) -> None:
        """Refused when an emergency stop has come since there had been so many."""
        if self.estops != estops:
            raise Refused(Code.REFUSED, "an emergency stop came while this reset was under way; reset once more")

    async def clear_fault(self, estops: int) -> bool:
        """RESET of a session that is whole; False: its device was lost after the fault, as by the switch that somebody
        turned then, and has to be opened anew. Refused without a session, and when more `estops` have come since it was
        asked for."""
        if self.session is None:  # it was lost, or is being opened, since the caller looked
            raise Refused(Code.REFUSED, NOT_OPEN)
        self.refuse_after_estop(estops)
        if self.session.watch is not None:
            self.session.watch.withdraw()
        self.session.mailbox.stop(False)
        if await self.request(Request.RESET) is Answer.GONE:
            return False
        self._message = ""
        return True
