"""The safe write through a new session, in the background: opening one takes longer than a period, and the loop must go
on ticking."""

import contextlib
import os
import sys
import threading
from collections.abc import Callable
from typing import Final

from rig.errors import DeviceError, DeviceLost, RigError

SWITCH_INTERVAL_S: Final = 0.0002
"""How long the interpreter lets this thread go on when the loop wants to; its usual 5 ms is a whole period."""


class Rescue:
    """Runs `write` on a thread of its own until it has worked; whoever asks waits only as long as he likes."""

    def __init__(self, name: str, write: Callable[[], None]) -> None:
        self._name, self._write = name, write
        self._thread: threading.Thread | None = None
        self._error: DeviceError | None = None

    def attempt(self, patience_s: float) -> None:
        """Start the write unless it is under way, and wait for it; DeviceError when it is not done yet, or has
        failed."""
        if self._thread is None:
            self._error = None
            self._thread = self._begun()
        self._thread.join(patience_s)
        if self._thread.is_alive():
            raise DeviceError(f"{self._name}: the safe set-points are not written yet: a new session is being opened")
        self._thread = None
        if self._error is not None:
            raise self._error

    def _begun(self) -> threading.Thread:
        thread = threading.Thread(target=self._run, name="myrio-rescue", daemon=True)
        try:
            thread.start()
        except RuntimeError:
            raise DeviceError(f"{self._name}: the safe set-points are not written: no thread to be had") from None
        return thread

    def finish(self, patience_s: float) -> None:
        """Wait for a write that is under way, before the process may end."""
        if self._thread is not None:
            self._thread.join(patience_s)
            self._thread = None

    def _run(self) -> None:
        _step_back()
        usual_s = sys.getswitchinterval()
        sys.setswitchinterval(SWITCH_INTERVAL_S)
        try:
            self._write()
        except DeviceError as error:
            self._error = error
        except RigError as error:
            self._error = DeviceLost(str(error))
        except Exception as error:  # noqa: BLE001 - lost with its thread, it would pass for a write that worked
            self._error = DeviceError(f"{self._name}: the safe set-points are not written: {error!r}")
        finally:
            sys.setswitchinterval(usual_s)


def _step_back() -> None:
    """Behind the loop and off its core, in its class: it has the interpreter now and then, and where it was held up
    with it by work that is not real-time, so was the loop. What the vendor's library starts does not inherit that."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setaffinity(0, range(os.cpu_count() or 1))
        if os.sched_getscheduler(0) == os.SCHED_FIFO:
            behind = os.sched_param(max(os.sched_getparam(0).sched_priority // 2, 1))
            os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, behind)
