"""What is told of a fault: lines in the log as more becomes known, and the black box."""

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from rig.errors import RigError
from rig.realtime.faults import Fault, explain
from rig.realtime.safe_report import Outcome
from rig.realtime.state import State
from rig.service.aside import END_S, aside
from rig.service.records import blackbox
from rig.service.session.session_monitor import SessionMonitor

REPORT_AGAIN_S: Final = 5.0
"""Until a black box is tried again that the disk did not take."""
MOST_WAITING: Final = 8
"""Black boxes that wait for the disk at a time: each is 1.5 MB of memory."""
_LOG = logging.getLogger("pamrig")


class FaultReports:
    """Looks at the session's fault and safe state, and tells each change once."""

    def __init__(
        self, monitor: SessionMonitor, folder: Path, hold: Callable[[], None], check: Callable[[], None] = lambda: None
    ) -> None:
        """Black boxes go into `folder`, which is asked for by `check` before each; `hold` is called for every new
        fault, before it is told."""
        self._monitor, self._folder, self._hold, self._check = monitor, folder, hold, check
        self._fault, self._since_s = Fault.NONE, 0.0
        self._safe_words = ""
        self.black_boxes: list[Path] = []
        self.tasks: list[asyncio.Task[None]] = []
        """Black boxes that are being written, each by the name of its fault."""
        self._ending = asyncio.Event()
        self._lost: list[str] = []

    @property
    def since_s(self) -> float | None:
        """For how long there has been a fault; None without one."""
        return time.monotonic() - self._since_s if self._monitor.fault and self._fault else None

    def look(self) -> None:
        """Tell what has changed."""
        self.tell_fault()
        self._tell_safe()

    def tell_fault(self) -> None:
        """A new fault, or that it was cleared."""
        fault = self._monitor.fault
        if fault is self._fault:
            return
        self._fault, self._since_s = fault, time.monotonic()
        if fault is Fault.NONE:
            _LOG.info("fault cleared")
            return
        self._hold()
        _LOG.error("%s", explain(fault, self._monitor.message))
        self.tasks.append(asyncio.create_task(self._save_black_box(fault), name=fault.name))

    def _tell_safe(self) -> None:
        """During a fault, each time that more is known of the safe state."""
        report = self._monitor.safe if self._monitor.state is State.FAULT else None
        if report is None or report.outcome is Outcome.UNKNOWN:
            self._safe_words = ""
        elif report.words != self._safe_words:
            self._safe_words = report.words
            _LOG.log(logging.WARNING if report.safe else logging.ERROR, "%s", report.words)

    async def _save_black_box(self, fault: Fault) -> None:
        session = self._monitor.session
        if session is None:
            return
        message = self._monitor.message
        box: blackbox.Box | None = None
        last_error = ""
        while True:
            last = self._ending.is_set()
            try:
                if box is None:
                    box = await aside(lambda: blackbox.take(session.ring, fault, message))
                saved = await aside(partial(self._write, box))
            except RigError as error:
                if last:
                    self._lose(fault.name, str(error))
                    return
                if str(error) != last_error:
                    last_error = str(error)
                    _LOG.error("the black box could not be written, and is tried again: %s", last_error)
                if sum(not task.done() for task in self.tasks) > MOST_WAITING:
                    _LOG.error("the black box of %s is lost: so many wait already", fault.name)
                    return
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._ending.wait(), REPORT_AGAIN_S)
            else:
                self._keep(saved, explain(fault))
                return

    def _write(self, box: blackbox.Box) -> Path:
        self._check()
        return box.write(self._folder)

    async def end(self, say: Callable[[str], None], patience_s: float = END_S) -> str:
        """Try once more what still waits for the disk, which `say` gets a line of, and give it so long; returns what is
        lost then, in words. For the end of the daemon, when the rig is safe."""
        waiting = [task for task in self.tasks if not task.done()]
        if waiting:
            say(f"waiting for the disk: {', '.join(f'the black box of {task.get_name()}' for task in waiting)}")
            self._ending.set()
            _, late = await asyncio.wait(waiting, timeout=patience_s)
            for task in late:
                task.cancel()
                self._lose(task.get_name(), f"the disk did not take it within {patience_s:g} s")
        await asyncio.gather(*self.tasks, return_exceptions=True)
        return "; ".join(self._lost)

    def _lose(self, fault: str, why: str) -> None:
        self._lost.append(f"the black box of {fault} is lost: {why}")
        _LOG.error("%s", self._lost[-1])

    async def salvage(self, owner: blackbox.Owner) -> None:
        """The black boxes that a daemon of this owner left that had died."""
        boxes, others = await aside(lambda: blackbox.salvage(self._folder, owner))
        for saved in boxes:
            self._keep(saved, "left by a daemon that had died")
        for line in others:
            _LOG.warning("%s", line)

    def _keep(self, saved: Path, why: str) -> None:
        self.black_boxes.append(saved)
        _LOG.warning("black box saved: %s (%s)", saved, why)
