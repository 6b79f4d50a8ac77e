"""Cases of the blind check: which unit of a family, day, excitation, effect and strength. Drawn from a seed; nothing
here is stored.

Development and scoring cases come from different roots of the random tree, so that no seed of one gives a case of the
other. A development case in three lines:

    sheet = draw_sheet(Purpose.DEVELOPMENT, seed=1, n=40, family_name="fluidic")
    made = realise(sheet[0], bench_of(sheet[0]))
    made.records, made.effects, made.ratio_angle   # and bench_of(...).baselines

One with a unit and sizes of one's own:

    made, bench = made_to_order("fluidic", unit_seed=7, sizes={"valve_lag": 0.02}, seed=1)

A `Case` is what chance decided (the label), a `Bench` the unit with its healthy baseline days, which ten cases share,
and a `Made` the case's records with the sizes that give the wanted gap.
"""

import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.random import Generator, SeedSequence

from hil.reference.disturbance import Disturbance, merged
from hil.reference.effect_law import EffectLaw
from hil.reference.excitations import Excitation, draw_set, draw_untouched
from hil.reference.families import Family, Named, Unit, family, run
from hil.reference.names import NAMES
from hil.reference.plant import PlantDay
from hil.reference.sizing import reach
from rig.errors import RigError

CASES_PER_UNIT: Final = 10
BASELINE_DAYS: Final = 6
RECORDS: Final = 7
"""Cases of one unit, healthy days before a case, excitations of a day. Fewer days: what a rig's days differ by is
hardly known."""
SIZED_ON: Final = 4
"""Excitations on which the size of an effect is found."""
RATIO_RANGE: Final = (0.6, 12.0)
"""Gap over floor of single effects, log-uniform: from below the floor to more than ten times above."""
CLEAR_RANGE: Final = (3.0, 10.0)
"""Of each part of a pair, and of effects outside the library."""


class DrawnKind(StrEnum):
    """What is wrong on the rig of a case."""

    NONE = "none"
    SINGLE = "single"
    PAIR = "pair"
    FOREIGN = "foreign"
    """An effect of which the library has no law."""


SHARES: Final = {DrawnKind.NONE: 0.30, DrawnKind.FOREIGN: 0.15, DrawnKind.PAIR: 0.15}
"""Of all cases; the rest are single effects. 400 cases: 120, 60, 60, 160."""
LESS: Final = (1.0, 0.8, 0.6, 0.45, 0.3, 0.2, 0.12, 0.07)
"""Shares of its wanted ratios at which a case is tried whose effects together drive the joint out of its range."""
RAN_AWAY: Final = 1e6
"""Counts as the gap over floor of a size under which the joint leaves its range: far too large."""


DAYS, SISTERS = "days", "sisters"


class Purpose(StrEnum):
    DEVELOPMENT = "development"
    SCORING = "scoring"


_ROOT: Final = {Purpose.DEVELOPMENT: 11_210_011, Purpose.SCORING: 77_300_947}


@dataclass(frozen=True)
class Case:
    """One case as drawn."""

    purpose: Purpose
    seed: int
    number: int
    kind: DrawnKind
    effects: tuple[str, ...]
    signs: tuple[int, ...]
    wanted_ratios: tuple[float, ...]
    """Gap over floor each effect shall have by itself."""
    baselines: int
    """How many baseline days the diagnosis gets: 3 or 6."""
    family: str = NAMES[0]
    against: str = DAYS
    """What its gap is measured by: what days differ by, or what sisters do (for a simulator that was made for another
    rig)."""
    own_zero: bool = False
    """Each record counts the angle from where the joint rested before it."""

    @property
    def unit(self) -> int:
        """Number of the rig it is recorded on, within the sheet."""
        return self.number // CASES_PER_UNIT

    def label(self) -> dict[str, Any]:
        """The case as plain data for sealing; what was not asked for before it could be is not said, so that the
        labels of earlier checks stay what they were."""
        plain = asdict(self) | {"purpose": self.purpose.value, "kind": self.kind.value}
        if not self.own_zero:
            del plain["own_zero"]
        return plain


