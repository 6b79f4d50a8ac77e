"""The plant behind the wires: one rig that several emulators share, stepped as a function of the clock.

A plant is any object with `step(p1_cmd_mpa, p2_cmd_mpa) -> (p1_mpa, p2_mpa, angle_deg)`, one period long. The emulators
turn volts, bytes and registers into calls of this file; nothing here knows a protocol. With the clock of the loop,
virtual time works like real time, and one step falls between two ticks exactly as in the in-process simulated rig.
"""

import threading
from typing import NamedTuple, Protocol

from rig.interfaces import Clock


class EmulatedPlant(Protocol):
    """A simulated rig as the emulators need it."""

    def step(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> tuple[float, float, float]:
        """One period under these commands: pressure 1, pressure 2 (MPa) and joint angle (deg) at its end."""


class Outputs(NamedTuple):
    """What the sensors of the rig would see now."""

    p1_mpa: float = 0.0
    p2_mpa: float = 0.0
    angle_deg: float = 0.0


class World:
    """Holds the commands, steps the plant once for every period that has passed, hands out its outputs.

    Safe to use from several threads: each emulator has its own.
    """

    LONGEST_GAP = 400
    """Steps made up for after a pause (2 s at 5 ms); commands were constant over it, so more would change nothing
    fast."""

    def __init__(
        self, plant: EmulatedPlant, clock: Clock, period_ns: int = 5_000_000, commands: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """`commands`: the set-points (MPa) that the regulators were left with, before anybody writes."""
        self.plant = plant
        self._clock = clock
        self._period_ns = period_ns
        self._commands = list(commands)
        self._outputs = Outputs()
        self._next_ns: int | None = None
        self._lock = threading.Lock()

    @property
    def clock(self) -> Clock:
        """The clock that drives the plant."""
        return self._clock

    @property
    def commands(self) -> tuple[float, float]:
        """The set-points that the regulators follow now, MPa."""
        return self._commands[0], self._commands[1]

    def command(self, valve: int, pressure_mpa: float) -> None:
        """Give regulator 1 or 2 a new set-point, from now on."""
        with self._lock:
            self._advance()
            self._commands[valve - 1] = pressure_mpa

    def outputs(self) -> Outputs:
        """Pressures and angle at this moment."""
        with self._lock:
            self._advance()
            return self._outputs

    def _advance(self) -> None:
        now_ns = self._clock.now_ns()
        if self._next_ns is None:
            self._next_ns = now_ns
        due = (now_ns - self._next_ns) // self._period_ns + 1
        for _ in range(min(due, self.LONGEST_GAP)):
            self._outputs = Outputs(*self.plant.step(*self._commands))
        self._next_ns += max(due, 0) * self._period_ns
