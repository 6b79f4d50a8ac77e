"""What a diagnosis says in numbers beside its causes: how large the gap is, where it lies, what was judged.

Plain data; `to_json` gives each part of the command's JSON.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from rig.gap.raw_tests.signature import Signature
from rig.gap.records.partners import Match

SIGNATURE, RAW_DATA = "signature", "raw data"
"""What an effect of the library leaves in the raw samples, or what no effect makes there."""
RAW = (SIGNATURE, RAW_DATA)
"""Judged on the raw samples: no gap of the smoothed angle need close."""

JUDGED_BESIDE = " beside "
"""Between the name of what was judged and an effect that it was judged beside, in `Evidence.factors`."""


class Verdict(StrEnum):
    """What it comes to."""

    NONE = "none"
    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly_explained"
    """By effects that the library has, and something beside them that it has not."""
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Gap:
    """How far the reference is off, rms in degrees over all records, and how far it is with the causes in it: of the
    smoothed angle, or of its samples where nothing but these shows it."""

    rms_deg: float
    floor_deg: float
    """What is usual without any cause."""
    ratio: float
    """Of the two."""
    explained_fraction: float
    """Share of the mean square above the floor that the causes close."""
    after_deg: float
    after_low_deg: float
    after_high_deg: float
    """90 % interval on further records (`rig.gap.answer.how_far.prediction_interval`)."""
    floor_source: str
    """What the floor rests on: the rig's own days (sessions), or what is usual of such a reference."""
    smoothed_deg: float
    """Of the smoothed angle, whatever the others are of: days are compared by it."""

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class ParameterMove:
    """One of the simulator's own parameters before and after it was fitted again."""

    name: str
    before: float
    after: float
    low: float
    high: float
    """95 % interval of `after`."""
    unit: str
    share: float = 0.0
    """The part that goes with it of all that re-tuning closes (mean square); below zero where it opens some."""

    def to_json(self) -> dict[str, Any]:
        return {
            "name": self.name, "from": self.before, "to": self.after, "low": self.low, "high": self.high,
            "unit": self.unit, "share": self.share
        }  # fmt: skip


@dataclass(frozen=True)
class Retuning:
    """What fitting the simulator's own parameters again would do."""

    before_deg: float
    after_deg: float
    """Rms of the simulator's error on records, or on the half of a single one, that the fit had not seen."""
    moved: tuple[ParameterMove, ...]
    """Parameters that plainly moved, those that close most first."""
    looks_like: tuple[str, ...] = ()
    """Effects that a fit of these parameters absorbs in the same way, in the angle and, ahead of the monitors, in the
    pressures: where it closes the gap, any of them may be what is there."""
    muscles: float = 0.0
    """The part of all that re-tuning closes that goes with the muscles' own curve and loop, whose numbers say nothing
    one by one."""

    @property
    def closes_fraction(self) -> float:
        """Share of the mean square of the simulator's error that goes."""
        return float(np.clip(1.0 - (self.after_deg / max(self.before_deg, 1e-12)) ** 2, 0.0, 1.0))

    def to_json(self) -> dict[str, Any]:
        return {
            "closes_fraction": self.closes_fraction,
            "before_deg": self.before_deg,
            "after_deg": self.after_deg,
            "parameters": [one.to_json() for one in self.moved],
            "looks_like": list(self.looks_like),
            "muscles_share": self.muscles,
        }


@dataclass(frozen=True)
class Link:
    """One stage of the chain, with its share of the gap's mean square."""

    stage: str
    effects: tuple[str, ...]
    share: float

    def to_json(self) -> dict[str, Any]:
        return {"stage": self.stage, "effects": list(self.effects), "share": self.share}


@dataclass(frozen=True)
class OverFrequency:
    """One record's gap over frequency: shares that are constant, excited, at odd and even multiples, and the rest."""

    record: str
    excited_hz: float
    rms_deg: float
    shares: Mapping[str, float]

    def to_json(self) -> dict[str, Any]:
        return {"record": self.record, "excited_hz": self.excited_hz, "rms_deg": self.rms_deg, "shares": self.shares}


