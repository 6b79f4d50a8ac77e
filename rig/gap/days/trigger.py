"""Whether a side of the chain has a gap, or has one left: by structure beside the days' modes, or by a mode beyond what
days bring.

The thresholds were set on development data only (docs/explanation/diagnosis.md).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from rig.gap.days.side import Side
from rig.record import Column

FALSE_ALARM = 0.003
"""Allowed for each mode of each side."""
PRIOR_DEGREES = 4.0
"""Degrees of freedom that the prior spreads are worth in the threshold."""
STRUCTURE = 1.3
"""Rms beside the modes, over that of healthy sessions, from which on it is a gap."""


@dataclass(frozen=True)
class Trigger:
    """Whether a side has a gap, and by what."""

    found: bool
    structure: float
    """Rms beside the modes over the floor's."""
    scores: Column
    """(m,) each mode's size in its standard deviations."""
    together: Column
    """(m,) of the pressures: sum and difference of both monitors' modes, alike; empty for the angle."""
    threshold: float
    """What a score must exceed."""

    @property
    def by_modes(self) -> bool:
        """Offset, gain, lag or loop width alone are more than days bring."""
        return self.worst > self.threshold

    @property
    def worst(self) -> float:
        """The largest score of any mode."""
        return float(np.abs(np.concatenate([self.scores, self.together])).max())

    @property
    def strength(self) -> float:
        """How far above the threshold the strongest sign is: 1 is on it."""
        return float(max(self.structure / STRUCTURE, self.worst / self.threshold))


def trigger(side: Side, residual: Column | None = None, looseness: float = 0.0) -> Trigger:
    """Test a side's gap, or what a cause left of it (`looseness`: the rms that even the right law may leave)."""
    column = side.gap if residual is None else residual
    sizes = side.free_sizes(column)
    noise = side.noise(looseness)
    own = np.sqrt(np.diag(np.linalg.pinv(side.modes.T @ side.modes))) * np.sqrt(noise)
    relax = looseness / np.maximum(np.sqrt(np.sum(side.modes**2, axis=0) / side.rows), 1e-12)
    beside = side.without_doubts(column - side.modes @ sizes, looseness)
    doubt = np.sqrt(np.sum(side.doubt_shares**2, axis=1))
    scores = sizes / np.sqrt(side.spread**2 + doubt**2 + own**2 + relax**2)
    half = len(scores) // 2 if side.name == "valve" else 0
    first, second = scores[:half] / np.sqrt(2.0), scores[len(scores) - half :] / np.sqrt(2.0)
    structure = side.rms(beside) / float(np.hypot(side.remainder, looseness))
    threshold = float(stdtrit(side.degrees + PRIOR_DEGREES, 1 - 0.5 * FALSE_ALARM))
    sign = Trigger(False, structure, scores, np.concatenate([first + second, first - second]), threshold)
    return replace(sign, found=structure > STRUCTURE or sign.by_modes)
