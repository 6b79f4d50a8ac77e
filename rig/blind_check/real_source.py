"""Anybody's records as a source of cases for the blind check: effects of sensor and time base are put into them
exactly.

Fits the protocol of `rig.blind_check.source`. A unit of work is one session held out: it is the day on which the
effects appear, the others are the earlier days. Of a single session another reading stands for each other day: the same
records with the sensor's noise drawn once more, so that nothing is learnt of what days differ by.
"""

import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import cycle, pairwise
from pathlib import Path
from random import Random
from typing import Any, Final

import numpy as np

from rig.blind_check.put_in import PUT_IN, PutIn, reread
from rig.blind_check.row import CaseKind
from rig.blind_check.source import Columns, Commands, Label, Named
from rig.columns import rms, white_noise
from rig.conditions import commanded_rest
from rig.errors import RecordError
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.records.usable import reasons, usable_of
from rig.model.resample import is_regular
from rig.record import MAIN_COLUMNS, Column, Record

CASE_SHARES: Final = {CaseKind.NONE: 0.30, CaseKind.FOREIGN: 0.15, CaseKind.PAIR: 0.15}
"""Of all cases, as for the plants; the rest are single effects."""
SINGLE_RATIOS: Final = (0.6, 12.0)
MULTIPLE_RATIOS: Final = (3.0, 10.0)
"""Gap over floor, drawn evenly in its logarithm: of single effects; of each of a pair and of effects of no library."""
DAY_SHARE: Final = 0.01
"""What days differ by where one session is all there is, as a share of the angle's rms: the plants' days differ by 0.5
to 2 %."""
KEPT: Final = 3
"""Every third record is kept from all diagnoses where a session has as many, ..."""
GIVEN: Final = 0.7
"""... else the last part of each: this share is given."""
SIZE_HALVINGS: Final = 24
"""Halvings in the search of a size: to a part in ten millions of its range's logarithm."""
LEAST_READINGS: Final = 2
"""Days beside which the held-back records are scored."""
PAIRED: Final = ("sensor_gain", "sensor_offset", "sensor_nonlinearity", "sensor_drift")
"""What stands beside a delay in a pair."""


@dataclass(frozen=True)
class RealBench:
    """See rig.blind_check.source.BenchData."""

    p0_mpa: float
    baselines: list[Named]
    untouched: list[Named]
    sister: Named


@dataclass(frozen=True)
class PutInCase:
    """See rig.blind_check.source.CaseData."""

    records: Named
    untouched: Named
    facts: dict[str, Any]


@dataclass(frozen=True)
class RecordsSource:
    """The sessions of a folder: folders of records, or the records of one session."""

    folder: Path

    @property
    def can_repeat(self) -> bool:
        """Nobody has the rig."""
        return False

    @property
    def recorded_under(self) -> str:
        """What the records were made under is their own."""
        return ""

    def sheet(self, seed: int, cases: int) -> list[Label]:
        random, count = Random(f"records by {seed}"), len(_sessions(self.folder))
        kinds = [kind for kind, share in CASE_SHARES.items() for _ in range(round(share * cases))]
        kinds += [CaseKind.SINGLE] * (cases - len(kinds))
        drawn = {kind: _endless(random, _of_kind(kind)) for kind in CaseKind}
        labels = [self._label(seed, number, kind, next(drawn[kind]), random) for number, kind in enumerate(kinds)]
        random.shuffle(labels)
        return [label | {"held": number % count} for number, label in enumerate(labels)]

    def _label(self, seed: int, number: int, kind: CaseKind, effects: Sequence[str], random: Random) -> Label:
        low, high = np.log(SINGLE_RATIOS if kind is CaseKind.SINGLE else MULTIPLE_RATIOS)
        return {
            "kind": kind.value, "effects": list(effects), "seed": seed, "number": number, "family": self.folder.name,
            "baselines": max(len(_sessions(self.folder)) - 1, 1), "against": "days",
            "signs": [random.choice((-1, 1)) if PUT_IN[name].signed else 1 for name in effects],
            "wanted_ratios": [float(np.exp(random.uniform(low, high))) for _ in effects],
        }  # fmt: skip

    def bench_key(self, label: Label) -> str:
        return f"{self.folder.name}-{label['held']}"

    def bench(self, label: Label) -> RealBench:
        held = _held(self.folder, int(label["held"]))
        untouched = [day.untouched for day in (*held.days, *held.readings)][: max(len(held.days), LEAST_READINGS)]
        return RealBench(held.p0_mpa, [_named(day.given) for day in held.days], list(map(_named, untouched)), {})

    def case(self, label: Label) -> PutInCase:
        held = _held(self.folder, int(label["held"]))
        random = np.random.default_rng(zlib.crc32(f"{label['seed']} {label['number']}".encode()))
        whole = day = held.day if held.several else _again(held.day, int(random.integers(2**31)))
        facts = {}
        for name, sign, wanted in zip(label["effects"], label["signs"], label["wanted_ratios"], strict=True):
            law, seed = PUT_IN[name], int(random.integers(2**31))
            size = sign * _size_for(law, sign, wanted, held, seed)
            own = _ratio(_put(law, size, whole, seed), whole, held)
            facts[name] = {
                "stage": law.stage, "size": size, "unit": law.unit, "library_parameter": law.number, "ratio": own,
            }  # fmt: skip
            day = _put(law, size, day, seed)
        ratio = _ratio(day, whole, held)
        case_facts = {"effects": facts, "ratio_angle": ratio, "ratio_sisters": ratio, "ratio_pressure": None}
        return PutInCase(_named(day.given), _named(day.untouched), case_facts | {"floor_deg": held.floor_deg})

    def repeat(self, label: Label, facts: Mapping[str, Any], commands: Commands, number: int) -> Named:
        raise RecordError(f"{self.folder}: nothing can be recorded anew on a rig of which there are records alone")


