"""What the daemon asks of the loop: whether it fits the state, and the loop's answer within a tick."""

import asyncio
import time
from typing import Final

from rig.errors import RigError
from rig.realtime.commands import Answer, Request
from rig.realtime.faults import Fault
from rig.realtime.state import Event, State, after
from rig.service.connections.protocol import Code, Refused
from rig.service.session.refusals import UNFIT
from rig.service.session.session import Session

ANSWER_PATIENCE_S: Final = 1.0
"""For the loop to answer a request, which it does within a tick: beyond it, it hangs."""
SHOWN_S: Final = 0.05
"""For a loop that was made safe by itself to say so in a sample; one that is gone says nothing more."""
POLL_S: Final = 0.002
"""From one look at the answer to the next, s."""


async def ask(session: Session, request: Request, run: int = 0) -> Answer:
    """The loop's answer, once its state shows it; Refused when it gives none."""
    ticket = session.mailbox.post(request, run)
    deadline = time.monotonic() + ANSWER_PATIENCE_S
    while (answer := session.mailbox.answered(ticket)) is None:
        if time.monotonic() > deadline:
            raise Refused(
                Code.REFUSED, f"the loop did not answer {request.name.lower()} within {ANSWER_PATIENCE_S:g} s"
            )
        await asyncio.sleep(POLL_S)
    # the loop answers in the middle of the tick that does it, and tells its state at the end
    answered_at, deadline = session.ring.head, time.monotonic() + SHOWN_S
    while session.ring.head == answered_at and session.loop_alive and time.monotonic() < deadline:
        await asyncio.sleep(POLL_S)
    return answer


def while_faulted(what: str, fault: Fault) -> Refused:
    """What to answer to anything but a reset while a fault stands."""
    return Refused(Code.WRONG_STATE, f"cannot {what} while fault: {fault.name}; run `pamrig reset` first")


def require(event: Event, state: State, fault: Fault) -> None:
    """Refused, with what to do first, when `event` does not fit the state."""
    if state is State.FAULT and event is not Event.RESET:
        raise while_faulted(event.value, fault)
    if event is Event.RESET and state is not State.FAULT:
        raise Refused(Code.WRONG_STATE, f"nothing to reset: the rig is {state.name.lower()}, without a fault")
    try:
        after(state, event)
    except RigError as error:
        raise Refused(Code.WRONG_STATE, UNFIT.get((state, event), str(error))) from None
