"""The feed-forward of a run: the inverse of a model for its reference, inside the rig's envelope, or why not."""

from array import array
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from rig.control.frequency_response import FrequencyResponse, best_linear_approximation
from rig.control.inverse import ANYTHING, DpBounds, Inverse, invert
from rig.control.plant import Plant
from rig.errors import EnvelopeError
from rig.excite.run_plan import RunPlan
from rig.realtime.guard import Limits
from rig.record import Column

MISSED_SHARE: Final = 0.05
MISSED_DEG: Final = 1.0
"""A reference whose inverse stands at the envelope's edge and misses by more than both (of its peak, and in degrees)
cannot be followed."""
INVERSION_AMPLITUDE_MPA: Final = 0.2
"""Size at which the plant is made linear for the inversion; the iteration corrects the rest."""
_HALVINGS: Final = 7


@dataclass(frozen=True)
class FeedForward:
    """A plan with its feed-forward, and what the model leaves of the error with it."""

    plan: RunPlan
    residual_rms_deg: float
    residual_max_deg: float
    iterations: int


def envelope_box(limits: Limits, p0_mpa: float, period_ns: int) -> DpBounds:
    """What range and slew of both set-points leave to their difference about P0."""
    low, high = limits.pressure_mpa
    most = 2.0 * min(p0_mpa - low, high - p0_mpa)
    return DpBounds(-most, most, 2.0 * limits.slew_mpa_s * period_ns * 1e-9)


class Inverter:
    """Feed-forwards of one plant inside one envelope."""

    def __init__(self, plant: Plant, box: DpBounds) -> None:
        self._plant, self._box = plant, box
        self._response: FrequencyResponse = best_linear_approximation(plant, INVERSION_AMPLITUDE_MPA)

    def feedforward(self, plan: RunPlan) -> FeedForward:
        """The plan with it; EnvelopeError, with what can be followed, when the reference asks too much."""
        if plan.tracking is None:
            raise EnvelopeError(f"{plan.name}: is no reference")
        reference, beyond = np.array(plan.tracking.reference_deg), np.array(plan.tracking.beyond_deg)
        found = self._inverse(reference, beyond, self._box)
        peak = float(np.max(np.abs(reference)))
        if found.max_deg > max(MISSED_SHARE * peak, MISSED_DEG) and self._at_the_edge(found.dp_mpa):
            raise EnvelopeError(self._too_much(plan, reference, beyond))
        table = array("d", found.dp_mpa)
        followed = replace(plan.tracking, feedforward_mpa=table)
        made = replace(plan, tracking=followed, dp_mpa=table[plan.ramp_in_ticks :])
        return FeedForward(made, found.rms_deg, found.max_deg, found.iterations)

    def _inverse(self, reference: Column, beyond: Column, box: DpBounds) -> Inverse:
        return invert(self._plant, self._response, reference, beyond, box)

    def _at_the_edge(self, dp_mpa: Column) -> bool:
        inner = DpBounds(0.999 * self._box.low_mpa, 0.999 * self._box.high_mpa, 0.999 * self._box.step_mpa)
        return not inner.holds(dp_mpa)

    def _too_much(self, plan: RunPlan, reference: Column, beyond: Column) -> str:
        """What it would need, when, and how much of it can be followed."""
        wanted = self._inverse(reference, beyond, ANYTHING).dp_mpa
        worst = int(np.argmax(np.abs(wanted)))
        steepest = float(np.max(np.abs(np.diff(wanted)))) / self._plant.period_s
        at_s = (worst - plan.ramp_in_ticks) * self._plant.period_s
        share = _largest(
            lambda scale: self._box.holds(self._inverse(scale * reference, scale * beyond, ANYTHING).dp_mpa)
        )
        return (
            f"{plan.name}: cannot be followed inside the envelope: it needs p1 - p2 = {wanted[worst]:.3g} MPa at "
            f"{at_s:.2f} s and up to {steepest:.3g} MPa/s; allowed is {self._box.low_mpa:.3g} .. "
            f"{self._box.high_mpa:.3g} MPa and {self._box.step_mpa / self._plant.period_s:.3g} MPa/s. What can: the "
            f"same at {100 * share:.0f} % of its size, {share * float(np.max(np.abs(reference))):.3g} deg"
        )


def _largest(holds: Callable[[float], bool]) -> float:
    """The largest share of a reference for which that holds, by bisection; rounded down to whole per cent."""
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return float(np.floor(100.0 * low) / 100.0)
