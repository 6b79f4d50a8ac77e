"""A rig that was left under pressure, or somebody asked to be made safe, and whose device could not be opened: there is
no session, and it is tried on until the device has taken the safe state."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from rig.errors import RigError
from rig.realtime.safe_report import Outcome, SafeReport, Writer
from rig.realtime.safe_state import SecondPath, write_and_look
from rig.service.aside import NoThread, ReadyThread
from rig.service.session.heir import Heir
from rig.service.session.session import Session

_AGAIN_S: Final = 0.1
"""Between two attempts, each of which connects anew."""
_LET_GO_S: Final = 3.0
"""For the attempt that is under way: to connect, to write, and to look, a second each at most."""
_POLL_S: Final = 0.01
"""Between two looks whether that attempt is over."""
_LOG = logging.getLogger("pamrig")


class LeftUnsafe:
    """What the session before left. `begin` when there is no other, `end` before there is one."""

    def __init__(self, appoint: Callable[[], Heir | None] = lambda: None) -> None:
        """`appoint` an heir, who goes on where this process is killed or stopped; None: nothing outlives it."""
        self.report = SafeReport()
        """What is known of the safe state since then."""
        self.owed = False
        """The loop of that session had ticked, and the device did not take the safe state."""
        self._ended = threading.Event()
        self._hands: ReadyThread | None = None
        self._appoint = appoint
        self._heir: Heir | None = None
        self._appointing, self._over = threading.Lock(), False

    def begin_with(self, session: Session) -> None:
        """That session is being closed, by whoever has told of the rig so far."""
        if session.watch is not None:
            self.report = session.watch.safe

    def take(self, session: Session) -> None:
        """That session has been closed."""
        if session.end.ticked:
            self.report, self.owed = session.end.report, session.end.unsafe

    def doubt(self) -> None:
        """The device, which the session before left safe, does not answer: what stands there now is not known."""
        if self.report.outcome in (Outcome.WRITTEN, Outcome.SEEN):
            self.report, self.owed = replace(self.report, outcome=Outcome.DOUBTED), True

    def owe(self) -> None:
        """Somebody has asked for the safe state, and the device did not take it."""
        self.owed = True
        self.tell(Outcome.FAILED)

    def begin(self, make: Callable[[], SecondPath] | None, driver: Callable[[], str]) -> None:
        """Try on, from a thread of its own, where that is owed; not while another process drives the rig by `driver`.
        Without a way to the device, by `make`, nothing is left under pressure."""
        if make is None or not self.owed:
            return
        try:
            self._hands = self._hands or ReadyThread()
        except NoThread as error:
            _LOG.error("nobody goes on to make the rig safe: %s; `pamrig estop` tries once more", error)
            return
        self._ended.clear()
        self._hands.begin(lambda: self._try_on(make, driver))  # after one that may just be coming to its end

    def _try_on(self, make: Callable[[], SecondPath], driver: Callable[[], str]) -> None:
        path = make()
        self.bequeath()  # of an emergency stop without a session, and of what was safe before
        try:
            while self.owed and not self._ended.is_set():
                if not driver():
                    self.tell(write_and_look(path))
                if self.owed and (heir := self._heir) is not None and not heir.alive:
                    self.bequeath()  # he was lost before this process, which may be as well
                self._ended.wait(_AGAIN_S)
            if not self.owed and self._heir is not None:
                self._heir.release()
        finally:
            path.close()

    def tell(self, outcome: Outcome) -> SafeReport:
        """What this process has come to."""
        written_ns = time.monotonic_ns() if outcome >= Outcome.WRITTEN else 0
        seen_ns = written_ns if outcome is Outcome.SEEN else 0
        self.report = SafeReport(Writer.CONTROL, outcome=outcome, written_ns=written_ns, confirmed_ns=seen_ns)
        self.owed = self.owed and not self.report.safe
        return self.report

    def insist(self, _: Callable[[], bool], attempt: Callable[[], None]) -> str:
        """For a session that is closed before another is opened (`Insistence`): see that somebody insists on its safe
        state without this process, and add nothing to what is told of the rig."""
        self.bequeath(attempt)
        return ""

    def bequeath(self, meanwhile: Callable[[], None] | None = None) -> None:
        """See that somebody goes on without this process. `meanwhile` is called ten times a second until he is ready;
        None: he is not waited for."""
        with self._appointing:
            former = self._heir
            if self._over or (former is not None and former.alive):
                return
            self._heir = None
            try:
                if former is not None:
                    former.end()
                self._heir = self._appoint()
                if meanwhile is not None and self._heir is not None:
                    self._heir.await_ready(meanwhile)
            except (RigError, OSError) as error:
                _LOG.error("nobody would go on to make the rig safe without this process: %s", error)

    def end(self) -> str:
        """Try no more, and nobody else; returns what became of the rig, in words, and nothing where no session has left
        it so."""
        self.pause()
        with self._appointing:  # one who is just being appointed would stay behind
            self._over, heir, self._heir = True, self._heir, None
        if heir is not None:
            heir.end()
        return self.report.words if self.report.writer else ""

    def pause(self) -> None:
        """Try no more for now: the rig is being opened. Who would go on without this process stays."""
        self._ended.set()
        hands, self._hands = self._hands, None
        if hands is not None:
            hands.end()
            deadline = time.monotonic() + _LET_GO_S
            while hands.busy and time.monotonic() < deadline:
                time.sleep(_POLL_S)
        if (heir := self._heir) is not None:
            heir.await_quiet()
