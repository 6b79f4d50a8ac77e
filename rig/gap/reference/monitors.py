"""What the pressures' factor says of the monitors, for the angle's: an offset that a monitor shows is one uncertainty,
not two.

Part of the offset is the monitor's own error: a share of its variance that was fitted on healthy days
(`Levels.monitors`). The rest is a pressure that is really there, to which the muscles answer. So the angle is expected
under the measured pressures less what the monitors likely misread, and what stays uncertain of them is less than
before. No effect is known here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.gap.priors import FactorLevels, Levels
from rig.gap.reference.expectation import Factor
from rig.gap.reference.patterns import VALVE_PATTERNS
from rig.record import Column

SHOWN, OWN = "offset_mpa", "monitor_mpa"
"""The pattern of the pressures, and the angle's that is the same doubt."""


@dataclass(frozen=True)
class Misread:
    """What the monitors likely misread, and how surely that is known."""

    offset_mpa: tuple[float, float]
    spread_mpa: float
    """Standard deviation that stays in doubt."""
    days_mpa: tuple[tuple[float, float], ...] = ()
    """The same on each earlier day, less what they misread on those days' mean."""

    def levels(self, angle: FactorLevels) -> FactorLevels:
        """The angle's levels with what stays in doubt of the monitors."""
        return replace(angle, patterns={**angle.patterns, OWN: self.spread_mpa})

    def differs(self, other: "Misread") -> bool:
        """Whether another reading of the monitors is off by more than the doubt that stays."""
        apart = [abs(one - two) for one, two in zip(self.offset_mpa, other.offset_mpa, strict=True)]
        return max(apart) > max(self.spread_mpa, other.spread_mpa)


def misread(pressures: Factor, residual: Column, levels: Levels, days: Column | None = None) -> Misread:
    """From what a cause leaves of the pressures' gap, in lines (l,), and from the pressures of the earlier days (n, K):
    what their angles repeat is seen only once their monitors are read right as well."""
    share, own = levels.monitors, levels.angle.patterns[OWN]
    first = VALVE_PATTERNS.index(SHOWN)
    at = [first, len(VALVE_PATTERNS) + first]
    shown = _spreads(pressures, at)
    one, other = (share * shown * pressures.healthy.sizes(residual)[at]).tolist()
    unsure = float(np.mean((share * shown) ** 2 * pressures.healthy.size_variances()[at]))
    spread = min(float(np.sqrt((1.0 - share) * own**2 + unsure)), own)
    if days is None or days.shape[1] < 2:
        return Misread((one, other), spread)
    apart = pressures.lines.of(days - days.mean(axis=1, keepdims=True))
    sizes, _ = pressures.healthy.sizes_with_covariance(apart)
    each = (share * shown[:, None] * sizes[at]).T.tolist()
    return Misread((one, other), spread, tuple((first, second) for first, second in each))


def _spreads(pressures: Factor, at: Sequence[int]) -> Column:
    """(2,) standard deviations of both monitors' offsets as the factor has them: a level, or the rig's own."""
    rows = 0.5 * float(pressures.lines.used.sum())
    out: Column = np.sqrt(np.sum(pressures.healthy.patterns[:, at] ** 2, axis=0) / rows)
    return out
