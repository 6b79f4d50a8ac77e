"""What is known of an effect's stage: where it enters the chain, its numbers with unit, bounds and neutral value."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from rig.model.slots import Slot, StageFunction


@dataclass(frozen=True)
class EffectParameter:
    """One number of an effect; `neutral` switches it off, or is the usual value of a shape."""

    name: str
    unit: str
    low: float
    high: float
    neutral: float
    meaning: str
    own: str = ""
    """What the chain takes from the rig where the number is left out; empty: nothing, it stands at `neutral`."""


WHOLE_SESSION = EffectParameter(
    "whole_session", "1", 0.0, 1.0, 0.0, "1: goes on since the session's first record, 0: anew with each record"
)
"""Of stages that keep their time, in seconds, in the first place of their state."""


def goes_on(numbers: Mapping[str, float]) -> bool:
    """Whether a stage with these numbers goes on from record to record."""
    return numbers.get(WHOLE_SESSION.name, WHOLE_SESSION.neutral) > 0.5


@dataclass(frozen=True)
class EffectStage:
    """How one effect enters the chain (the form that `rig.model.chain` lays out)."""

    effect: str
    """The word of the report; two laws of one effect share it."""
    lies_in: str
    """Where the report says it lies: timing, valve, muscle, joint or sensor."""
    slot: Slot
    """Where the chain runs it; differs from `lies_in` where an effect shows elsewhere."""
    stage: StageFunction
    state_size: int
    numbers: tuple[EffectParameter, ...]
    size: str
    """The number that says how much of the effect there is; the others are shapes and what it acts on."""
    before: bool = False
    """Ahead of the slot's nominal stage, or after it."""
    exact: bool = False
    """It may be put onto a measured response itself: the rest of the chain has no part in what it does there. Ahead of
    the monitors it acts on what was measured behind them: a gain or an offset is one of the pressure. In the timing
    slot it makes everything later, by `late`."""
    late: tuple[float, float] = (0.0, 0.0)
    """(s, s/s) by how much, for each unit of its size: all along, and more for each second of the record. A rig that
    does not change with time is late by as much as its command is."""
    at_an_angle: bool = False
    """Of the joint: it stands at an angle of the sensor, not at a distance from where the joint rests."""
    in_samples: bool = False
    """It is in the raw samples alone (noise, a line, steps, what is lost) and has no course of its own under a command:
    a controller can do nothing about it, and a diagnosis reads it from the samples instead of fitting it."""

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Names in the order in which the stage reads them."""
        return tuple(number.name for number in self.numbers)

    @property
    def from_rest(self) -> bool:
        """It acts on how far the joint is from where it rests, whatever the sensor shows there."""
        return self.slot is Slot.JOINT and not self.at_an_angle

    def neutral(self) -> dict[str, float]:
        """The parameters that leave the chain as it is (with shapes at their usual values)."""
        return {number.name: number.neutral for number in self.numbers}