@dataclass(frozen=True, eq=False)
class RecordedDay:
    """One session: what a diagnosis gets, and what is kept from all of them."""

    given: tuple[Record, ...]
    untouched: tuple[Record, ...]

    @property
    def angles(self) -> list[Column]:
        """(n,) the angle (deg) of every record, those that are given first."""
        return [np.asarray(record.angle_deg) for record in (*self.given, *self.untouched)]


@dataclass(frozen=True, eq=False)
class Held:
    """A session that is held out to be the case's day, and its earlier days."""

    day: RecordedDay
    days: tuple[RecordedDay, ...]
    readings: tuple[RecordedDay, ...]
    """The earlier days read once more."""
    p0_mpa: float
    floor_deg: float
    """Rms by which the angles of healthy days differ."""
    span_deg: float
    several: bool
    """There are other sessions than this one."""


@lru_cache(maxsize=4)
def _sessions(folder: Path) -> tuple[RecordedDay, ...]:
    """RecordError when a session holds nothing that a diagnosis could use."""
    from rig.log.reader import read

    inside = [entry for entry in sorted(folder.iterdir()) if not entry.name.startswith(".")] if folder.is_dir() else []
    several = len(inside) > 1 and all(entry.is_dir() for entry in inside)
    return tuple(_day(place, read(place)) for place in (inside if several else [folder]))


def _day(place: Path, records: Sequence[Record]) -> RecordedDay:
    used, notes = usable_of(records)
    fit = [_even(record) for record in used]
    if not fit:
        raise RecordError(f"{place}: {reasons(notes)}")
    if len(fit) >= KEPT:
        return RecordedDay(tuple(r for k, r in enumerate(fit) if k % KEPT != KEPT - 1), tuple(fit[KEPT - 1 :: KEPT]))
    cut = [(record.rows(slice(0, row)), record.rows(slice(row, None)))
           for record in fit for row in [round(GIVEN * len(record))]]  # fmt: skip
    return RecordedDay(tuple(first for first, _ in cut), tuple(_later(second) for _, second in cut))


def _later(record: Record) -> Record:
    return replace(record, name=f"{record.name}_later", t_s=record.t_s - record.t_s[0])


def _even(record: Record) -> Record:
    """The record on an even time base without missing values: effects and identification want one."""
    measured = np.isfinite(np.asarray(record.angle_deg))
    t = (
        record.t_s
        if is_regular(record, record.period_s) and measured.all()
        else np.arange(record.t_s[0], record.t_s[-1], record.period_s)
    )
    columns = {
        name: np.interp(t, record.t_s[np.isfinite(column)], column[np.isfinite(column)])
        for name in MAIN_COLUMNS
        if name != "t_s" and (column := getattr(record, name)) is not None
    }
    return Record(name=record.name, t_s=t - t[0], facts=record.facts, **columns)