@dataclass(frozen=True)
class Bench:
    """A unit with its healthy days; every case on it is recorded under the same excitations."""

    family: Family
    plant: Unit
    drift: float
    excitations: tuple[Excitation, ...]
    untouched: tuple[Excitation, ...]
    days: tuple[PlantDay, ...]
    baselines: tuple[Named, ...]
    floor_deg: float
    """Root mean square by which a healthy day's angle differs from the mean of the other days."""
    floor_mpa: float
    """The same of p1 and p2."""
    sister: Named
    """A healthy day of another rig of the build under the same commands."""
    sister_deg: float
    """Root mean square by which its angle differs from the mean of this unit's days."""
    sister_rig: tuple[Unit, PlantDay]
    """That rig, and its day."""

    def scale(self, against: str) -> float:
        """What a gap is measured by, in floors."""
        return self.sister_deg / self.floor_deg if against == SISTERS else 1.0


@dataclass(frozen=True)
class Made:
    """A case carried out: a new day on the bench with the effect switched on."""

    case: Case
    effects: dict[str, dict[str, Any]] = field(repr=False)
    """Effect -> stage, size, unit, library_parameter and its own ratio."""
    disturbance: Disturbance = field(repr=False)
    day: PlantDay = field(repr=False)
    records: Named = field(repr=False)
    ratio_angle: float = 0.0
    ratio_pressure: float = 0.0
    """Gap over floor reached, of the angle and of the monitors."""


def draw_sheet(
    purpose: Purpose,
    seed: int,
    n: int,
    family_name: str = NAMES[0],
    known: Sequence[str] | None = None,
    against: str = DAYS,
) -> list[Case]:
    """n cases in an order that tells nothing; the same arguments give the same sheet.

    `known`: the effects to draw from in place of all that the family has (a library that is short of one cannot be
    asked for it).
    """
    random, chosen = _random(purpose, (family_name, against), seed, 0), family(family_name)
    effects = {name: law for name, law in chosen.effects.items() if known is None or name in known}
    kinds = [kind for kind, share in SHARES.items() for _ in range(round(share * n))]
    kinds += [DrawnKind.SINGLE] * (n - len(kinds))
    singles, foreign, pairs = (
        _endless(random, items) for items in (_alone(effects), _alone(chosen.foreign), _pairs(effects))
    )
    drawn = {
        DrawnKind.NONE: _endless(random, [()]),
        DrawnKind.SINGLE: singles,
        DrawnKind.FOREIGN: foreign,
        DrawnKind.PAIR: pairs,
    }
    rows = [(kind, next(drawn[kind])) for kind in kinds]
    order = random.permutation(n)
    return [
        _draw_case(purpose, seed, number, *rows[int(order[number])], (family_name, against), random)
        for number in range(n)
    ]


def draw_bench(chosen: Family, plant: Unit, random: Generator) -> Bench:
    """A unit's days and excitations, by chance."""
    drift = float(np.exp(random.uniform(math.log(0.004), math.log(0.02))))
    p0_mpa = round(float(random.uniform(0.18, 0.25)), 3)
    excitations, untouched = tuple(draw_set(random, RECORDS, p0_mpa)), tuple(draw_untouched(random, p0_mpa))
    days = tuple(plant.session(int(random.integers(2**31)), drift) for _ in range(BASELINE_DAYS))
    baselines = tuple(record_day(plant, day, excitations) for day in days)
    floors = [
        _floor([np.concatenate([r[column] for r in day.values()]) for day in baselines])
        for column in ("angle_deg", "p1_mpa", "p2_mpa")
    ]
    floor_mpa = math.hypot(floors[1], floors[2])
    other = chosen.make(int(random.integers(2**31)))
    other_day = other.session(int(random.integers(2**31)), drift)
    sister = record_day(other, other_day, excitations)
    return Bench(
        chosen,
        plant,
        drift,
        excitations,
        untouched,
        days,
        baselines,
        floors[0],
        floor_mpa,
        sister,
        _apart(sister, baselines),
        (other, other_day),
    )


