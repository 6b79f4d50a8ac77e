"""One mark in the raw records, and what the smoothing lets through of it."""

from dataclasses import dataclass, field

SMOOTHED = 0.25
"""Share of a white disturbance's variance that the smoothing lets through, generously."""


@dataclass(frozen=True)
class Signature:
    """One mark: what was looked for, what the case and the baselines show, and the effect it stands for."""

    mark: str
    effect: str | None
    found: bool
    value: float
    baseline: float
    unit: str
    text: str
    numbers: dict[str, float] = field(default_factory=dict)
    variance_deg2: float = 0.0
    """What the effect adds to the mean square of the angle."""
    smoothed_deg2: float = 0.0
    """What of it the smoothing lets through."""
