"""Every number that decides, with its unit, its source, and what moves if it moves."""

from collections.abc import Mapping
from dataclasses import dataclass, field

TOP_HZ = 6.0
"""Highest frequency compared, Hz: muscles and regulators answer below it. Higher: more lines of noise, the same evidence."""
ENVELOPE_HZ = 0.5
"""Width over which a response's power is blurred for the remainder's variance, Hz."""
ENVELOPE_EVEN = 0.1
"""Share of it that is spread evenly over all lines."""


@dataclass(frozen=True)
class Levels:
    """How surely a reference knows the rig: standard deviations of what may differ without being a gap."""

    valve: Mapping[str, float]
    valve_share: float
    valve_noise_mpa: float
    angle: Mapping[str, float]
    bank: float
    angle_share: float
    angle_noise_deg: float
    degrees: float = 6.0
    valve_effective: float = 60.0
    angle_effective: float = 60.0


@dataclass(frozen=True)
class Prior:
    """What is thought of effects before the records are seen."""

    share: float = 0.05
    """Middle of what an effect changes, as a share of what moves anyhow."""
    share_spread: float = 1.5
    """Standard deviation of its logarithm."""
    rho_scale: float = 1.0
    """Factor on every law's usual error."""
    rho_lines: float = 0.5
    """Share of it that is independent from line to line."""
