"""How much closer `pamrig track` would follow when its feed-forward has the causes of a diagnosis."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import ConfigError

if TYPE_CHECKING:
    from rig.gains import ClosedLoop
    from rig.gap.answer.result import Diagnosis
    from rig.gap.pipeline import Grounds
    from rig.model.parameters import Model
    from rig.record import Record


def gains_of(reference: Path) -> "ClosedLoop":
    """Those of a reference's YAML; ConfigError when it has none."""
    from rig.app.shipped import find_config
    from rig.excite.sweep import load_sweep

    place = find_config(reference, "references")
    gains = load_sweep(place).closed_loop
    if gains is None:
        raise ConfigError(f"--tracking {place}: closed_loop: gains are missing; `pamrig tune` finds some")
    return gains


def with_feedforward_worth(
    gains: "ClosedLoop",
    model: "Model",
    diagnosis: "Diagnosis",
    grounds: "Grounds",
    records: "Sequence[Record]",
) -> "Diagnosis":
    """The diagnosis with what its causes are worth to a feed-forward, in the evidence and in a note."""
    from rig.control.worth import worth
    from rig.gap.answer.facts import FeedForwardResidual
    from rig.gap.answer.how_far.augment import augmented

    if not any(cause.applied for cause in diagnosis.causes):
        nothing = "no cause with a course of its own was found: the feed-forward stays as it is"
        return replace(diagnosis, notes=[*diagnosis.notes, nothing])
    found = worth(model, augmented(model, diagnosis, grounds.expected), records, gains)
    way = "closer" if found.closer >= 0.0 else "less closely"
    evidence = replace(diagnosis.evidence, tracking=FeedForwardResidual(found.before_deg, found.after_deg))
    note = (
        f"with the causes in it the feed-forward follows {100 * abs(found.closer):.0f} % {way}: of these movements the "
        f"loop would leave {found.after_deg:.2f} deg rms, {found.before_deg:.2f} with the simulator as it was"
    )
    return replace(diagnosis, evidence=evidence, notes=[*diagnosis.notes, note])
