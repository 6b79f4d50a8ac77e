"""A scored case as data: what chance decided, how large each effect came out, and for each way of asking a row of what
was said and what of it was right. Read from the JSON of a check and written to it; nothing is judged here.

A check that was scored before a figure was there has no key for it: that figure then counts nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeVar

from cattrs import BaseValidationError, Converter
from cattrs.gen import make_dict_structure_fn, make_dict_unstructure_fn, override

from rig.blind_check.folder import read_json
from rig.blind_check.modes import SISTERS
from rig.errors import RecordError

T = TypeVar("T")
CLEAR_GAP: Final = 3.0
"""Gap over floor from which on the goals hold."""
SIZED: Final = 0.95
"""How closely a size meets its wanted ratio."""


class CaseKind(StrEnum):
    """What is wrong on the rig of a case."""

    NONE = "none"
    SINGLE = "single"
    """One effect of the library."""
    PAIR = "pair"
    FOREIGN = "foreign"
    """An effect that the library does not have."""


@dataclass(frozen=True)
class Truth:
    """What the scorer reads of a label."""

    kind: CaseKind
    effects: tuple[str, ...]
    baselines: int
    """How many earlier days the diagnosis got."""
    family: str = ""
    """Of plants; empty for records that somebody brings."""


@dataclass(frozen=True)
class EffectFact:
    """One effect as it came out."""

    stage: str
    library_parameter: str
    """The number of the library's law that its size can be compared with; empty where there is none."""
    size: float | None = None
    """In the unit of that number."""
    ratio: float | None = None
    """Its own gap over the floor."""


@dataclass(frozen=True)
class Facts:
    """How large a case came out: gap over floor of the angle, by what days or sisters differ by, and of the
    pressures."""

    effects: Mapping[str, EffectFact]
    ratio_angle: float
    ratio_sisters: float | None = None
    ratio_pressure: float | None = None

    def ratio(self, against: str) -> float:
        """Gap over floor by the measure of a way of asking; RecordError where that was not measured."""
        found = self.ratio_sisters if against == SISTERS else self.ratio_angle
        if found is None:
            raise RecordError(f"a case was not measured against {against}, so it cannot be scored by that")
        return found


@dataclass(frozen=True)
class Round:
    """The answer after an experiment that it had recommended, with what that cost and promised."""

    row: "Row"
    minutes: float
    promised: float
    """Confidence expected afterwards."""
    separates: tuple[str, ...] = ()
    parted: bool | None = None
    """Of the effects that it was to tell apart the truth is still named and no other; None where the truth is not
    among them."""


@dataclass(frozen=True)
class Row:
    """One case in one way of asking. What of it was right is None where it was not asked: of a healthy case nothing,
    of a single effect not what pairs are asked, and the other way round."""

    kind: CaseKind
    effects: tuple[str, ...]
    ratio: float
    """Gap over floor."""
    mode: str = ""
    baselines: int = 0
    family: str = ""
    ratio_pressure: float | None = None
    verdict: str = "error"
    """Of the diagnosis; error where there was none."""
    detected: bool = False
    flagged: bool = False
    """Something is there that the library does not hold, alone or beside a name."""
    unknown: bool = False
    """The same, alone."""
    named: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    """The first of them with what it may be mistaken for."""
    stage_said: str | None = None
    confidence: float | None = None
    """Of the first name."""
    predicted_ef: float | None = None
    """Explained fraction that was stated, its interval, and what came true on untouched records that show the
    effect."""
    ef_interval: tuple[float, float] | None = None
    realised_ef: float | None = None
    contradictions: tuple[str, ...] = ()
    reference: str | None = None
    absorbed: bool = False
    """A fit of the simulator's own parameters absorbs the effect."""
    absorbed_right: bool | None = None
    """That was said, with the effect among what would look the same."""
    seconds: float | None = None
    cpu_seconds: float | None = None
    error: str | None = None
    truth_withheld: bool = False
    """The effect was left out of the library."""
    stage_right: bool | None = None
    stages: tuple[str, ...] = ()
    exact: bool | None = None
    class_right: bool | None = None
    in_set: bool | None = None
    size_error: float | None = None
    """Relative; of a single effect under its right name."""
    size_held: bool | None = None
    """The stated interval holds the size."""
    weakest: float | None = None
    """Gap over floor of a pair's smaller effect by itself."""
    both: bool | None = None
    both_class: bool | None = None
    rounds: tuple[Round, ...] = ()
    """After each further experiment."""

    @property
    def has_cause(self) -> bool:
        """Something is wrong on the rig."""
        return self.kind is not CaseKind.NONE

    @property
    def is_clear(self) -> bool:
        """So large that the goals hold."""
        return self.ratio >= CLEAR_GAP

    @property
    def is_nameable(self) -> bool:
        """A clear single effect that no re-tuning absorbs."""
        return self.kind is CaseKind.SINGLE and self.is_clear and not self.absorbed

    @property
    def is_sized_pair(self) -> bool:
        """Two effects of which each by itself is clear."""
        return self.kind is CaseKind.PAIR and self.weakest is not None and self.weakest >= SIZED * CLEAR_GAP


@dataclass(frozen=True)
class Scored:
    """One case, in every way that it was asked."""

    rows: Mapping[str, Row]
    naive: Mapping[str, Mapping[str, str]]
    """With pressures and from the angle alone: simple method -> the name that it gives."""
    sandbox_layers: Sequence[str]
    facts: Mapping[str, Any] = field(default_factory=dict)
    """As the generator told them."""
    token: str = ""

    def to_json(self) -> dict[str, Any]:
        plain: dict[str, Any] = _codec().unstructure(self)
        return plain


def truth_of(label: Mapping[str, Any]) -> Truth:
    """What the scorer reads of a label."""
    return _read(label, Truth, "a label")


def facts_of(plain: Mapping[str, Any]) -> Facts:
    """What the scorer reads of a generator's facts."""
    return _read(plain, Facts, "the facts of a case")


def read_scored(path: Path) -> Scored:
    """A case as it was scored; RecordError when the file is missing or holds something else."""
    return _read(read_json(path), Scored, str(path))


def _read(plain: object, kind: type[T], where: str) -> T:
    try:
        return _codec().structure(plain, kind)
    except (BaseValidationError, ValueError, TypeError, KeyError) as error:
        raise RecordError(f"{where}: is not what a blind check writes: {error}") from None


@cache
def _codec() -> Converter:
    """Keys as they stand in files; a round stands flat beside its answer."""
    codec = Converter(detailed_validation=False)
    codec.register_structure_hook(Round, lambda plain, _: _round(codec, plain))
    codec.register_unstructure_hook(Round, lambda one: codec.unstructure(one.row) | _beside(one))
    names = {"names": override(rename="set"), "class_right": override(rename="class")}
    codec.register_structure_hook(Row, make_dict_structure_fn(Row, codec, **names))  # type: ignore[arg-type]
    codec.register_unstructure_hook(Row, make_dict_unstructure_fn(Row, codec, **names))  # type: ignore[arg-type]
    return codec


def _round(codec: Converter, plain: Mapping[str, Any]) -> Round:
    promise = {name: plain[name] for name in ("minutes", "promised", "parted")}
    return Round(codec.structure(plain, Row), separates=tuple(plain["separates"]), **promise)


def _beside(one: Round) -> dict[str, Any]:
    return {
        "minutes": one.minutes, "promised": one.promised, "separates": list(one.separates), "parted": one.parted
    }  # fmt: skip
