"""Keeps one session alive and knows what is wrong with it: the processes, the latched fault, the requests to the loop.

`check` must be called many times a second; it never blocks. Opening and closing a session does, and belongs on a thread of its own.
"""

import asyncio
import contextlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from rig.errors import ConfigError, DeviceError, DeviceLost, RigError
from rig.realtime import measures
from rig.realtime.commands import Answer, Request
from rig.realtime.faults import Fault
from rig.realtime.shared import KEPT_RING
from rig.realtime.state import Event, State, after
from rig.realtime.supervisor import Verdict
from rig.rig_config import RigConfig
from rig.service.protocol import Code, Refused
from rig.service.recorder import RunResult, said_of
from rig.service.session import LoopEntry, Session, SupervisorEntry, spoken
from rig.service.telemetry import Telemetry

ANSWER_PATIENCE_S: Final = 1.0
SUPERVISOR_PATIENCE_S: Final = 0.3
STOPPED_PATIENCE_S: Final = 0.2
"""For a recorder that somebody stopped."""
LOOP_PATIENCE_S: Final = 0.5
"""Only without a supervisor, who looks much sooner."""
_ANSWER_POLL_S: Final = 0.002


@dataclass(frozen=True)
class Parts:
    """What the roof gives: the rig, and how its processes are made."""

    rig: RigConfig
    loop: LoopEntry
    supervisor: SupervisorEntry | None
    safe: Callable[[], None]
    """Write the safe state from this process; the last resort when nobody else is left. May raise DeviceError."""
    simulated: bool
    virtual: bool = False
    seed: int | None = None
    warnings: Callable[[], list[str]] = list
    """What is to be said of the rig's calibrations today."""
    options: Mapping[str, Any] = field(default_factory=dict)


