"""The diagnosis as plain data, and its JSON."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rig.channels import PNEUMATIC, Channels
from rig.gap.answer.facts import RAW, SIGNATURE, Evidence, Gap, Retuning, Verdict, Where
from rig.gap.hypotheses.library import UNKNOWN
from rig.gap.plan.experiment import Experiment
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.response.causes import Applied
from rig.own_units import own_plain


@dataclass(frozen=True)
class Interval:
    """A fitted number with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str = "1"

    def to_json(self) -> dict[str, float | str]:
        return {"value": self.value, "low": self.low, "high": self.high, "unit": self.unit}


@dataclass(frozen=True)
class Cause:
    """One named cause."""

    effect: str
    stage: str
    judged_on: str
    """Pressures, angle, or the raw samples (RAW)."""
    applied: Applied | None
    parameters: Mapping[str, Interval]
    gap_before_deg: float
    gap_after_deg: float
    explained_fraction: float
    ambiguous_with: tuple[str, ...]
    confidence: float
    doubted_by: tuple[str, ...] = ()
    """The notes that take it back: what they tell of may have done the same, and it is believed half."""

    @property
    def is_named(self) -> bool:
        """An effect of the library, and not something that it lacks."""
        return self.effect != UNKNOWN

    @property
    def is_raw(self) -> bool:
        """Judged on the raw samples: the smoothed angle need not show it."""
        return self.judged_on in RAW

    def to_json(self) -> dict[str, Any]:
        return {
            "effect": self.effect,
            "stage": self.stage,
            "judged_on": self.judged_on,
            "parameters": {name: number.to_json() for name, number in self.parameters.items()},
            "gap_before_deg": self.gap_before_deg,
            "gap_after_deg": self.gap_after_deg,
            "explained_fraction": self.explained_fraction,
            "ambiguous_with": list(self.ambiguous_with),
            "confidence": self.confidence,
            "probability": self.confidence,
            "doubted_by": list(self.doubted_by),
            "added_to_model": None
            if self.applied is None
            else {"effect": self.applied.stage, "parameters": dict(self.applied.numbers)},
        }


@dataclass(frozen=True)
class Observation:
    """Something that is seen beside the causes, and that explains little or nothing of the gap."""

    test: str
    effect: str | None
    """The effect that it stands for; None for what no effect makes (a gap in the time stamps)."""
    text: str
    parameters: Mapping[str, Interval]
    probability: float
    """That it is there."""
    share: float
    """Of the raw records' mean-square gap; of what it was found on where no raw-data test did."""

    def to_json(self) -> dict[str, Any]:
        return {
            "test": self.test,
            "effect": self.effect,
            "text": self.text,
            "parameters": {name: number.to_json() for name, number in self.parameters.items()},
            "probability": self.probability,
            "share": self.share,
        }


@dataclass(frozen=True)
class Ranked:
    """One line of the ranking."""

    effect: str
    stage: str
    judged_on: str
    explained_fraction: float
    probability: float
    minus_log_evidence: float
    """In nats; 0 of what the raw samples show, which competes with nothing."""

    def to_json(self) -> dict[str, Any]:
        return {
            "effect": self.effect,
            "stage": self.stage,
            "judged_on": self.judged_on,
            "explained_fraction": self.explained_fraction,
            "probability": self.probability,
            "minus_log_evidence_nats": self.minus_log_evidence,
        }


@dataclass(frozen=True)
class Diagnosis:
    """Where, which, how far, and what cannot be told."""

    verdict: Verdict
    confidence: float
    gap: Gap
    where: Where
    causes: Sequence[Cause]
    ranking: Sequence[Ranked]
    next_experiment: Experiment | None = None
    evidence: Evidence = field(default_factory=Evidence)
    notes: Sequence[str] = ()
    """What is to be said of the records and the reference: `doubts` first."""
    doubts: Sequence[str] = ()
    """Those of the notes that doubt whether like is compared with like: records of another rig, or around another P0,
    than what they are compared with."""
    reference: ReferenceKind = ReferenceKind.SESSIONS
    """What stood for the rig without a gap."""
    retuning: Retuning | None = None
    """What re-tuning the simulator's own parameters would close, and which moved."""
    reference_because: str = ""
    """How the reference was chosen."""
    observations: Sequence[Observation] = ()
    """What the raw samples show beside the causes."""
    channels: Channels = PNEUMATIC
    """What the rig's input and output are: all numbers here stand on the working range, `to_json` tells its own."""

    only: Sequence[str] = ()
    """The effects that were asked about, where not all that the rig can have were."""

    @property
    def named(self) -> list[Cause]:
        """The causes that the library has a name for, in their order."""
        return [cause for cause in self.causes if cause.is_named]

    @property
    def added(self) -> list[Applied]:
        """What goes into the simulator and has a course there: the causes without those found by a signature."""
        return [cause.applied for cause in self.causes if cause.applied is not None and cause.judged_on != SIGNATURE]

    def to_json(self) -> dict[str, Any]:
        """The JSON of the command, plain data throughout, in the rig's own units."""
        plain = {
            "verdict": self.verdict.value,
            "reference": self.reference.value,
            "reference_because": self.reference_because,
            "confidence": self.confidence,
            "gap": self.gap.to_json(),
            "retuning": None if self.retuning is None else self.retuning.to_json(),
            "where": self.where.to_json(),
            "causes": [cause.to_json() for cause in self.causes],
            "observations": [one.to_json() for one in self.observations],
            "ranking": [line.to_json() for line in self.ranking],
            "next_experiment": None if self.next_experiment is None else self.next_experiment.to_json(self.channels),
            "evidence": self.evidence.to_json(),
            "notes": list(self.notes),
        }
        in_own_units: dict[str, Any] = own_plain(plain, self.channels)
        return in_own_units if self.channels.has_valves else in_own_units | {"channels": self.channels.plain()}
