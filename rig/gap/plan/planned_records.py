"""Planned records: what the reference expects of records that were not made yet, for the likelihood to be asked about
them beforehand."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rig.errors import ModelError
from rig.excite.run_plan import RunPlan
from rig.excite.setpoints import around
from rig.gap.hypotheses.inverse_problems import ANGLE, PRESSURES, InverseProblem, angle_problem, pressure_problem
from rig.gap.plan.settings import ANGLE_MARGIN
from rig.gap.priors import Fitted
from rig.gap.records.grid import Pair, RunColumns
from rig.gap.records.pairs import Pairing
from rig.gap.reference.build import from_response
from rig.gap.reference.expectation import line_noise
from rig.gap.reference.expected import Expected
from rig.gap.reference.faster_records import known_by_hz
from rig.gap.reference.gaps import rms_of
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.reference.own_days import angle_days, pressure_days
from rig.gap.reference.unrepeated import of_contexts
from rig.gap.response.propagate import RecordContext
from rig.identify.response.response_fit import GRID_S
from rig.model.external.simulator import KIND as EXTERNAL
from rig.model.parameters import Model
from rig.model.response.model import ResponseModel
from rig.model.simulation import simulate
from rig.record import Column, Record


@dataclass(frozen=True)
class Noise:
    """White noise of the sensor (deg) and of the monitors (MPa), one standard deviation."""

    angle_deg: float = 0.02
    pressure_mpa: float = 3e-4


@dataclass(frozen=True)
class KnownRig:
    """What is known of a rig before a record is made."""

    response: ResponseModel
    levels: str
    """Which levels say how surely it is known, see `rig.gap.priors.Fitted`."""
    pressures: bool = True
    """The regulators' monitors are recorded."""
    noise: Noise = Noise()
    kind: ReferenceKind = ReferenceKind.FINGERPRINT
    missed_mpa: float = 0.0
    missed_deg: float = 0.0
    """Rms by which the reference misses the records that it was made from, where that is known; see `Expected`."""
    unrepeated_mpa: float = 0.0
    unrepeated_deg: float = 0.0
    """Rms by which a further record is off for what the rig does not repeat, where that is known; see `Expected`."""
    known_hz: float = np.inf
    """Fastest excitation that it is known from, see `Expected`."""
    grid_s: float = GRID_S
    """Grid on which measured records of the rig are compared: planned ones are laid on it as well."""

    @property
    def grid_ns(self) -> int:
        """The same in whole nanoseconds."""
        return round(self.grid_s * 1e9)


def expect_planned(rig: KnownRig, plans: Sequence[RunPlan]) -> Expected:
    """What the reference expects of planned records, which are taken to answer exactly so but for noise. The plans are
    on the rig's grid."""
    draw = np.random.default_rng(0)  # the same noise each time: two sessions are compared by their records alone
    pairs = [_expected_pair(rig, plan, draw) for plan in plans]
    made = from_response(rig.response, Pairing(pairs, rig.pressures, 0, rig.response.p0_mpa))
    made = replace(made, levels=rig.levels, kind=rig.kind, known_hz=rig.known_hz, planned=True)
    return replace(
        made,
        missed_mpa=rig.missed_mpa,
        missed_deg=rig.missed_deg,
        unrepeated_mpa=rig.unrepeated_mpa,
        unrepeated_deg=rig.unrepeated_deg,
    )


def within(expected: Expected, angle_deg: tuple[float, float], simulator: Model | None) -> list[int]:
    """The records in which the joint stays between two angles, both by the reference and by the simulator: the
    reference is linear about the rest pressures and frequencies that it knows, and may be far off at others. Where the
    simulator diverges the record is left out."""
    low, high = angle_deg
    if not np.isfinite(high - low):
        return list(range(len(expected.pairs)))
    least, most = low + ANGLE_MARGIN * (high - low), high - ANGLE_MARGIN * (high - low)
    kept = [k for k, base in enumerate(expected.base) if least <= float(base.min()) and float(base.max()) <= most]
    if simulator is None or simulator.muscle.kind == EXTERNAL:
        return kept
    return [k for k in kept if _simulated_within(simulator, expected.pairs[k].raw, least, most)]


