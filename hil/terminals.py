"""The wires of the simulated rig: the set-points that stand at its valves, in shared memory, and a slot for a fault to
inject.

Like real terminals they keep their value when the process that wrote them dies, and a second process can write to them:
the supervisor's own path to the valves, and what a test measures times at.
"""

import mmap
import os
import time
from pathlib import Path
from typing import Self

_WORDS = 8
_P1, _P2, _CHANGED, _WRITES, _FAULT, _FAULT_SINCE = range(6)


class Terminals:
    """A small file, mapped by everybody who names it."""

    def __init__(self, mapped: mmap.mmap) -> None:
        self._mapped = mapped
        whole = memoryview(mapped)
        self._words = whole.cast("Q")
        self._values = whole.cast("d")

    @classmethod
    def at(cls, path: Path) -> Self:
        """The terminals at `path`, made when they are not there yet."""
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            if os.fstat(descriptor).st_size < _WORDS * 8:
                os.ftruncate(descriptor, _WORDS * 8)
            return cls(mmap.mmap(descriptor, _WORDS * 8))
        finally:
            os.close(descriptor)

    @property
    def setpoints(self) -> tuple[float, float]:
        """What stands at the valves (MPa)."""
        return self._values[_P1], self._values[_P2]

    @property
    def writes(self) -> int:
        """How often somebody has written."""
        return self._words[_WRITES]

    @property
    def changed_ns(self) -> int:
        """Monotonic time of the last write that changed a value."""
        return self._words[_CHANGED]

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """New set-points, from any process."""
        if (p1_cmd_mpa, p2_cmd_mpa) != self.setpoints:
            self._values[_P1], self._values[_P2] = p1_cmd_mpa, p2_cmd_mpa
            self._words[_CHANGED] = time.monotonic_ns()
        self._words[_WRITES] += 1

    @property
    def fault(self) -> int:
        """Number of the fault that is to be shown, see hil.faults; 0: none."""
        return self._words[_FAULT]

    @property
    def fault_since_ns(self) -> int:
        """When `inject` was last called."""
        return self._words[_FAULT_SINCE]

    def inject(self, number: int) -> None:
        """Show a fault from the next call of the device on."""
        self._words[_FAULT_SINCE] = time.monotonic_ns()
        self._words[_FAULT] = number