@lru_cache(maxsize=4)
def _bench(purpose: Purpose, branch: tuple[str, str], seed: int, number: int, own_zero: bool) -> Bench:
    random, chosen = _random(purpose, branch, seed, 1, number), family(branch[0], own_zero)
    return draw_bench(chosen, chosen.make(int(random.integers(2**31))), random)


def bench_of(case: Case) -> Bench:
    """The unit and its baselines on which the case is recorded."""
    return _bench(case.purpose, (case.family, case.against), case.seed, case.unit, case.own_zero)


def record_day(
    plant: Unit, day: PlantDay, excitations: Sequence[Excitation], disturbance: Disturbance | None = None
) -> Named:
    """Every excitation once on that day, each with noise of its own; names are unique."""
    named: Named = {}
    for number, excitation in enumerate(excitations):
        name = excitation.name if excitation.name not in named else f"{excitation.name}_{number}"
        named[name] = run(excitation, plant, day, disturbance, noise_seed=number)
    return named


def realise(case: Case, bench: Bench, sizes: Mapping[str, float] | None = None) -> Made:
    """The case's records, its effects sized so that each has its wanted gap over the floor (or the largest it can
    have).

    `sizes` from an earlier call spare the search.
    """
    random = _random(case.purpose, (case.family, case.against), case.seed, 2, case.number)
    day = bench.plant.session(int(random.integers(2**31)), bench.drift)
    parts: list[Disturbance] = []
    effects: dict[str, dict[str, Any]] = {}
    for effect, sign, wanted in zip(case.effects, case.signs, case.wanted_ratios, strict=True):
        entry, detail = bench.family.laws[effect], int(random.integers(2**31))
        scale = bench.scale(case.against)
        size, ratio = (
            (sizes[effect], wanted * scale) if sizes else _size_for(entry, sign, wanted * scale, detail, day, bench)
        )
        parts.append(entry.law(size, np.random.default_rng(detail)))
        effects[effect] = {
            "stage": entry.stage, "size": size, "unit": entry.unit, "library_parameter": entry.library_parameter,
            "ratio": ratio / scale
        }  # fmt: skip
    return _recorded(case, effects, merged(bench.family.healthy, parts), day, bench)


def realise_in_range(case: Case, bench: Bench) -> tuple[Made, Named]:
    """The case with the untouched records of its day. Effects that only together drive the joint out of its range are
    all made smaller until they do not; RigError when the smallest of LESS still do."""
    for less in LESS[:-1]:
        with suppress(RigError):
            return _with_untouched(case, bench, less)
    return _with_untouched(case, bench, LESS[-1])


def _with_untouched(case: Case, bench: Bench, less: float) -> tuple[Made, Named]:
    made = realise(replace(case, wanted_ratios=tuple(less * ratio for ratio in case.wanted_ratios)), bench)
    return made, record_day(bench.plant, made.day, bench.untouched, made.disturbance)


@lru_cache(maxsize=4)
def _bench_to_order(family_name: str, unit_seed: int, seed: int) -> Bench:
    random, chosen = _random(Purpose.DEVELOPMENT, (family_name, DAYS), seed, 3, unit_seed), family(family_name)
    return draw_bench(chosen, chosen.make(unit_seed), random)


def made_to_order(family_name: str, unit_seed: int, sizes: Mapping[str, float], seed: int) -> tuple[Made, Bench]:
    """A case with these effects (name -> signed size, none for a healthy one) on that unit, and the unit's healthy
    days.

    Days, excitations and what is no size come from `seed`. RigError for a family or an effect that is not there.
    """
    bench = _bench_to_order(family_name, unit_seed, seed)
    signs, kind = (
        tuple(1 if size >= 0.0 else -1 for size in sizes.values()),
        (DrawnKind.NONE, DrawnKind.SINGLE, DrawnKind.PAIR)[min(len(sizes), 2)],
    )
    case = Case(
        Purpose.DEVELOPMENT, seed, 0, kind, tuple(sizes), signs, (math.nan,) * len(sizes), BASELINE_DAYS, family_name
    )
    return realise(case, bench, sizes), bench


def _recorded(
    case: Case, effects: dict[str, dict[str, Any]], disturbance: Disturbance, day: PlantDay, bench: Bench
) -> Made:
    records = record_day(bench.plant, day, bench.excitations, disturbance)
    angle, pressure = _ratios(records, record_day(bench.plant, day, bench.excitations), bench)
    return Made(case, effects, disturbance, day, records, angle, pressure)


