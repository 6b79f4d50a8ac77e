"""What a reference expects of the records, and how surely: what every step of a diagnosis is given."""

from dataclasses import dataclass, replace

import numpy as np

from rig.gap.records.pairs import Pair, Pairing
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.reference.monitors import Misread
from rig.gap.response.propagate import RecordContext
from rig.model.response.model import ResponseModel
from rig.record import Column

UNCORRECTED = "uncorrected"
"""Levels of a fingerprint that does not say what its regulators are beside a dead time and a lag: too few records, or
an older file."""
SISTER = "sister"
"""Levels of a simulator that was made for another rig of the build, or from data sheets."""


@dataclass(frozen=True)
class Expected:
    """A reference brought to the records."""

    kind: ReferenceKind
    levels: str
    """Which levels say how surely it knows the rig."""
    pairing: Pairing
    contexts: list[RecordContext]
    response: ResponseModel
    base: tuple[Column, ...]
    """Expected angle of each record, under its measured pressures where there are any."""
    missed_mpa: float = 0.0
    missed_deg: float = 0.0
    """Rms by which the reference misses the very records that it was made from, where that is known."""
    signatures_deg2: float = 0.0
    """Mean square that hum and noise leave in the smoothed angle, where the raw-data tests found them: they are
    explained, and no gap of the smoothed records."""
    step_deg: float = 0.0
    """A converter's step that those tests found; what rounding leaves is no gap either."""
    planned: bool = False
    """The records are not made yet, and answer exactly as the reference expects."""
    unrepeated_mpa: float = 0.0
    unrepeated_deg: float = 0.0
    """Rms by which planned records will be off because the rig does not repeat itself exactly; measured ones show
    it."""
    unsure_lag_s: float = 0.0
    """Lag that is not known because the records are coarser than the simulator's steps: they do not say when between
    two rows a command was written."""
    misread: Misread | None = None
    """What the monitors misread, once the pressures have been judged."""
    known_hz: float = np.inf
    """Fastest excitation that the reference is known from: faster experiments are expected less surely."""
    mean_unseen: bool = False
    """The records lie at a mean pressure that the reference has never seen."""
    other_zero: bool = False
    """The reference is another rig's simulator that has a zero of its sensor among its parameters."""

    @property
    def zeroed(self) -> bool:
        """The angle at rest was taken for zero at the start of each record: whatever turns the joint there, a fault of
        the valves or a play, is not in the records, and no reference knows by how much."""
        return all(pair.zeroed for pair in self.pairs)

    @property
    def pairs(self) -> list[Pair]:
        """The records beside their earlier days."""
        return [context.pair for context in self.contexts]

    @property
    def beside_records(self) -> bool:
        """Records of the same sweeps stand for the rig without a gap: of earlier days, or those that a fingerprint
        keeps."""
        return self.pairing.day_count > 0

    @property
    def driven(self) -> bool:
        """Both factors count: the angle is expected under the measured pressures."""
        return self.pairing.pressures


def read_right(expected: Expected, wrong: Misread) -> Expected:
    """The same with the angle expected under the pressures less what their monitors misread."""
    response = expected.response

    def base(context: RecordContext, angle: Column) -> Column:
        p1, p2, dt_s = context.pair.case.p1_mpa, context.pair.case.p2_mpa, context.pair.dt_s
        if p1 is None or p2 is None:
            return angle
        one, other = wrong.offset_mpa
        return angle + response.angle(p1 - one, p2 - other, dt_s) - response.angle(p1, p2, dt_s)

    return replace(expected, base=tuple(map(base, expected.contexts, expected.base)), misread=wrong)


def as_referred(expected: Expected) -> Expected:
    """The same as if both pressures were the reference's, whatever the monitors read, and the joint moved by those."""
    contexts = [_with_reference_pressures(context) for context in expected.contexts]
    return replace(expected, contexts=contexts, base=tuple(context.reference.angle_deg for context in contexts))


def _with_reference_pressures(context: RecordContext) -> RecordContext:
    pair, reference = context.pair, context.reference
    case = replace(pair.case, p1_mpa=reference.p1_mpa, p2_mpa=reference.p2_mpa)
    return replace(context, pair=replace(pair, case=case))