@dataclass(frozen=True)
class Band:
    """The gap in one part of the motion, a phase of it or a range of angles."""

    name: str
    share: float
    """Of the gap's mean square."""
    rms_deg: float
    mean_deg: float

    def to_json(self, what: str) -> dict[str, Any]:
        return {what: self.name, "share": self.share, "rms_deg": self.rms_deg, "mean_deg": self.mean_deg}


@dataclass(frozen=True)
class OverTime:
    """One record's gap over time."""

    record: str
    first_quarter_rms_deg: float
    last_quarter_rms_deg: float
    drift_deg_min: float
    step_at_s: float | None
    """Where it steps, if it plainly does."""

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class Where:
    """Where the gap lies; the shares of each breakdown add up to 1."""

    stage: str | None
    """Of the first cause."""
    shares: Mapping[str, float] = field(default_factory=dict)
    """Through the pressures (valve) and from behind them (downstream); none from the angle alone."""
    chain: Sequence[Link] = ()
    frequency: Sequence[OverFrequency] = ()
    phase: Sequence[Band] = ()
    region: Sequence[Band] = ()
    time: Sequence[OverTime] = ()

    def to_json(self) -> dict[str, Any]:
        return {
            "stage": self.stage,
            "shares": dict(self.shares),
            "chain": [link.to_json() for link in self.chain],
            "frequency": [lines.to_json() for lines in self.frequency],
            "phase": [band.to_json("phase") for band in self.phase],
            "region": [band.to_json("angle") for band in self.region],
            "time": [course.to_json() for course in self.time],
        }


@dataclass(frozen=True)
class Judged:
    """What was judged of one factor: the pressures, or the angle."""

    gap: float
    floor: float
    """Rms, in `unit`."""
    unit: str
    found: bool
    probability: Mapping[str, float]
    """Of every hypothesis that is not out of the question."""
    names: Sequence[str]
    """The likeliest that together hold the credible mass."""
    unknown_beside: float
    stage_probability: Mapping[str, float]
    right: float = 1.0
    """Probability that what the answer says of this factor is right, whatever is true of the others."""

    def to_json(self) -> dict[str, Any]:
        return {
            "gap": self.gap, "floor": self.floor, "unit": self.unit, "found": self.found,
            "probability": dict(self.probability), "set": list(self.names), "unknown_beside": self.unknown_beside,
            "stage_probability": dict(self.stage_probability),
        }  # fmt: skip


@dataclass(frozen=True)
class RecordGap:
    """One record's gap without and with the causes, rms."""

    record: str
    gap_before_deg: float
    gap_after_deg: float


@dataclass(frozen=True)
class FeedForwardResidual:
    """What a feed-forward would leave of the records' movements without and with the causes in it, rms."""

    before_deg: float
    after_deg: float


@dataclass(frozen=True)
class Evidence:
    """What the answer rests on."""

    factors: Mapping[str, Judged] = field(default_factory=dict)
    signatures: Sequence[Signature] = ()
    """What the tests on raw samples saw."""
    records: Sequence[RecordGap] = ()
    sessions: int = 0
    pressures_used: bool = False
    unpaired: Sequence[str] = ()
    model_misfit_deg: float | None = None
    """How far the simulator as it stands is from the earlier days, where there are any."""
    pairing: Sequence[Match] = ()
    said: Mapping[str, str] = field(default_factory=dict)
    """Tags and notes of the records."""
    tracking: FeedForwardResidual | None = None
    """Where it was asked for."""

    def to_json(self) -> dict[str, Any]:
        plain: dict[str, Any] = {
            "factors": {name: judged.to_json() for name, judged in self.factors.items()},
            "signatures": [signature.to_json() for signature in self.signatures],
            "records": [asdict(one) for one in self.records],
            "sessions": self.sessions,
            "pressures_used": self.pressures_used,
            "unpaired": list(self.unpaired),
            "model_misfit_deg": self.model_misfit_deg,
            "pairing": [match.to_json() for match in self.pairing],
        }
        tags = {"said": dict(self.said)} if self.said else {}
        return plain | ({} if self.tracking is None else {"tracking": asdict(self.tracking)}) | tags
