"""Waveforms of the differential pressure: each a small frozen dataclass with a value at any time of the sweep.

The class is also the schema of its entry in a sweep's YAML. Values are computed from the time alone, never from the
value before, so a skipped tick leaves the phase where it belongs. Here are the smooth ones; steps.py has those with
levels, table.py those from a file. None knows P0, ramps or repeats: see sweep.py.
"""

import math
import random
from array import array
from collections.abc import Hashable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

from rig.fields import bounded

DP_MAX_MPA = 1.0
"""Schema bound of every amplitude; what the rig at hand allows is its envelope, checked before a run."""


class Signal(Hashable, Protocol):
    """A waveform of dp over the time of a sweep."""

    @property
    def label(self) -> str:
        """The shape and its parameters as a short name, for example sine_0.5hz_0.20mpa."""

    @property
    def highest_hz(self) -> float:
        """The highest frequency put in on purpose (0: none); steps count with their clock."""

    def value(self, t_s: float) -> float:
        """dp in MPa at `t_s` >= 0 seconds into the sweep; finite."""


def sampled(signal: Signal, ticks: int, period_ns: int) -> "array[float]":
    """dp (MPa) at tick 0 .. ticks-1; the time of each comes from its index, so no rounding adds up."""
    return array("d", (signal.value(tick * period_ns * 1e-9) for tick in range(ticks)))


def amount(value: float) -> str:
    """A pressure for a name: two decimals, more only where they say something."""
    return max(f"{value:.2f}", f"{value:g}", key=len)


@dataclass(frozen=True)
class _Tone:
    """A frequency and the amplitude of dp, as the paper counts it (MPa, zero to peak)."""

    frequency_hz: float = bounded(0.001, 100.0, "Hz")
    amplitude_mpa: float = bounded(0.0, DP_MAX_MPA, "MPa")

    @property
    def highest_hz(self) -> float:
        return self.frequency_hz

    @property
    def _size(self) -> str:
        return f"{self.frequency_hz:g}hz_{amount(self.amplitude_mpa)}mpa"


@dataclass(frozen=True)
class Sine(_Tone):
    """u = A sin(2 pi f t): the paper's first signal, 0.2 to 0.8 Hz at A = 0.2 MPa."""

    @property
    def label(self) -> str:
        return f"sine_{self._size}"

    def value(self, t_s: float) -> float:
        return self.amplitude_mpa * math.sin(2 * math.pi * self.frequency_hz * t_s)


@dataclass(frozen=True)
class Triangle(_Tone):
    """Straight lines through 0, +A, 0, -A, 0 in one period, rising first: the paper's second signal."""

    @property
    def label(self) -> str:
        return f"triangle_{self._size}"

    def value(self, t_s: float) -> float:
        cycle = (self.frequency_hz * t_s + 0.25) % 1.0  # 0 at the lowest point
        return self.amplitude_mpa * (1.0 - abs(4.0 * cycle - 2.0))


MIXED_PARTS = ((1.0, 1.0), (0.6, 0.3), (0.7, 1.5), (0.1, 4.0))
"""Equation (12) of the paper: (part of A, part of f) of each sine."""


@dataclass(frozen=True)
class Mixed(_Tone):
    """Equation (12) of the paper: four sines at f, 0.3 f, 1.5 f and 4 f; there A = 0.1 MPa and f = 0.5 Hz.

    The amplitude is the equation's A; the sum can reach 2.4 A.
    """

    @property
    def label(self) -> str:
        return f"mixed_{self._size}"

    @property
    def highest_hz(self) -> float:
        return 4.0 * self.frequency_hz

    def value(self, t_s: float) -> float:
        turn = 2 * math.pi * self.frequency_hz * t_s
        return self.amplitude_mpa * math.fsum(part * math.sin(factor * turn) for part, factor in MIXED_PARTS)


_MOST_LINE = 2500
"""Its peak is looked for on 16 points a line, with every line at each: five seconds for this many."""


