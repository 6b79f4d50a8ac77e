"""The states of the rig as one table; the loop obeys it and the docs draw their diagram from it.

A fault is latched: only a reset leaves it, a reset needs its cause gone, and a reset does not arm.
"""

from enum import IntEnum, StrEnum
from typing import Final

from rig.errors import StateError


class State(IntEnum):
    """What the loop does with the outputs."""

    DISARMED = 0
    """Reads and records, writes nothing; the outputs hold what `safe` wrote."""
    ARMED = 1
    """Holds both set-points where it found the pressures; ready for a program."""
    RUNNING = 2
    """Follows a program."""
    DONE = 3
    """The program is over, the set-points ramp to the safe pressures and stay there."""
    FAULT = 4
    """Writes the safe state, each tick until the device has taken it, and then nothing until a reset."""


class Event(StrEnum):
    """What can happen to the rig."""

    ARM = "arm"
    START = "start"
    FINISH = "finish"
    DISARM = "disarm"
    FAULT = "fault"
    RESET = "reset"


TABLE: Final[dict[tuple[State, Event], State]] = {
    (State.DISARMED, Event.ARM): State.ARMED,
    (State.ARMED, Event.START): State.RUNNING,
    (State.RUNNING, Event.FINISH): State.DONE,
    (State.DONE, Event.START): State.RUNNING,
    (State.DONE, Event.ARM): State.ARMED,
    (State.ARMED, Event.DISARM): State.DISARMED,
    (State.DONE, Event.DISARM): State.DISARMED,
    (State.DISARMED, Event.FAULT): State.FAULT,
    (State.ARMED, Event.FAULT): State.FAULT,
    (State.RUNNING, Event.FAULT): State.FAULT,
    (State.DONE, Event.FAULT): State.FAULT,
    (State.FAULT, Event.FAULT): State.FAULT,
    (State.FAULT, Event.RESET): State.DISARMED,
}
"""(state, event) -> next state. What is not here is refused."""


def after(state: State, event: Event) -> State:
    """The state that follows; StateError, saying what is possible, when the event does not fit."""
    try:
        return TABLE[state, event]
    except KeyError:
        possible = ", ".join(e.value for s, e in TABLE if s is state and e is not Event.FAULT)
        raise StateError(f"cannot {event.value} while {state.name.lower()}; possible now: {possible}") from None
