"""Who tells the loop what to do: an operator through a mailbox in shared memory, or a script known beforehand.

The loop polls; it never waits. Emergency stop and stop have words of their own, so that no other request can hide them.
"""

import time
from collections.abc import Sequence
from enum import IntEnum
from pathlib import Path
from typing import Final, Protocol, Self

from rig.realtime import closed_loop
from rig.realtime.faults import EXPLANATIONS, Fault
from rig.realtime.program import Program
from rig.realtime.shared import HEADER_WORDS, SharedBlock, folder
from rig.realtime.state import State
from rig.silence import Silence

CONTROL_PATIENCE_NS: Final = 1_000_000_000
"""So long the loop goes on without a beat of the process that commands it. Longer: a daemon that hangs is noticed
later, with the rig under way; shorter: one that a busy machine keeps from its processor is taken for lost."""


class Request(IntEnum):
    """What the loop can be asked for."""

    NONE = 0
    ARM = 1
    START = 2
    DISARM = 3
    RESET = 4
    QUIT = 5


_REQUESTS: Final = frozenset(Request)
# members by names of this module: looking one up in its class takes as long as a call
_RUNNING, _NO_FAULT = State.RUNNING, Fault.NONE
_NOTHING: Final = Request.NONE, None


class Answer(IntEnum):
    """What became of a request."""

    DONE = 1
    REFUSED = 2
    """It does not fit the state."""
    NOT_READY = 3
    """It fits the state, but not now: the cause of a fault is not gone, or a pressure is not known."""
    GONE = 4
    """The device was lost, by that fault or after it: only a new session opens it anew."""


class Commands(Protocol):
    """What the loop asks each tick."""

    def next(self, state: State, resting: bool) -> tuple[Request, Program | None]:
        """The request to act on now, with the program of a START; `resting`: the set-points have reached the safe
        pressures."""

    def answer(self, answer: Answer) -> None:
        """What became of the last request."""

    def stop_wanted(self) -> bool:
        """Ramp out now; stays true until the program has ended."""

    def estop_wanted(self) -> Fault:
        """The fault for which somebody wants the safe state at once; stays until withdrawn (NONE), and no reset works
        before."""

    def control_lost(self) -> bool:
        """The process that commands the loop promised to beat and has stopped beating."""


class Mailbox:
    """One process writes requests, the loop answers; a word each, so that nothing is ever half written."""

    _REQUEST, _ANSWER, _PROGRAM, _STOP, ESTOP, _CONTROL_BEAT = range(HEADER_WORDS, HEADER_WORDS + 6)

    def __init__(self, block: SharedBlock) -> None:
        self.block = block
        self._words = block.words
        self._seen = self._words[self._REQUEST]
        self._control = Silence(CONTROL_PATIENCE_NS)

    @classmethod
    def create(cls, name: str, session: int) -> Self:
        """A fresh mailbox without requests."""
        return cls(SharedBlock.create(name, session, 8 * 8))

    @classmethod
    def private(cls) -> Self:
        """A mailbox into which nobody posts."""
        return cls(SharedBlock.private(8 * 8))

    @classmethod
    def attach(cls, path: Path, session: int) -> Self:
        """The mailbox of another process."""
        return cls(SharedBlock.attach(path, session))

    # the operator's side

    def post(self, request: Request, run: int = 0) -> int:
        """Ask for something; returns the ticket to look for in `answered`."""
        self._words[self._PROGRAM] = run
        ticket = (self._words[self._REQUEST] >> 8) + 1
        self._words[self._REQUEST] = ticket << 8 | request
        return ticket

    def answered(self, ticket: int) -> Answer | None:
        """The loop's answer to a ticket, None while it has not come."""
        word = self._words[self._ANSWER]
        return Answer(word & 0xFF) if word >> 8 == ticket else None

    def stop(self, wanted: bool = True) -> None:
        """Ask for a ramp out; withdraw it before the next start."""
        self._words[self._STOP] = int(wanted)

    def estop(self, fault: Fault = Fault.ESTOP) -> None:
        """Ask for the safe state at once, and why; withdraw it by NONE when the rig may move again."""
        self._words[self.ESTOP] = int(fault)

    def beat(self) -> None:
        """Say that the commanding process is alive; once begun, it must go on at least each CONTROL_PATIENCE_NS."""
        self._words[self._CONTROL_BEAT] = time.monotonic_ns()

    # the loop's side

    def next(self, state: State, resting: bool) -> tuple[Request, Program | None]:
        """The newest request, once."""
        word = self._words[self._REQUEST]
        if word == self._seen:
            return _NOTHING
        self._seen = word
        request = Request(word & 0xFF) if word & 0xFF in _REQUESTS else Request.NONE
        if request is Request.START:
            return request, closed_loop.attach(
                program_path(self.block.session, self._words[self._PROGRAM]), self.block.session
            )
        return request, None

    def answer(self, answer: Answer) -> None:
        """Answer the newest request."""
        self._words[self._ANSWER] = self._seen >> 8 << 8 | answer

    def stop_wanted(self) -> bool:
        """The operator wants a ramp out."""
        return self._words[self._STOP] != 0

    def estop_wanted(self) -> Fault:
        """Why the safe state is wanted at once."""
        code = self._words[self.ESTOP]
        if not code:
            return _NO_FAULT
        return Fault(code) if code in EXPLANATIONS else Fault.ESTOP  # whatever it meant, it meant stop

    def control_lost(self) -> bool:
        """The operator's process has not beaten for CONTROL_PATIENCE_NS, and not because the machine stood still."""
        return self._control.too_long(self._words[self._CONTROL_BEAT])


class Script:
    """Arm, run every program in order, quit: decided by the states alone, hence the same on every run.

    Stop and emergency stop still come from the operator's mailbox.
    """

    def __init__(self, programs: Sequence[Program], mailbox: Mailbox) -> None:
        self._left = list(programs)
        self.stop_wanted, self.estop_wanted, self.control_lost = (
            mailbox.stop_wanted,
            mailbox.estop_wanted,
            mailbox.control_lost,
        )

    def next(self, state: State, resting: bool) -> tuple[Request, Program | None]:
        """The request that the state calls for."""
        if state is _RUNNING:
            return _NOTHING
        if state is State.FAULT or (self.stop_wanted() and resting):
            return Request.QUIT, None
        if state is State.DISARMED:
            return Request.ARM, None
        if state is State.ARMED or (state is State.DONE and resting):
            return (Request.START, self._left.pop(0)) if self._left else (Request.QUIT, None)
        return _NOTHING

    def answer(self, answer: Answer) -> None:
        """A script asks again instead of listening."""


def program_name(session: int, run: int) -> str:
    """Name of the block that holds the program of a run."""
    return f"{session:016x}-program-{run}"


def program_path(session: int, run: int) -> Path:
    """Path of the block that holds the program of a run."""
    return folder() / f"pamrig-{program_name(session, run)}"
