"""Effects with their numbers, as they are asked for and as they run over whole records."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.gap.response.lateness import IN_TIME, Lateness
from rig.model.compiled.stages import over_records
from rig.model.effect_stages import EFFECT_STAGES, goes_on
from rig.model.response.model import ResponseModel
from rig.model.slots import Slot
from rig.record import Column


@dataclass(frozen=True)
class Applied:
    """An effect stage with its numbers; numbers left out come from the nominal rig or stand at their usual values."""

    stage: str
    numbers: Mapping[str, float]

    @property
    def effect(self) -> str:
        return EFFECT_STAGES[self.stage].effect


def full_numbers(applied: Applied, nominal: ResponseModel) -> dict[str, float]:
    """Every number of the stage, the nominal rig's filled in."""
    known, given = EFFECT_STAGES[applied.stage], nominal.stage_numbers
    return known.neutral() | {name: given[name] for name in known.parameters if name in given} | dict(applied.numbers)


@dataclass(frozen=True)
class Ready:
    """An effect stage over whole records, with its numbers in a row, as the compiled function reads them."""

    slot: Slot
    stage: Any
    params: Column
    state_size: int
    exact: bool = False
    """See `EffectStage.exact`."""
    late: Lateness = IN_TIME
    """By how much everything is later, where it is exact and of the timing slot: since it began."""
    from_deg: float = 0.0
    """What the stage takes for 0 deg, as the sensor shows it."""
    whole_session: bool = False
    """It goes on from record to record."""

    def late_in(self, begun_s: float) -> Lateness:
        """By how much everything is later in a record that began so long after its session."""
        return self.late.since(begun_s) if self.whole_session else self.late


def ready(causes: Sequence[Applied], nominal: ResponseModel) -> list[Ready]:
    """The causes as they run, in the order given."""
    made = []
    for cause in causes:
        known = EFFECT_STAGES[cause.stage]
        numbers = full_numbers(cause, nominal)
        params = np.array([numbers[name] for name in known.parameters])
        from_deg = nominal.zero_deg if known.from_rest else 0.0
        stage, state_size = over_records(known.stage), max(known.state_size, 1)
        late = Lateness(*known.late).times(float(params[0]))
        made.append(Ready(known.slot, stage, params, state_size, known.exact, late, from_deg, goes_on(numbers)))
    return made


def named(cause: Ready) -> tuple[object, ...]:
    """What tells a cause from others."""
    return cause.stage, cause.params.tobytes()
