"""What stands above a command that holds a rig: the device's own watchdog, and, where there is no loop (calibrating and
probing), supervisor and guardian.

These two are those of a session. When this process is killed, stopped (also by Ctrl-Z) or hangs, they end it and see to
the safe state; when one of them is lost, the command gives up.
"""

import os
import secrets
from collections.abc import Mapping
from contextlib import ExitStack
from typing import Final

from rig.app import compose
from rig.app.terminal import console
from rig.app.watcher_process import watcher_process
from rig.errors import RigError
from rig.realtime.ring import Ring, RingWriter
from rig.realtime.safe_report import Writer
from rig.rig_config import RigConfig
from rig.service.session.last_resort import last_resort
from rig.service.session.watchers import Watchers

_PATIENCE_NS: Final = 250_000_000
"""A thread beside a prompt is not as punctual as a loop, and moves the rig gently."""


class SupervisedCommand:
    """This process and its ticks, looked after from above, from `start` to `end`; `beat` each tick. It is to be ended
    also where it was not started, or could not be."""

    def __init__(self, rig: RigConfig) -> None:
        """StateError where shared memory gives no room."""
        session = secrets.randbits(63)
        with ExitStack() as half_made:
            self._ring = Ring.create(f"{session:016x}-ticker", session, capacity=1)
            half_made.callback(self._ring.block.unlink)
            self._writer = RingWriter(self._ring)
            self._watchers = Watchers(session, self._ring, rig, {})
            half_made.pop_all()
        self.beat = self._writer.beat
        self.trouble = self._watchers.trouble
        """Why the watchers cannot be relied on; empty while they can."""

    def start(self) -> None:
        """Until both of those above watch; RigError when one does not come so far."""
        self._watchers.start(
            watcher_process, os.getpid(), (Writer.SUPERVISOR, Writer.GUARDIAN), _PATIENCE_NS, speak=True
        )
        self._watchers.await_ready()

    def end(self) -> None:
        """The rig has been left safe, or was never moved: nobody needs to follow up. Idempotent."""
        self._watchers.block.release()
        self._watchers.wake()
        self._watchers.end()
        self._ring.block.unlink()


def supervised(rig: RigConfig) -> SupervisedCommand | None:
    """For a rig whose set-points stand when this process is gone; None where the plant ends with it."""
    return SupervisedCommand(rig) if compose.outlives_the_loop(rig) else None


def check_last_resort(rig: RigConfig, device: Mapping[str, str], force: bool) -> None:
    """What would be left if every process were lost at once: said, and refused when that takes too long."""
    if compose.is_simulated(rig):
        return
    left = last_resort(rig, device)
    if left.problems and not force:
        raise RigError(f"{left.problems[0]}; shorten it, or give --force")
    for line in (*left.problems, *left.lines):
        console("-").print(line, style="yellow", markup=False)
