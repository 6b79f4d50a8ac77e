"""A process that is watched from outside, and ended for good."""

import contextlib
import os
import select
import signal
from typing import Final

_FD_SETSIZE: Final = 1024
"""select(2) knows no descriptor from there on, of which a notebook may hold many."""


class WatchedProcess:
    """A process by its descriptor: whether it is gone, and its end. A pid that is gone already is a process that is
    gone; OSError for one that cannot be watched, which may well be there."""

    def __init__(self, pid: int) -> None:
        try:
            self._descriptor: int | None = os.pidfd_open(pid)
        except ProcessLookupError:
            self._descriptor = None

    def gone_within(self, seconds: float) -> bool:
        """Wait that long for its end."""
        if self._descriptor is None:
            return True
        if self._descriptor < _FD_SETSIZE:  # to the microsecond
            return bool(select.select([self._descriptor], [], [], seconds)[0])
        look = select.poll()
        look.register(self._descriptor, select.POLLIN)
        return bool(look.poll(seconds * 1e3))

    def kill(self) -> None:
        """SIGKILL, which ends a stopped process too."""
        if self._descriptor is not None:
            with contextlib.suppress(OSError):
                signal.pidfd_send_signal(self._descriptor, signal.SIGKILL)

    def close(self) -> None:
        """Let go of the descriptor."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)
