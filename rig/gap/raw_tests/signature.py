"""One raw-data test: what was looked for, what the case and the baselines show, and the effect it stands for.

An observation beside the cause: it says what is in the samples, not why simulator and rig differ.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from rig.gap.raw_tests.settings import HIGHEST_CONFIDENCE, TESTS

MONITOR = "monitor of"
"""How the tests of the pressure monitors are called, with p1 or p2 behind it."""


def on_days(text: str, days: bool) -> str:
    """What the earlier days show of the same, behind what the case shows; empty where there are none."""
    return f", {text} on the earlier days" if days else ""


@dataclass(frozen=True)
class Size:
    """A number of the effect with its 95 % interval, computed from the samples."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Signature:
    """The result of one test."""

    test: str
    """quantisation step, repeated samples, drop-outs, mains line, spurious tone, noise, time stamps, mean pressure,
    monitor of p1 or p2."""
    effect: str | None
    found: bool
    value: float
    baseline: float
    """The same of the baselines; 0 without any."""
    unit: str
    text: str
    sizes: Mapping[str, Size] = field(default_factory=dict)
    """Numbers of the effect's stage."""
    p_value: float | None = None
    """Probability of so much or more were nothing there, given how days and samples vary; None where that has no
    meaning."""
    variance_deg2: float = 0.0
    """What the effect adds to the mean square of the angle."""
    smoothed_deg2: float = 0.0
    """What of it the smoothing lets through."""
    taken_out_deg2: float = 0.0
    """What of it is taken out of the records before anything is compared."""

    @property
    def numbers(self) -> dict[str, float]:
        """The effect's numbers without their intervals."""
        return {name: size.value for name, size in self.sizes.items()}

    @property
    def confidence(self) -> float:
        """Probability that what was found is there: what chance leaves, for as many tests as are made on a case."""
        return 0.0 if not self.found else min(1.0 - min(TESTS * (self.p_value or 0.0), 1.0), HIGHEST_CONFIDENCE)

    def to_json(self) -> dict[str, Any]:
        return asdict(self)
