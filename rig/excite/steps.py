"""Waveforms with levels: staircase, pseudo-random binary, hold.

Changes of level are short ramps, because the guard limits the slew.
"""

from dataclasses import dataclass
from functools import cached_property

from rig.excite.signals import DP_MAX_MPA, amount
from rig.fields import bounded


def _place(t_s: float, length_s: float) -> tuple[int, float]:
    """Which stretch of `length_s` the time lies in, and how far into it (s).

    Counted in whole nanoseconds, so that a tick on an edge always lies behind it.
    """
    index, into_ns = divmod(round(t_s * 1e9), round(length_s * 1e9))
    return index, into_ns * 1e-9


def _ramped(before: float, after: float, into_s: float, rise_s: float) -> float:
    """On the way from one level to the next."""
    return after if into_s >= rise_s else before + (after - before) * into_s / rise_s


def _require_time_to_rise(rise_s: float, length_s: float, name: str) -> None:
    """ValueError when a level would be left before it is reached: what is missing of it would be a jump."""
    if rise_s > length_s:
        raise ValueError(
            f"rise_s {rise_s:g} s is longer than {name} {length_s:g} s; a level is left when it is reached"
        )


@dataclass(frozen=True)
class Staircase:
    """0 up to +A, down to -A and back to 0 in equal steps, each held `dwell_s` and reached in `rise_s`."""

    amplitude_mpa: float = bounded(0.0, DP_MAX_MPA, "MPa")
    steps: int = bounded(1, 1000, default=4)
    dwell_s: float = bounded(0.01, 1000.0, "s", default=1.0)
    rise_s: float = bounded(0.0, 10.0, "s", default=0.1)

    def __post_init__(self) -> None:
        _require_time_to_rise(self.rise_s, self.dwell_s, "dwell_s")

    @property
    def label(self) -> str:
        return f"staircase_{self.steps}x{self.dwell_s:g}s_{amount(self.amplitude_mpa)}mpa"

    @property
    def highest_hz(self) -> float:
        return 1 / (2 * self.dwell_s)

    def value(self, t_s: float) -> float:
        index, into_s = _place(t_s, self.dwell_s)
        return _ramped(self._level(index - 1), self._level(index), into_s, self.rise_s)

    def _level(self, index: int) -> float:
        return self.amplitude_mpa * (1.0 - abs((index / self.steps + 1.0) % 4.0 - 2.0)) if index >= 0 else 0.0


_TAPS = {3: 2, 4: 3, 5: 3, 6: 5, 7: 6, 9: 5, 10: 7, 11: 9, 15: 14}
"""Order -> second tap of a maximum-length shift register x^order + x^tap + 1 (Golomb, Shift Register Sequences)."""


@dataclass(frozen=True)
class Prbs:
    """A maximum-length pseudo-random binary signal: +-A, one bit each `clock_s`, repeating after 2^order - 1 bits.

    `rise_s` is the time of each change; the seed chooses where in the sequence it starts.
    """

    amplitude_mpa: float = bounded(0.0, DP_MAX_MPA, "MPa")
    clock_s: float = bounded(0.005, 100.0, "s", default=0.25)
    order: int = bounded(3, 15, default=7)
    rise_s: float = bounded(0.0, 10.0, "s", default=0.1)
    seed: int = bounded(0, 2**32 - 1, default=1)

    def __post_init__(self) -> None:
        if self.order not in _TAPS:
            raise ValueError(f"order {self.order} is not there; allowed: {', '.join(map(str, _TAPS))}")
        _require_time_to_rise(self.rise_s, self.clock_s, "clock_s")

    @property
    def label(self) -> str:
        return f"prbs{self.order}_{self.clock_s:g}s_{amount(self.amplitude_mpa)}mpa_seed{self.seed}"

    @property
    def highest_hz(self) -> float:
        return 1 / (2 * self.clock_s)

    @cached_property
    def bits(self) -> tuple[int, ...]:
        """One period of the sequence."""
        length = 2**self.order - 1
        register, out = self.seed % length + 1, []  # any state but zero
        for _ in range(length):
            out.append(register & 1)
            new = (register ^ register >> _TAPS[self.order]) & 1
            register = register >> 1 | new << (self.order - 1)
        return tuple(out)

    def value(self, t_s: float) -> float:
        index, into_s = _place(t_s, self.clock_s)
        return _ramped(self._level(index - 1), self._level(index), into_s, self.rise_s)

    def _level(self, index: int) -> float:
        return self.amplitude_mpa * (2 * self.bits[max(index, 0) % len(self.bits)] - 1)


@dataclass(frozen=True)
class Hold:
    """One constant dp, of either sign: what creep is seen in. The ramp-in is its step."""

    amplitude_mpa: float = bounded(-DP_MAX_MPA, DP_MAX_MPA, "MPa")

    @property
    def highest_hz(self) -> float:
        return 0.0

    @property
    def label(self) -> str:
        return f"hold_{amount(self.amplitude_mpa)}mpa"

    def value(self, t_s: float) -> float:
        return self.amplitude_mpa
