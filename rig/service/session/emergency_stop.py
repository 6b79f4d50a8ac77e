"""An emergency stop as the daemon waits for it: by whoever is left of a session, or by this process where there is no
loop."""

import asyncio
import time
from typing import Final

from rig.realtime.safe_report import Outcome, SafeReport
from rig.realtime.safe_state import SecondPath, insist
from rig.service.aside import aside_or_here
from rig.service.connections.protocol import Code, Refused
from rig.service.session.asking import POLL_S
from rig.service.session.process_watch import ProcessWatch, is_final
from rig.service.session.refusals import BY_HAND

ESTOP_PATIENCE_S: Final = 3.0
"""Until an emergency stop that nobody could carry out is answered; the attempts go on after it."""
NOT_CARRIED_OUT: Final = "emergency stop not carried out"


async def carried_out(watch: ProcessWatch) -> SafeReport:
    """What came of a stop that was demanded of a session, followed up until somebody has carried it out; Refused when
    nobody has in time."""
    deadline = time.monotonic() + ESTOP_PATIENCE_S
    while not is_final(report := watch.answer):
        if time.monotonic() > deadline:
            if report.safe:
                break
            known = watch.safe
            before = "nobody could write the safe state anew; known from before: " if known.safe else ""
            raise Refused(Code.REFUSED, f"{NOT_CARRIED_OUT}: {before}{known.words}; {BY_HAND}")
        watch.follow_up()
        await asyncio.sleep(POLL_S)
    return report


async def written_here(path: SecondPath) -> Outcome:
    """What came of the safe state that this process writes, as long as there is no loop; RigError when the device does
    not take it. On threads of its own, for those that all share may wait for a disk."""
    outcome = await aside_or_here(lambda: insist(path, ESTOP_PATIENCE_S))
    if outcome < Outcome.WRITTEN:
        await aside_or_here(path.safe)  # for its words
    return outcome


def refuse_if_overruled(driver: str) -> None:
    """Refused when the safe state was written and another process, `driver` in words, writes its own set-points over
    it."""
    if driver:
        raise Refused(Code.REFUSED, f"{NOT_CARRIED_OUT}: {driver}; stop it there (Ctrl-C), or {BY_HAND}")