@lru_cache(maxsize=4)
def _held(folder: Path, number: int) -> Held:
    sessions = _sessions(folder)
    day = sessions[number]
    others = tuple(session for k, session in enumerate(sessions) if k != number) or (_again(day, 1),)
    rests = [rest for record in day.given if (rest := commanded_rest(record)) is not None]
    readings = tuple(_again(one, 2 + k) for k, one in enumerate((*others, day)))
    span = max(float(np.ptp(angle)) for angle in day.angles)
    return Held(
        day, others, readings, float(np.median(rests)) if rests else 0.2, _floor_deg(sessions), span, len(sessions) > 1
    )


def _again(day: RecordedDay, seed: int) -> RecordedDay:
    """The same session read once more: the sensor's step and its noise drawn anew."""
    random = np.random.default_rng(seed)

    def read(record: Record) -> Record:
        angle = np.asarray(record.angle_deg)
        steps = np.abs(np.diff(np.unique(angle)))
        half = 0.5 * float(np.median(steps)) if len(steps) else 0.0
        noise = min(white_noise([angle]), half or np.inf) * random.standard_normal(len(angle))
        return reread(record, lambda each: each + half * random.uniform(-1.0, 1.0, len(each)) + noise)

    return RecordedDay(tuple(map(read, day.given)), tuple(map(read, day.untouched)))


def _floor_deg(sessions: Sequence[RecordedDay]) -> float:
    """What the sessions' angles differ by (rms), or a share of their motion where there is one."""
    moved = [angle - angle.mean() for angle in sessions[0].angles]
    if len(sessions) == 1:
        return DAY_SHARE * rms(np.concatenate(moved))
    return float(np.sqrt(np.mean([_apart(one, two) ** 2 for one, two in pairwise(sessions)])))


def _apart(one: RecordedDay, two: RecordedDay) -> float:
    rows = [min(len(a), len(b)) for a, b in zip(one.angles, two.angles, strict=False)]
    parts = [a[:n] - b[:n] for a, b, n in zip(one.angles, two.angles, rows, strict=False)]
    return rms(np.concatenate(parts))


def _put(law: PutIn, size: float, day: RecordedDay, seed: int) -> RecordedDay:
    random = np.random.default_rng(seed)
    given = tuple(law.put(record, size, random) for record in day.given)
    return RecordedDay(given, tuple(law.put(record, size, random) for record in day.untouched))


def _ratio(day: RecordedDay, whole: RecordedDay, held: Held) -> float:
    """Gap over floor of a changed day beside the same without the change."""
    return rms(np.concatenate(day.angles) - np.concatenate(whole.angles)) / held.floor_deg


def _size_for(law: PutIn, sign: int, wanted: float, held: Held, seed: int) -> float:
    """The size whose gap is `wanted` floors, or the largest there may be."""
    low, high = np.log(law.bounds(held.span_deg))
    for _ in range(SIZE_HALVINGS):
        middle = 0.5 * (low + high)
        more = _ratio(_put(law, sign * float(np.exp(middle)), held.day, seed), held.day, held) < wanted
        low, high = (middle, high) if more else (low, middle)
    return float(np.exp(0.5 * (low + high)))


def _of_kind(kind: CaseKind) -> list[tuple[str, ...]]:
    in_library = [name for name, law in PUT_IN.items() if law.in_library and name in LIBRARY]
    kinds: dict[CaseKind, list[tuple[str, ...]]] = {
        CaseKind.NONE: [()],
        CaseKind.SINGLE: [(name,) for name in in_library],
        CaseKind.PAIR: [("delay", name) for name in PAIRED],
        CaseKind.FOREIGN: [(name,) for name, law in PUT_IN.items() if not law.in_library],
    }
    return kinds[kind]


def _endless(random: Random, items: list[tuple[str, ...]]) -> Iterator[tuple[str, ...]]:
    return cycle(random.sample(items, len(items)))


def _named(records: "RecordedDay | Sequence[Record]") -> Named:
    some = records.given if isinstance(records, RecordedDay) else records
    return {record.name: _columns(record) for record in some}


def _columns(record: Record) -> Columns:
    return {name: column for name in MAIN_COLUMNS if (column := getattr(record, name)) is not None}