def _simulated_within(simulator: Model, commands: Record, least_deg: float, most_deg: float) -> bool:
    try:
        angle = simulate(simulator, commands).angle_deg
    except ModelError:
        return False
    return angle is not None and least_deg <= float(angle.min()) and float(angle.max()) <= most_deg


def _expected_pair(rig: KnownRig, plan: RunPlan, draw: np.random.Generator) -> Pair:
    dp = np.asarray(plan.dp_mpa, dtype=np.float64)
    dt_s = rig.grid_s
    t = np.arange(len(dp), dtype=np.float64) * dt_s
    u1, u2 = around(plan.p0_mpa, dp)
    p1, p2 = rig.response.pressures(u1, u2, dt_s)
    angle = rig.response.angle(p1, p2, dt_s)

    def measured(column: Column, noise: float) -> Column:
        return column + noise * draw.standard_normal(len(column))

    monitors = [measured(p, rig.noise.pressure_mpa) for p in (p1, p2)] if rig.pressures else [None, None]
    raw = Record(plan.name, t, dp, measured(angle, rig.noise.angle_deg), u1, u2, *monitors)
    case = RunColumns(p1, p2, angle) if rig.pressures else RunColumns(None, None, angle)
    return Pair(plan.name, dt_s, t, u1, u2, case, (), np.ones_like(t), raw, (), t)


def known_rig(expected: Expected) -> KnownRig:
    """The rig of records that there are, as their reference knows it."""
    if expected.beside_records:
        return known_by(expected.response, expected.contexts, pressures=expected.driven)
    rig = KnownRig(
        expected.response,
        expected.levels,
        expected.driven,
        _noise(expected.contexts),
        expected.kind,
        expected.missed_mpa,
        expected.missed_deg,
        known_hz=expected.known_hz,
        grid_s=expected.pairs[0].dt_s,
    )
    return as_steady_as(rig, expected.contexts)


def known_by(response: ResponseModel, days: Sequence[RecordContext], *, pressures: bool) -> KnownRig:
    """The rig of earlier days, for records of other sweeps: they are known as surely as by a fingerprint of those days,
    which itself misses the days by some degrees."""
    pairs = [context.pair for context in days]
    missed_deg = rms_of([context.reference.angle_deg - context.propagated for context in days], pairs)
    missed_mpa = [
        rms_of([context.reference.p1_mpa - context.regulated[0] for context in days], pairs),
        rms_of([context.reference.p2_mpa - context.regulated[1] for context in days], pairs),
    ]
    rig = KnownRig(
        response,
        ReferenceKind.FINGERPRINT.value,
        pressures,
        _noise(days),
        missed_mpa=max(missed_mpa),
        missed_deg=missed_deg,
        known_hz=known_by_hz((pair.u1_mpa - pair.u2_mpa, pair.dt_s) for pair in pairs),
        grid_s=pairs[0].dt_s,
    )
    return as_steady_as(rig, days)


def as_steady_as(rig: KnownRig, contexts: Sequence[RecordContext]) -> KnownRig:
    """The same rig, which repeats itself as closely as these records show."""
    of_angle = partial(angle_days, response=rig.response, driven=rig.pressures)
    unrepeated_mpa = of_contexts(contexts, pressure_days).rms if rig.pressures else 0.0
    return replace(rig, unrepeated_deg=of_contexts(contexts, of_angle).rms, unrepeated_mpa=unrepeated_mpa)


def _noise(contexts: Sequence[RecordContext]) -> Noise:
    pairs = [context.pair for context in contexts]
    angle = float(np.median([line_noise(pair.raw.angle_deg, pair) for pair in pairs]))
    monitors = [line_noise(column, pair) for pair in pairs for column in (pair.raw.p1_mpa, pair.raw.p2_mpa)]
    return Noise(angle, float(np.median(monitors)))


def factors_of(
    expected: Expected, settings: Fitted, among: Collection[str] = frozenset({PRESSURES, ANGLE})
) -> list[InverseProblem]:
    """The factors of the likelihood on planned records, upstream first; those `among` which one asks."""
    made = {PRESSURES: pressure_problem, ANGLE: angle_problem} if expected.driven else {ANGLE: angle_problem}
    return [problem(expected, settings) for name, problem in made.items() if name in among]
