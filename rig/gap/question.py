"""What is asked of which records, by which reference and levels."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rig.gap.plan.candidates import SweepEnvelope
from rig.gap.priors import Fitted, fitted
from rig.gap.reference.kinds import ReferenceKind
from rig.model.parameters import Model
from rig.record import Record

ExperimentEvidence = Mapping[str, Mapping[str, float]]
"""Log evidence (nats) of later experiments, by factor and hypothesis; it is added to the prior odds."""


@dataclass(frozen=True)
class Question:
    """What is asked of which records."""

    model: Model | None
    records: Sequence[Record]
    days: Sequence[Sequence[Record]]
    kind: ReferenceKind
    sister: bool = False
    """The simulator was made for another rig of the build, or from data sheets."""
    pressures: bool = True
    library: Sequence[str] | None = None
    experiments: ExperimentEvidence = field(default_factory=dict)
    known_hz: float = np.inf
    """Fastest excitation that the reference is known from, see `Expected`."""
    withheld: Sequence[str] = ()
    """Effects that the rig may have and that are not in the library at hand."""
    any_upstream: bool = True
    """The rig can have an effect ahead of its pressure monitors at all."""
    settings: Fitted = field(default_factory=fitted)
    """The levels and priors to judge by."""
    envelope: SweepEnvelope | None = None
    """What the rig allows the records that are recommended; None: careful bounds."""
