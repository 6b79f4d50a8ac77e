"""Markers that somebody puts into the log of the record that runs, as many at a time as its recorder keeps up with."""

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Final

from rig.service.connections.protocol import Code, Refused
from rig.service.records.recorder_messages import Mark
from rig.service.session.session import Session

MOST_MARKS: Final = 8
"""That wait for the recorder at a time: on a disk that stands still no more are taken."""


class MarkWriter:
    """Hands markers to recorders, from a thread of its own: who waits for a disk with the marks of many takes no thread
    from the end of the daemon."""

    def __init__(self) -> None:
        self.executor = ThreadPoolExecutor(1, "marks")
        self._waiting = 0

    async def write(self, session: Session, text: str) -> None:
        """One line into the log of the session's record; Refused when too many wait."""
        if self._waiting >= MOST_MARKS:
            raise Refused(Code.REFUSED, "the recorder does not keep up with the marks; try again")
        self._waiting += 1
        try:
            mark = Mark(text, time.monotonic_ns())
            await asyncio.get_running_loop().run_in_executor(self.executor, session.recording.expect, mark)
        finally:
            self._waiting -= 1
