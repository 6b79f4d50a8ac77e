"""An effect from outside: a display that shows a new angle only when it has moved by a threshold."""

from collections.abc import Sequence
from typing import Any

from rig.model.effect_stages import EffectParameter, EffectStage
from rig.model.slots import Slot, Values


def sticky_display(p1: Values, p2: Values, y: Values, state: Values, params: Sequence[float], dt_s: float) -> None:
    """Holds the last shown angle until the true one is threshold_deg away from it; params: threshold_deg."""
    for i in range(len(y)):
        if state[0] == 0.0 or abs(y[i] - state[1]) >= params[0]:
            state[0], state[1] = 1.0, y[i]
        y[i] = state[1]


STAGE = EffectStage(
    effect="sticky_display",
    lies_in="sensor",
    slot=Slot.SENSOR,
    stage=sticky_display,
    state_size=2,
    numbers=(EffectParameter("threshold_deg", "deg", 0.0, 10.0, 0.0, "movement that the display does not show"),),
    size="threshold_deg",
)


def library() -> Any:
    """What the diagnosis knows of it; imported only there, because it is heavy."""
    from rig.gap.hypotheses.library import Effect, Law

    law = Law("sticky_display", ("threshold_deg",), (0.02, 0.05, 0.1), scale="span_deg")
    return Effect("sticky_display", (law,), "the angle moves in jumps of one size at every speed", "jumps", "jumps")