class Keeper:
    """One rig under the daemon."""

    def __init__(self, parts: Parts, force: bool = False) -> None:
        self._parts, self._force = parts, force
        self.session: Session | None = None
        self.telemetry: Telemetry | None = None
        self.results: dict[int, RunResult] = {}
        self._broken = Fault.NONE
        """A fault of the processes, which only a new session cures."""
        self._said = ""
        self._recorder_seen = (0, 0.0)
        self._busy = asyncio.Lock()

    # life of the session

    def open(self) -> None:
        """Start a session. A device that does not answer is a fault like any other: the daemon stays, and says so."""
        parts = self._parts
        session = Session(
            parts.loop, parts.rig, virtual=parts.virtual, seed=parts.seed, options=parts.options,
            supervisor=parts.supervisor, ring_suffix=KEPT_RING,
        )  # fmt: skip
        try:
            session.open()
            session.go()
        except RigError as error:
            session.close()
            fault = Fault.DEVICE_LOST if isinstance(error, DeviceError | ConfigError) else Fault.LOOP_DIED
            self._break(fault, str(error))
            return
        self._recorder_seen = (0, time.monotonic())
        self.session, self.telemetry = session, Telemetry(session.ring)
        self._broken, self._said = Fault.NONE, ""

    def close(self) -> str:
        """End the session through the safe state; returns what became of the rig, in words."""
        session, self.session = self.session, None
        if session is None:
            return "the rig was not open, and nothing was written to it"
        self.results |= {result.run: result for result in session.close()}
        session.ring.block.close()
        if session.loop is not None and session.loop.exitcode and not session.supervision.report().safe_ns:
            return "nobody could write the safe state: its own watchdog has to make the device safe, or you"
        return "the rig is in its safe state"

    def reopen(self) -> None:
        """A new session for one that is broken."""
        self.close()
        self.telemetry = None
        self.open()

    # what is wrong

    @property
    def fault(self) -> Fault:
        """The fault that stands; the first cause, not what followed from it."""
        first = self.telemetry.first_fault if self.telemetry else None
        if first is not None and first.fault:
            return Fault(first.fault)
        return self._broken

    @property
    def said(self) -> str:
        """What is known of the fault beside its cause."""
        return self._said or ("" if self.session is None else said_of(self.fault, self.session.ring))

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
        self.results |= {result.run: result for result in session.results()}
        if self._broken:
            return
        if not session.loop_alive:
            self._break(Fault.LOOP_DIED, self._last_words(session))
            session.end_recording()
        elif not session.recorder_alive:
            self._stop_because(session, Fault.RECORDER_DIED, "the recorder's process is gone")
        elif why := self._recorder_stands(session):
            self._stop_because(session, Fault.RECORDER_DIED, why)
        elif self._parts.supervisor is not None and (why := _supervisor_gone(session)):
            self._stop_because(session, Fault.SUPERVISOR_DIED, why)

    def _break(self, fault: Fault, said: str) -> None:
        self._broken, self._said = fault, said

    def _stop_because(self, session: Session, fault: Fault, said: str) -> None:
        """A process is lost that the rig must not run without: safe state, by the loop if it can."""
        self._break(fault, said)
        session.mailbox.estop(fault)
        silent_ns = time.monotonic_ns() - session.ring.heartbeat_ns
        if fault is Fault.SUPERVISOR_DIED and silent_ns > LOOP_PATIENCE_S * 1e9 and session.loop is not None:
            session.loop.kill()  # nobody else is left who would
            with contextlib.suppress(DeviceError):
                self._parts.safe()

    def _recorder_stands(self, session: Session) -> str:
        """Why the recorder, which does not take what there is to read, is given up; empty while it is not.

        One that waits for a slow disk loses nothing as long as the ring has room; one that somebody stopped is not coming back.
        """
        ring, now = session.ring, time.monotonic()
        cursor, since = self._recorder_seen
        if ring.recorded != cursor or ring.head == ring.recorded:
            self._recorder_seen = (ring.recorded, now)
            return ""
        patience_s = ring.capacity / 2 * self._parts.rig.period_ns / 1e9
        if now - since > patience_s:
            return f"the recorder has not moved for {patience_s:.0f} s: the disk does not keep up, or it hangs"
        pid = session.recorder.pid if session.recorder is not None else None
        return "the recorder was stopped by a signal" if now - since > STOPPED_PATIENCE_S and _is_stopped(pid) else ""

    def _last_words(self, session: Session) -> str:
        """How the loop's process ended, and what the supervisor did about it."""
        error = session.loop_error()
        code = session.loop.exitcode if session.loop is not None else None
        how = error or (f"killed by signal {-code}" if code is not None and code < 0 else f"exit status {code}")
        report = session.supervision.report()
        if report.verdict is Verdict.WATCHING:
            return how
        if report.failed:
            return f"{how}; the supervisor could not reach the device: its own watchdog has to make it safe"
        seen_ms = (report.seen_ns - report.last_beat_ns) / 1e6
        what = "hung or was stopped" if report.verdict is Verdict.SILENT else "ended"
        safe_ms = (report.safe_ns - report.seen_ns) / 1e6
        return f"{how}; it {what}: seen {seen_ms:.1f} ms after its last heartbeat, safe {safe_ms:.1f} ms later"

    # requests

    async def request(self, request: Request, run: int = 0) -> None:
        """Ask the loop; Refused when it does not fit the state, or not now."""
        async with self._busy:
            session = self.session
            if session is None or self._broken:
                raise Refused(
                    Code.WRONG_STATE, f"cannot {request.name.lower()} while fault: {self.fault.name}; run `pamrig reset` first"
                )
            ticket = session.mailbox.post(request, run)
            deadline = time.monotonic() + ANSWER_PATIENCE_S
            while (answer := session.mailbox.answered(ticket)) is None:
                if time.monotonic() > deadline:
                    raise Refused(Code.REFUSED, f"the loop did not answer {request.name.lower()} within {ANSWER_PATIENCE_S:g} s")
                await asyncio.sleep(_ANSWER_POLL_S)
        if self.telemetry is not None:
            self.telemetry.update()
        if answer is Answer.REFUSED:
            raise Refused(Code.WRONG_STATE, f"the loop refused {request.name.lower()} while {self.state.name.lower()}")
        if answer is Answer.NOT_READY:
            raise Refused(Code.REFUSED, _NOT_READY.get(request, "not now"))

    async def arm(self) -> list[str]:
        """ARM, when the machine keeps time or nothing real moves. Returns what the operator should know, a line each."""
        self.must(Event.ARM)
        if self.session is None:  # the socket listens before the rig is open
            raise Refused(Code.REFUSED, _NOT_OPEN)
        missing = measures.denied(self.session.facts["realtime"])
        if missing and not self._parts.simulated and not self._force:
            what = "; ".join(f"{name} {self.session.facts['realtime'][name]}" for name in missing)
            raise Refused(
                Code.REFUSED, f"real-time measures not granted ({what}); see docs/how-to/install_service.md, or set force: true"
            )
        self.session.mailbox.stop(False)
        device = spoken(self.session.facts["device"])
        known = [*self._parts.warnings(), *(f"{key}: {said}" for key, said in device.items())]
        await self.request(Request.ARM)
        return known

    async def disarm(self) -> None:
        """Let go of the rig: the safe set-points stay."""
        await self.request(Request.DISARM)

    def must(self, event: Event) -> None:
        """Refused, with what to do first, when `event` does not fit the state."""
        state = self.state
        if state is State.FAULT and event is not Event.RESET:
            raise Refused(Code.WRONG_STATE, f"cannot {event.value} while fault: {self.fault.name}; run `pamrig reset` first")
        if event is Event.RESET and state is not State.FAULT:
            raise Refused(Code.WRONG_STATE, f"nothing to reset: the rig is {state.name.lower()}, without a fault")
        try:
            after(state, event)
        except RigError as error:
            raise Refused(Code.WRONG_STATE, _UNFIT.get((state, event), str(error))) from None

    def estop(self) -> None:
        """Safe state at once, whoever is left to write it."""
        session = self.session
        if session is not None and session.loop_alive:
            session.mailbox.estop()
            return
        try:
            self._parts.safe()
        except DeviceLost as error:
            raise Refused(Code.REFUSED, f"there is no loop, and the device cannot be reached: {error}") from None

    @property
    def needs_new_session(self) -> bool:
        """A reset has to open the device anew."""
        return self.session is None or bool(self._broken) or self.fault is Fault.DEVICE_LOST

    async def clear_fault(self) -> None:
        """RESET of a session that is whole; Refused without one."""
        if self.session is None:  # it was lost, or is being opened, since the caller looked
            raise Refused(Code.REFUSED, _NOT_OPEN)
        self.session.mailbox.estop(Fault.NONE)
        self.session.mailbox.stop(False)
        await self.request(Request.RESET)
        self._said = ""


