"""What the families share when they are stepped tick by tick: late set-points, noise in blocks, and which disturbances
that allows."""

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Collection
from typing import Any, ClassVar, Final

import numpy as np
from numpy.random import SeedSequence, default_rng

from hil.reference.compiling import Array, State
from hil.reference.disturbance import Disturbance
from hil.reference.plant import ReferencePlant
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


class SteppedPlant(ABC):
    """One unit of a family under a disturbance, a period at a time; see hil.reference.families.Stepped. The family
    brings its equations and its instruments."""

    timing: ClassVar[Collection[str]]
    """Of the timing law, what has no memory: it can act tick by tick."""
    reading: ClassVar[Collection[str]]
    """Of the reading law."""
    most_rad: ClassVar[float]
    """Beyond this angle the equations have ended."""
    pressures: ClassVar[tuple[int, int]]
    """Where the state holds what the monitors see (MPa, absolute)."""
    angle: ClassVar[int]
    """Where it holds the joint's angle (rad)."""

    def __init__(
        self, plant: ReferencePlant, session: Any, disturbance: Disturbance, period_s: float, noise_seed: int
    ) -> None:
        require_without_memory(disturbance.timing, self.timing, "the timing")
        require_without_memory(disturbance.reading, self.reading, "the reading")
        build = plant.build
        substeps = build.substeps(period_s)
        self._build, self._session, self._disturbance, self._zero_rad = build, session, disturbance, plant.zero_rad
        self._period_s, self._step_s = period_s, period_s / substeps
        self._random = default_rng(SeedSequence((build.seeds.noise, session.seed, noise_seed)))
        self._noise = Blocks(lambda n: self.noise_deg(n))
        self._set_points = LateSetPoints(disturbance.timing.delay_s, self._step_s, substeps)
        self._state: Any = self.settled(round(build.settle_s / build.step_s))
        self._ticks = 0

    def step(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> tuple[float, float, float]:
        """p1, p2 (MPa) and angle (deg) as read one period later."""
        self.advance(*self._set_points.sent(p1_cmd_mpa, p2_cmd_mpa), self._ticks * self._period_s, self._state)
        self._ticks += 1
        angle_rad = self._state[self.angle]
        if not abs(angle_rad) < self.most_rad:
            raise RigError(
                f"{self._build.name} plant: the joint left {self._build.travel} at {self._ticks * self._period_s:.2f} s"
            )
        first, second = (self.monitored(k, np.array([self._state[at]])) for k, at in enumerate(self.pressures))
        return first, second, self.read_deg(np.array([math.degrees(angle_rad - self._zero_rad)]))

    @abstractmethod
    def settled(self, steps: int) -> State:
        """The state after so many internal steps with both set-points at rest."""

    @abstractmethod
    def advance(self, set_1_mpa: Array, set_2_mpa: Array, time_s: float, state: State) -> None:
        """Move the state on under set-points on the internal grid, shape (substeps,), from `time_s` on."""

    @abstractmethod
    def noise_deg(self, n: int) -> Array:
        """The angle's noise for so many ticks, shape (n,)."""

    @abstractmethod
    def monitored(self, valve: int, pressure_mpa: Array) -> float:
        """What monitor `valve` (0 or 1) says of an absolute pressure, shape (1,)."""

    @abstractmethod
    def read_deg(self, angle_deg: Array) -> float:
        """What the sensor says of an angle from the unit's zero, shape (1,)."""


def require_without_memory(law: Any, allowed: Collection[str], what: str) -> None:
    """RigError when a law (a named tuple) differs from its neutral values in more than `allowed`."""
    neutral = type(law)()
    other = [name for name, value in law._asdict().items() if value != getattr(neutral, name) and name not in allowed]
    if other:
        raise RigError(
            f"physics plant: {what} that {other[0]} describes is for whole records; tick by tick a rig can have "
            f"effects of valve, muscle and joint, and {', '.join(sorted(allowed))}"
        )
