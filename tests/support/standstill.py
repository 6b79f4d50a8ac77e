"""A machine that stands still while a test reads the clock: noticed by a thread that only sleeps (decision 0426)."""

import threading
import time
from types import TracebackType
from typing import Final, Self

STOOD_S: Final = 0.05
"""A sleep longer by this is one of the machine: who has slept waits 9 to 17 ms for a processor where five processes
share two."""
RERUNS: Final = 2
"""So often may a test be run again, whatever it failed by."""
STANDSTILLS: Final = 6
"""And so often, at most, because the machine stood still."""
_LOOK_S: Final = 0.005


class Standstills:
    """Of the machine, around all attempts of one test."""

    def __init__(self) -> None:
        self.longest_s = 0.0
        """In this attempt."""
        self._excused = 0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._sleep, name="standstills", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        self._thread.join()

    def _sleep(self) -> None:
        before_s = time.monotonic()
        while not self._over.wait(_LOOK_S):
            now_s = time.monotonic()
            self.longest_s = max(self.longest_s, now_s - before_s - _LOOK_S)
            before_s = now_s

    @property
    def stood(self) -> bool:
        """In this attempt."""
        return self.longest_s > STOOD_S

    def begin(self) -> None:
        """Another attempt."""
        self._excused += self.stood
        self.longest_s = 0.0

    def may_run_again(self, attempts: int) -> bool:
        """After so many that failed: an attempt in which the machine stood still counts as none."""
        return attempts - self._excused - self.stood <= RERUNS