def _draw_case(
    purpose: Purpose,
    seed: int,
    number: int,
    kind: DrawnKind,
    effects: tuple[str, ...],
    branch: tuple[str, str],
    random: Generator,
) -> Case:
    laws = family(branch[0]).laws
    low, high = RATIO_RANGE if kind is DrawnKind.SINGLE else CLEAR_RANGE
    ratios = np.exp(random.uniform(math.log(low), math.log(high), len(effects))).tolist()
    signs = [int(random.choice((-1, 1))) if laws[effect].signed else 1 for effect in effects]
    return Case(purpose, seed, number, kind, effects, tuple(signs), tuple(ratios), int(random.choice((3, 6))), *branch)


def _size_for(
    entry: EffectLaw, sign: int, wanted: float, detail: int, day: PlantDay, bench: Bench
) -> tuple[float, float]:
    """The signed size whose gap is `wanted` floors on some of the excitations, and the ratio it has."""
    some = bench.excitations[:SIZED_ON]
    healthy = record_day(bench.plant, day, some)

    def ratio(log_size: float) -> float:
        law = entry.law(sign * math.exp(log_size), np.random.default_rng(detail))
        try:
            return _ratios(record_day(bench.plant, day, some, law), healthy, bench)[0]
        except RigError:
            return RAN_AWAY

    weak, strong = math.log(entry.low), math.log(entry.high)
    if entry.falling:
        weak, strong = strong, weak
    size, reached = reach(ratio, wanted, weak, strong)
    return sign * math.exp(size), reached


def _ratios(records: Named, healthy: Named, bench: Bench) -> tuple[float, float]:
    """(angle, monitors): root mean square change of all records over the bench's floor."""

    def change_rms(column: str) -> float:
        powers = [np.mean((records[name][column] - healthy[name][column]) ** 2) for name in records]
        return math.sqrt(float(np.mean(powers)))

    change = {column: change_rms(column) for column in ("angle_deg", "p1_mpa", "p2_mpa")}
    return change["angle_deg"] / bench.floor_deg, math.hypot(change["p1_mpa"], change["p2_mpa"]) / bench.floor_mpa


def _floor(days: list[Any]) -> float:
    total = np.sum(days, axis=0)
    return math.sqrt(float(np.mean([np.mean((day - (total - day) / (len(days) - 1)) ** 2) for day in days])))


def _alone(laws: Mapping[str, EffectLaw]) -> list[tuple[str, ...]]:
    return [(effect,) for effect in laws]


def _pairs(laws: Mapping[str, EffectLaw]) -> list[tuple[str, ...]]:
    """One valve-side and one joint-side effect."""
    valves, joints = ([name for name, law in laws.items() if law.stage == stage] for stage in ("valve", "joint"))
    return [(valve, joint) for valve in valves for joint in joints]


def _endless(random: Generator, items: list[tuple[str, ...]]) -> Iterator[tuple[str, ...]]:
    """The items in random order, each once before any comes again; RigError where there are none to draw from."""
    if not items:
        raise RigError("too few effects are known: no case of a kind that is asked for can be drawn from them")
    while True:
        for index in random.permutation(len(items)):
            yield items[int(index)]


def _apart(sister: Named, days: Sequence[Named]) -> float:
    """Root mean square of the angle (deg) by which a rig differs from another's mean day."""
    means = {name: np.mean([day[name]["angle_deg"] for day in days], axis=0) for name in sister}
    return math.sqrt(float(np.mean([np.mean((sister[name]["angle_deg"] - means[name]) ** 2) for name in sister])))


def _random(purpose: Purpose, branch: tuple[str, str], *path: int) -> Generator:
    """A branch of the random tree by family and measure; the first family's is the one from before there was
    another."""
    names = [name for name in branch if name not in (NAMES[0], DAYS)]
    return np.random.default_rng(
        SeedSequence((_ROOT[purpose], *path), spawn_key=[zlib.crc32(name.encode()) for name in names])
    )
