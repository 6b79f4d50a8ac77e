"""An angle to follow: the shapes of the signals in degrees, and how the joint is led into one from rest.

A reference has the signal's shape with the amplitude 1, times degrees; `amplitude_deg` in place of `amplitude_mpa` is
what makes a record of a sweep's YAML a reference. Closing the loop over it is rig.realtime.closed_loop.
"""

from array import array
from dataclasses import dataclass
from typing import Any

from rig.excite.signals import Signal, amount, sampled
from rig.fields import bounded
from rig.gains import ClosedLoop

AMPLITUDE = "amplitude_deg"
BEYOND_S = 0.5
"""How far a reference is known beyond the sweep's end: a feed-forward looks ahead."""


@dataclass(frozen=True)
class Amplitude:
    """What a reference's entry has in place of `amplitude_mpa`."""

    amplitude_deg: float = bounded(-360.0, 360.0, "deg")


@dataclass(frozen=True)
class AngleReference:
    """A signal in degrees."""

    signal: Signal
    """The shape, with the amplitude 1 (MPa there); of a table the angle itself."""
    amplitude_deg: float = 1.0

    @property
    def label(self) -> str:
        return self.signal.label.replace(f"{amount(1.0)}mpa", f"{self.amplitude_deg:g}deg")

    @property
    def highest_hz(self) -> float:
        return self.signal.highest_hz

    def value(self, t_s: float) -> float:
        """The angle (deg) at `t_s` >= 0 seconds into the sweep."""
        return self.amplitude_deg * self.signal.value(t_s)

    def parameters(self) -> dict[str, Any]:
        """What the log says of it beside the shape's own numbers."""
        return {AMPLITUDE: self.amplitude_deg}


@dataclass(frozen=True)
class Tracking:
    """What a run needs that closes the loop: one entry a tick of ramp in and sweep."""

    reference_deg: "array[float]"
    beyond_deg: "array[float]"
    """How the reference goes on after the sweep."""
    feedforward_mpa: "array[float]"
    """Differential pressure; zeros without a feed-forward."""
    period_ns: int
    gains: ClosedLoop | None = None
    """None: not chosen yet; such a run cannot be carried out."""


def tracking(
    reference: AngleReference, ramp_in_ticks: int, ticks: int, period_ns: int, gains: ClosedLoop | None
) -> Tracking:
    """The reference on the grid: led in, the sweep, and a little more."""
    beyond = round(BEYOND_S * 1e9 / period_ns)
    whole = sampled(reference, ticks + beyond, period_ns)
    led_in = lead_in(whole[0], whole[1] - whole[0] if len(whole) > 1 else 0.0, ramp_in_ticks)
    angles = array("d", [*led_in, *whole[:ticks]])
    return Tracking(angles, whole[ticks:], array("d", bytes(8 * len(angles))), period_ns, gains)


def lead_in(angle_deg: float, step_deg: float, ticks: int) -> "array[float]":
    """From rest at 0 to `angle_deg`, arriving with the sweep's own speed (`step_deg` a tick): Hermite's cubic, which
    swings back a little so as to arrive in motion."""
    out = array("d")
    for tick in range(ticks):
        s = tick / ticks
        out.append(angle_deg * s * s * (3.0 - 2.0 * s) + step_deg * ticks * s * s * (s - 1.0))
    return out