_UNFIT: Final = {
    (State.DISARMED, Event.START): "cannot start while disarmed; run `pamrig arm` first",
    (State.DISARMED, Event.DISARM): "nothing to stop: nothing runs, and the rig is disarmed",
    (State.ARMED, Event.ARM): "armed already; `pamrig start` begins, `pamrig stop` disarms",
    (State.RUNNING, Event.ARM): "armed already, and running; `pamrig stop` ramps down",
}
"""What to say of a command that does not fit, in the operator's words instead of the table's."""
_NOT_OPEN: Final = "the rig is still being opened; try again in a second"
_NOT_READY: Final = {
    Request.ARM: "cannot arm: the pressures are not known (read error, broken wire, implausible value); see `pamrig watch`",
    Request.RESET: "the cause is not gone yet (read error, broken wire, or the safe state is not written); see `pamrig watch`",
}


def _is_stopped(pid: int | None) -> bool:
    """The process is in the state T of proc(5)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] in ("T", "t")
    except OSError:
        return False


def _supervisor_gone(session: Session) -> str:
    """Why the supervisor cannot be relied on; empty when it can."""
    if session.supervisor is None or not session.supervisor.is_alive():
        return "the supervisor's process is gone"
    silent_s = (time.monotonic_ns() - session.supervision.beat_ns) / 1e9
    if session.supervision.beat_ns and silent_s > SUPERVISOR_PATIENCE_S:
        return f"the supervisor has not moved for {silent_s:.1f} s"
    return ""
