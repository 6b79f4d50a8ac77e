"""Who goes on to make a rig safe in the place of a process that commands, has no session, and is killed or stopped
while it tries: a guardian without a loop to watch."""

import os
import secrets
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Final

from rig.realtime.ring import Ring
from rig.realtime.safe_report import Outcome, Writer
from rig.service.aside import ReadyThread
from rig.service.session.watchers import WatcherEntry, Watchers

_BEAT_S: Final = 0.2
"""A commander who has not beaten for two seconds is taken for lost."""
_LET_GO_S: Final = 3.0
"""For an attempt that is under way: to connect, to write, and to look, a second each at most."""
_POLL_S: Final = 0.01
"""Between two looks whether that attempt is over."""


class Heir:
    """Its process, from now until `end`. This process beats for it, and is the one who tries."""

    def __init__(self, entry: WatcherEntry, rig: Any) -> None:
        """OSError or RigError when the machine gives no memory, process or thread."""
        session = secrets.randbits(63)
        self._ended = threading.Event()
        with ExitStack() as half_made:
            self._beats = ReadyThread()
            half_made.callback(self._beats.end)
            self._ring = Ring.create(f"{session:016x}-heir", session, capacity=1)
            half_made.callback(self._ring.block.unlink)
            self._watchers = Watchers(session, self._ring, rig, {})
            half_made.pop_all()
        self._beats.begin(self._beat)
        try:
            self._watchers.start(entry, os.getpid(), (Writer.GUARDIAN,))
        except BaseException:
            self.end()
            raise

    def await_ready(self, meanwhile: Callable[[], None]) -> None:
        """Until it stands by; RigError when it does not come so far. `meanwhile` is called ten times a second."""
        self._watchers.await_ready(meanwhile)

    @property
    def alive(self) -> bool:
        """Its process has not ended, as it does when it has made the rig safe itself."""
        return all(process.is_alive() for process in self._watchers.processes.values())

    def await_quiet(self) -> None:
        """Until it does not hold the device's wires, which it took while this process was stopped."""
        deadline = time.monotonic() + _LET_GO_S
        while self.alive and self._tries and time.monotonic() < deadline:
            time.sleep(_POLL_S)

    @property
    def _tries(self) -> bool:
        return self._watchers.block.report(Writer.GUARDIAN).outcome is not Outcome.UNKNOWN

    def _beat(self) -> None:
        while not self._ended.is_set():
            self._watchers.block.beat(Writer.CONTROL)
            self._ended.wait(_BEAT_S)

    def release(self) -> None:
        """There is nothing to inherit any more."""
        self._watchers.block.release()

    def end(self) -> None:
        """The same, and its end."""
        self._ended.set()
        self._beats.end()
        self.release()
        self._watchers.wake()
        self._watchers.end()
        self._ring.block.unlink()
