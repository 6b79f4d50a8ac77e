"""What the steps of a diagnosis hand on: the prepared records, and a side after judgement. Nothing is computed here."""

from dataclasses import dataclass, replace

from rig.gap.days.attribute import Candidate
from rig.gap.days.bench import Bench
from rig.gap.days.side import Side
from rig.gap.days.trigger import Trigger
from rig.gap.hypotheses.propagate import Track
from rig.gap.records.pairs import Pair, Pairing
from rig.gap.reference.nominal import Nominal, Reference


@dataclass(frozen=True)
class Prepared:
    """Everything that the sides are judged with."""

    pairing: Pairing
    tracks: list[Track]
    nominal: Nominal
    has_baseline: bool
    noise_deg: float

    @property
    def pairs(self) -> list[Pair]:
        return self.pairing.pairs

    @property
    def references(self) -> list[Reference]:
        return [track.reference for track in self.tracks]


@dataclass(frozen=True)
class Judged:
    """One side after judgement."""

    side: Side
    trigger: Trigger
    bench: Bench
    ranking: list[Candidate]
    chances: list[float]
    names: list[str]
    accepted: list[Candidate]
    """The causes that explain it, strongest first; empty when it has no gap or none explains it."""
    fraction: float
    """Explained fraction of the side's own gap by the accepted causes, or by the best candidate when none is
    accepted."""
    remainder: bool = False
    """More is left than the laws of the accepted causes, or of any other name in the set, usually leave: something
    unknown is there."""

    @property
    def open(self) -> bool:
        """Whether a gap is there that nothing, or not all of it, explains."""
        return self.trigger.found and (not self.accepted or self.remainder)


def untriggered(judged: Judged) -> Judged:
    """The side without its gap: what was found is laid to something that is no cause."""
    return replace(
        judged,
        trigger=replace(judged.trigger, found=False),
        ranking=[],
        chances=[],
        names=[],
        accepted=[],
        fraction=0.0,
    )
