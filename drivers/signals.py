"""The electrical signals of regulators and their monitors, and the pressure span that each stands for."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from rig.fields import bounded


class SignalRange(StrEnum):
    """A current or voltage range, as the regulator's order code names it (SMC ITV10/20/30 catalogue)."""

    V_0_5 = "0-5 V"
    V_0_10 = "0-10 V"
    V_1_5 = "1-5 V"
    MA_4_20 = "4-20 mA"
    MA_0_20 = "0-20 mA"

    @property
    def low(self) -> float:
        """The lower end, in `unit`."""
        return _RANGES[self][0]

    @property
    def high(self) -> float:
        """The upper end, in `unit`."""
        return _RANGES[self][1]

    @property
    def unit(self) -> str:
        """V or mA."""
        return self.value.rpartition(" ")[2]

    @property
    def broken_below(self) -> float | None:
        """Below this a live zero cannot lie, so the wire is broken; None for signals that start at zero.

        Half the live zero: a monitor may be 6 % of its span off (0.24 V of 4 V), a broken wire reads zero.
        """
        return self.low / 2 if self.low else None


_RANGES: Final = {
    SignalRange.V_0_5: (0.0, 5.0),
    SignalRange.V_0_10: (0.0, 10.0),
    SignalRange.V_1_5: (1.0, 5.0),
    SignalRange.MA_4_20: (4.0, 20.0),
    SignalRange.MA_0_20: (0.0, 20.0),
}


@dataclass(frozen=True)
class Span:
    """A signal and the pressures at its two ends; a setting of each valve and each monitor."""

    signal: SignalRange
    low_mpa: float = bounded(-0.1, 1.0, "MPa", default=0.0)
    high_mpa: float = bounded(0.001, 1.0, "MPa", default=0.5)

    def __post_init__(self) -> None:
        if not self.low_mpa < self.high_mpa:
            raise ValueError(f"low_mpa {self.low_mpa:g} must lie below high_mpa {self.high_mpa:g}")

    def knots(self) -> list[tuple[float, float]]:
        """The nominal straight line: signal -> MPa."""
        return [(self.signal.low, self.low_mpa), (self.signal.high, self.high_mpa)]

    def clamp_signal(self, raw: float) -> float:
        """`raw` inside the signal's range."""
        return min(max(raw, self.signal.low), self.signal.high)

    def clamp_mpa(self, pressure_mpa: float) -> float:
        """`pressure_mpa` inside the span."""
        return min(max(pressure_mpa, self.low_mpa), self.high_mpa)