@dataclass(frozen=True)
class Multisine:
    """Equal sines on the odd multiples of 1/period_s between low and high, with random phases drawn from the seed.

    Even lines and odd lines left out stay empty, so what the rig puts there is its non-linearity (Pintelon and
    Schoukens, System Identification, 2nd ed., ch. 4). `amplitude_mpa` is what the sum never exceeds.
    """

    amplitude_mpa: float = bounded(0.0, DP_MAX_MPA, "MPa")
    low_hz: float = bounded(0.001, 100.0, "Hz", default=0.1)
    high_hz: float = bounded(0.001, 100.0, "Hz", default=2.0)
    period_s: float = bounded(0.1, 1000.0, "s", default=10.0)
    seed: int = bounded(0, 2**32 - 1, default=1)

    def __post_init__(self) -> None:
        if self.high_hz * self.period_s > _MOST_LINE:
            highest = f"high_hz times period_s is {self.high_hz * self.period_s:g}"
            raise ValueError(f"{highest}, the number of its highest line; at most {_MOST_LINE}")
        if not self.lines:
            raise ValueError(f"no odd multiple of 1/{self.period_s:g} s lies in {self.low_hz:g} .. {self.high_hz:g} Hz")

    @property
    def label(self) -> str:
        lines = f"{self.low_hz:g}-{self.high_hz:g}hz_{self.period_s:g}s"
        return f"multisine_{lines}_{amount(self.amplitude_mpa)}mpa_seed{self.seed}"

    @property
    def highest_hz(self) -> float:
        return self.high_hz

    @cached_property
    def lines(self) -> tuple[int, ...]:
        """The odd multiples of 1/period_s that are excited."""
        first, last = math.ceil(self.low_hz * self.period_s - 1e-9), math.floor(self.high_hz * self.period_s + 1e-9)
        return tuple(line for line in range(max(first, 1), last + 1) if line % 2)

    @cached_property
    def _phases(self) -> tuple[float, ...]:
        draw = random.Random(self.seed)
        return tuple(draw.uniform(0.0, 2 * math.pi) for _ in self.lines)

    @cached_property
    def _scale(self) -> float:
        # On 16 n points a trigonometric sum of degree n is below its largest sample / cos(pi / 16) everywhere
        # (Ehlich and Zeller 1964), so the bound holds between the points too.
        points = 16 * self.lines[-1]
        peak = max(abs(self._sum(point / points)) for point in range(points))
        return self.amplitude_mpa * math.cos(math.pi / 16) / peak

    def _sum(self, cycle: float) -> float:
        turn = 2 * math.pi * cycle
        return math.fsum(math.sin(line * turn + phase) for line, phase in zip(self.lines, self._phases, strict=True))

    def value(self, t_s: float) -> float:
        return self._scale * self._sum(t_s / self.period_s % 1.0)


@dataclass(frozen=True)
class Chirp:
    """A sine whose frequency runs evenly from low to high in `length_s`, back down in the next, and so on; no jumps."""

    amplitude_mpa: float = bounded(0.0, DP_MAX_MPA, "MPa")
    low_hz: float = bounded(0.0, 100.0, "Hz", default=0.1)
    high_hz: float = bounded(0.001, 100.0, "Hz", default=2.0)
    length_s: float = bounded(0.1, 1000.0, "s", default=20.0)

    @property
    def label(self) -> str:
        return f"chirp_{self.low_hz:g}-{self.high_hz:g}hz_{self.length_s:g}s_{amount(self.amplitude_mpa)}mpa"

    @property
    def highest_hz(self) -> float:
        return max(self.low_hz, self.high_hz)

    def value(self, t_s: float) -> float:
        return self.amplitude_mpa * math.sin(2 * math.pi * self.cycles(t_s))

    def cycles(self, t_s: float) -> float:
        """The integral of the frequency."""
        passes, into_s = divmod(t_s, self.length_s)
        up = passes % 2 == 0
        start_hz = self.low_hz if up else self.high_hz
        slope = (self.high_hz - self.low_hz) / self.length_s * (1 if up else -1)
        return passes * self.length_s * (self.low_hz + self.high_hz) / 2 + start_hz * into_s + slope * into_s**2 / 2
