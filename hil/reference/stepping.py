"""What the families share when they are stepped tick by tick: late set-points, noise in blocks, and which disturbances
that allows."""

from collections import deque
from collections.abc import Callable, Collection
from typing import Any, Final

import numpy as np

from hil.reference.compiling import Array
from rig.errors import RigError

REST_MPA: Final = 0.2
"""Both set-points before the first step."""
_BLOCK_TICKS: Final = 4096


class LateSetPoints:
    """Set-points that take effect a fixed time after they were written, on the internal grid."""

    def __init__(self, delay_s: float, step_s: float, substeps: int) -> None:
        late = round(delay_s / step_s)
        self._waiting: deque[tuple[float, float]] = deque([(REST_MPA, REST_MPA)] * late)
        self._substeps = substeps

    def sent(self, p1_mpa: float, p2_mpa: float) -> tuple[Array, Array]:
        """Both in force on each internal step of the period that begins, shape (substeps,)."""
        self._waiting.extend([(p1_mpa, p2_mpa)] * self._substeps)
        due = np.array([self._waiting.popleft() for _ in range(self._substeps)])
        return np.ascontiguousarray(due[:, 0]), np.ascontiguousarray(due[:, 1])


class Blocks:
    """Noise drawn a block of ticks at a time and handed out one by one."""

    def __init__(self, draw: Callable[[int], Array]) -> None:
        self._draw, self._block, self._at = draw, draw(_BLOCK_TICKS), 0

    def next(self) -> float:
        """The next value."""
        if self._at == len(self._block):
            self._block, self._at = self._draw(_BLOCK_TICKS), 0
        self._at += 1
        return float(self._block[self._at - 1])


def require_without_memory(law: Any, allowed: Collection[str], what: str) -> None:
    """RigError when a law (a named tuple) differs from its neutral values in more than `allowed`."""
    neutral = type(law)()
    other = [name for name, value in law._asdict().items() if value != getattr(neutral, name) and name not in allowed]
    if other:
        raise RigError(
            f"physics plant: {what} that {other[0]} describes is for whole records; tick by tick a rig can have "
            f"effects of valve, muscle and joint, and {', '.join(sorted(allowed))}"
        )
