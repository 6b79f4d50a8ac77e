"""The plant families as a source of cases for the blind check: labels in, columns out.

Fits the protocol of `rig.blind_check.source` by its shape; knows nothing of records, files or diagnosis.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hil.reference.cases import (
    DAYS,
    SISTERS,
    Case,
    DrawnKind,
    Purpose,
    bench_of,
    draw_sheet,
    realise,
    realise_in_range,
    record_day,
)
from hil.reference.compiling import Array
from hil.reference.disturbance import Disturbance
from hil.reference.families import Named, Unit
from hil.reference.names import NAMES
from hil.reference.plant import PlantDay
from rig.errors import RigError

Commands = Mapping[str, tuple[Array, Array, float]]
UNTOUCHED_DAYS = 3
"""Healthy days of a bench on which the excitations that no case uses are recorded as well."""
NOISE_OF_REPEATS = 1000
"""Seeds of the noise of repeated cases are multiples of this, beyond those of any excitation of the bench."""


@dataclass(frozen=True)
class PlantBench:
    """See rig.blind_check.source.BenchData."""

    p0_mpa: float
    baselines: list[Named]
    untouched: list[Named]
    sister: Named


@dataclass(frozen=True)
class PlantCase:
    """See rig.blind_check.source.CaseData."""

    records: Named
    untouched: Named
    facts: dict[str, Any]


@dataclass(frozen=True)
class PhysicsSource:
    """Cases of one purpose, shared out evenly among the families and measures; a development source never gives a
    scoring case."""

    purpose: Purpose = Purpose.SCORING
    families: tuple[str, ...] = NAMES[:1]
    against: tuple[str, ...] = (DAYS,)
    known: tuple[str, ...] | None = None
    """Effects to draw from; all of the family's unless said."""
    session: Commands | None = None
    """Set-points that every day is recorded under, in place of excitations drawn for each unit. Effects keep the sizes
    that they have under those, so that sessions can be compared on the same cases."""
    own_zero: bool = False
    """Each record counts the angle from where the joint rested before it, as those of pamrig's own loop do."""

    @property
    def recorded_under(self) -> str:
        """Names the session; empty for drawn excitations."""
        if self.session is None:
            return ""
        parts = [name.encode() + p1.tobytes() + p2.tobytes() for name, (p1, p2, _) in self.session.items()]
        return hashlib.sha256(b"".join(parts)).hexdigest()

    @property
    def can_repeat(self) -> bool:
        """Recommended experiments can be carried out."""
        return True

    def sheet(self, seed: int, cases: int) -> list[dict[str, Any]]:
        parts = [(family, against) for family in self.families for against in self.against]
        shares = [cases * (k + 1) // len(parts) - cases * k // len(parts) for k in range(len(parts))]
        sheets = [
            draw_sheet(self.purpose, seed, share, family, self.known, against)
            for share, (family, against) in zip(shares, parts, strict=True)
        ]
        return [replace(case, own_zero=self.own_zero).label() for sheet in sheets for case in sheet]

    def bench_key(self, label: dict[str, Any]) -> str:
        case = _case(label)
        return f"{case.family}-{case.against}-{case.seed}-{case.unit}{'-own-zero' if case.own_zero else ''}"

    def bench(self, label: dict[str, Any]) -> PlantBench:
        bench = bench_of(_case(label))
        untouched = [record_day(bench.plant, day, bench.untouched) for day in bench.days[:UNTOUCHED_DAYS]]
        if self.session is None:
            return PlantBench(bench.excitations[0].p0_mpa, list(bench.baselines), untouched, bench.sister)
        days = [played(bench.plant, day, bench.family.healthy, self.session) for day in bench.days]
        sister = played(*bench.sister_rig, bench.family.healthy, self.session)
        return PlantBench(_rest_mpa(self.session), days, untouched, sister)

    def case(self, label: dict[str, Any]) -> PlantCase:
        case = _case(label)
        bench = bench_of(case)
        made, untouched = realise_in_range(case, bench)
        facts = {"effects": made.effects, "ratio_angle": made.ratio_angle, "ratio_pressure": made.ratio_pressure}
        facts |= {"ratio_sisters": made.ratio_angle / bench.scale(SISTERS)}
        facts |= {"floor_deg": bench.floor_deg, "sister_deg": bench.sister_deg, "drift": bench.drift}
        records = made.records
        if self.session is not None:
            records = played(bench.plant, made.day, made.disturbance, self.session)
        return PlantCase(records, untouched, facts)

    def repeat(self, label: dict[str, Any], facts: Mapping[str, Any], commands: Commands, number: int) -> Named:
        case = _case(label)
        bench = bench_of(case)
        made = realise(case, bench, {effect: fact["size"] for effect, fact in facts["effects"].items()})
        return played(bench.plant, made.day, made.disturbance, commands, NOISE_OF_REPEATS * number)


def _case(label: dict[str, Any]) -> Case:
    lists = {name: tuple(label[name]) for name in ("effects", "signs", "wanted_ratios")}
    return Case(**label | lists | {"purpose": Purpose(label["purpose"]), "kind": DrawnKind(label["kind"])})


def _rest_mpa(session: Commands) -> float:
    """Rest pressure of most records."""
    return round(float(np.median([np.median(0.5 * (p1 + p2)) for p1, p2, _ in session.values()])), 3)


def played(plant: Unit, day: PlantDay, disturbance: Disturbance, commands: Commands, noise_seed: int = 0) -> Named:
    """Given set-points on that day, with noise from that seed on. A record under which the joint leaves its range is
    missing, as on a rig whose guard ends it; RigError where all are."""
    records: Named = {}
    ran_away: RigError | None = None
    for number, (name, (p1, p2, period_s)) in enumerate(commands.items()):
        set_points = np.asarray(p1), np.asarray(p2)
        try:
            records[name] = plant.simulate(*set_points, period_s, day, disturbance, noise_seed=noise_seed + number)
        except RigError as error:
            ran_away = error
    if ran_away is not None and not records:
        raise ran_away
    return records
