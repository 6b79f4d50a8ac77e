"""The two inverse problems in which hypotheses compete: which cause changed the pressures under the commands, and which
the angle under the pressures.

Each is built in one order, and the order counts: `less_sure` multiplies all that was doubted before it where the
records are fast, and what is doubted after it stands beside that at its own size.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from rig.gap.hypotheses.changes import Change, angle_change, pressure_change
from rig.gap.hypotheses.fit import ForwardModel, settled
from rig.gap.hypotheses.law_errors import rough_lines, with_law
from rig.gap.hypotheses.library import Law
from rig.gap.hypotheses.retuned import unsure_regulators
from rig.gap.hypotheses.scales import law_scales
from rig.gap.likelihood.lines import Lines
from rig.gap.priors import FactorLevels, Fitted, Prior
from rig.gap.reference.expectation import Factor, Parts, angle_parts, mean_doubt, motion_doubt, pressure_parts
from rig.gap.reference.expected import Expected
from rig.gap.reference.faster_records import doubt, known_by_hz
from rig.gap.reference.gaps import rms_of, without_mean
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.reference.operating_point import speed_doubt
from rig.gap.reference.own_days import angle_days, own_factor, pressure_days
from rig.gap.reference.patterns import VISCOUS
from rig.gap.reference.unrepeated import shown_by, with_unrepeated
from rig.gap.response.lateness import displaced
from rig.gap.response.propagate import Course, RecordContext, as_late_as_measured
from rig.gap.settings import ENVELOPE_EVEN, ENVELOPE_HZ, GAIN_BY_DAY, UNSEEN_MEAN_LAW, ZERO_AT_REST, ZERO_BY_HAND
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.slots import AHEAD
from rig.record import Column

PRESSURES, ANGLE = "pressures", "angle"


@dataclass(frozen=True)
class InverseProblem:
    """What was measured of one factor with the forward model of its causes, and which laws may act on it."""

    name: str
    forward: ForwardModel
    on_few: Callable[[], ForwardModel]
    acts: Callable[[Law], bool]
    """On this factor, by where it enters the chain."""
    identifiable: Callable[[Law], bool]
    """From these records, whatever factor it acts on."""

    def shows(self, law: Law) -> bool:
        """Whether a law acts on this factor of records that tell of it."""
        return self.acts(law) and self.identifiable(law)

    @cached_property
    def screening(self) -> ForwardModel:
        """The model of the few records that show most, where laws are tried first; made when it is asked for, which no
        plan does."""
        return self.on_few()


def acts_ahead(law: Law) -> bool:
    """Whether a law acts ahead of the pressure monitors."""
    return EFFECT_STAGES[law.stage].slot in AHEAD


def _identifiable(expected: Expected, law: Law) -> bool:
    """Whether a law can be identified from these records: one that goes on from record to record asks when they
    began."""
    return not law.whole_session or any(pair.begun_s > 0.0 for pair in expected.pairs)


def pressure_problem(expected: Expected, settings: Fitted) -> InverseProblem:
    """The pressures under the commands, on which acts what lies ahead of the monitors."""
    whole = pressure_forward(expected, settings)
    if builds := settings.levels[expected.levels].builds:
        whole = replace(whole, factor=whole.factor.of_its_class(settled(whole).factor, builds))
    return InverseProblem(
        PRESSURES,
        whole,
        lambda: pressure_forward(_telling(expected), settings, expected),
        acts_ahead,
        partial(_identifiable, expected),
    )


def angle_problem(expected: Expected, settings: Fitted) -> InverseProblem:
    """The angle, under the pressures where they were measured: what lies ahead of the monitors is settled then. From
    the angle alone every law acts on it."""
    return InverseProblem(
        ANGLE,
        angle_forward(expected, settings),
        lambda: angle_forward(_telling(expected), settings, expected),
        lambda law: not (expected.driven and acts_ahead(law)),
        partial(_identifiable, expected),
    )


def parts_of_pressures(expected: Expected) -> tuple[Parts, Column]:
    """What may differ in the pressures, with what this rig does not repeat; and (n, K) the earlier days."""
    parts = pressure_parts(expected.contexts, expected.pairing.p0_mpa, expected.response)
    return _with_days(parts, expected, pressure_days)


def parts_of_angle(expected: Expected) -> tuple[Parts, Column]:
    """What may differ in the angle, with what this rig does not repeat; and (n, K) the earlier days."""
    response, driven = expected.response, expected.driven
    parts = angle_parts(expected.contexts, expected.base, response, driven)
    parts = parts.without(VISCOUS) if expected.kind is ReferenceKind.SIMULATOR else parts
    read_right = () if expected.misread is None else expected.misread.days_mpa
    return _with_days(parts, expected, partial(angle_days, response=response, driven=driven, misread_mpa=read_right))


def _with_days(
    parts: Parts, expected: Expected, days_of: Callable[[Sequence[RecordContext]], Column]
) -> tuple[Parts, Column]:
    if expected.planned:
        return parts, np.zeros((len(parts.gap), 0))
    shown = shown_by(expected.contexts, days_of)
    return with_unrepeated(parts, expected.contexts, shown), shown[:, : len(expected.contexts[0].pair.days)]


def pressure_forward(expected: Expected, settings: Fitted, whole: Expected | None = None) -> ForwardModel:
    """The pressures of some records; scales are those of the `whole`."""
    reference_levels = settings.levels[expected.levels]
    levels = reference_levels.pressures.wider("lag_s", expected.unsure_lag_s)
    if expected.kind is not ReferenceKind.SESSIONS:  # several days of the rig tell by how much its regulators differ
        levels = levels.wider("gain", GAIN_BY_DAY)
    parts, days = parts_of_pressures(expected)
    factor = own_factor(parts, days, levels, settings.prior).of_any_build(reference_levels.builds)
    times = _where_fast(factor.lines, expected)
    factor = factor.at_least(expected.missed_mpa).less_sure(times, parts.noise).noisier(expected.unrepeated_mpa**2)
    factor = factor.doubting(motion_doubt(expected.contexts, expected.base, expected.response))
    factor = factor.doubting(speed_doubt(expected.contexts, expected.response))
    if expected.kind is ReferenceKind.FINGERPRINT:
        factor = factor.standing_off(expected.missed_mpa)
    moving = float(np.std(np.concatenate([context.reference.p1_mpa for context in expected.contexts])))
    scales = law_scales((whole or expected).contexts, expected.response.tau0_s)
    change = pressure_change(expected.contexts, expected.response)
    forward = ForwardModel(
        factor, change, expected.response, scales, moving, settings.prior, reference_levels.odds,
        lambda changed: _moved_deg(expected, changed) / floor_deg(expected, settings), reference_levels.usual,
    )  # fmt: skip
    if expected.kind is not ReferenceKind.SIMULATOR:
        return forward
    return replace(forward, unsure=unsure_regulators(expected.contexts, expected.response, parts, levels, times))


def angle_forward(expected: Expected, settings: Fitted, whole: Expected | None = None) -> ForwardModel:
    """The angle of some records; scales are those of the `whole`."""
    contexts, base, response = expected.contexts, expected.base, expected.response
    reference_levels = settings.levels[expected.levels]
    levels = _angle_levels(expected, reference_levels.angle)
    parts, days = parts_of_angle(expected)
    factor = own_factor(parts, days, levels, settings.prior).of_any_build(reference_levels.builds)
    if expected.zeroed:
        factor = factor.standing_off(ZERO_AT_REST * parts.span)
    if expected.driven:
        factor = factor.doubting(mean_doubt(contexts, base, response))
    if expected.driven and expected.kind is not ReferenceKind.SIMULATOR:  # which is asked itself under these
        factor = _answering_other_pressures(factor, expected, settings.prior)
    factor = factor.at_least(expected.missed_deg).less_sure(_where_fast(factor.lines, expected), parts.noise)
    factor = factor.noisier(expected.unrepeated_deg**2 + expected.signatures_deg2)
    if expected.step_deg:
        factor = factor.rounded_to(expected.step_deg, np.concatenate(list(base)))
    if expected.kind is ReferenceKind.FINGERPRINT:
        factor = factor.standing_off(expected.missed_deg)
    moving = float(np.std(np.concatenate(base)))
    scales = law_scales((whole or expected).contexts, expected.response.tau0_s)
    change = angle_change(contexts, base, response, expected.driven)
    change = _from_own_zeros(change, contexts) if expected.zeroed else change
    return ForwardModel(
        factor, change, response, scales, moving, settings.prior, reference_levels.odds,
        lambda changed: factor.rms(changed) / floor_deg(expected, settings), reference_levels.usual,
    )  # fmt: skip


def _from_own_zeros(change: Change, contexts: Sequence[RecordContext]) -> Change:
    """The same counted from the zero that each record took, of which it says nothing: without its mean."""
    course = Course(tuple(contexts))
    return lambda causes: _without_means(change(causes), course)


def _without_means(column: Column, course: Course) -> Column:
    """(n,) less what each record of it shows in the mean."""
    each = zip(course.split(column), course.contexts, strict=True)
    return np.concatenate([without_mean(part, context.pair.used) for part, context in each])


def floor_deg(expected: Expected, settings: Fitted) -> float:
    """What such references usually miss of the angle under the commands (rms)."""
    moves_deg = float(np.ptp(np.concatenate([context.reference.angle_deg for context in expected.contexts])))
    return settings.levels[expected.levels].commanded_floor * max(moves_deg, 1e-3)


def _moved_deg(expected: Expected, changed: Column) -> float:
    """What changed pressures (2 n,), valve 1 of every record and then valve 2, do to the angle (rms)."""
    response, contexts = expected.response, expected.contexts
    ends = np.cumsum([len(context.pair) for context in contexts] * 2)[:-1]
    parts = np.split(changed, ends)
    moved = []
    for k, context in enumerate(contexts):
        p1, p2, dt_s = context.reference.p1_mpa, context.reference.p2_mpa, context.pair.dt_s
        there = response.angle(p1 + parts[k], p2 + parts[k + len(contexts)], dt_s)
        moved.append(there - response.angle(p1, p2, dt_s))
    return rms_of(moved, [context.pair for context in contexts])


def _angle_levels(expected: Expected, levels: FactorLevels) -> FactorLevels:
    """How far the angle may differ without a gap, by what these records leave unsaid: the lag of a command, the errors
    of the monitors, the mean pressure, the zero."""
    levels = levels.wider("lag_s", 0.0 if expected.driven else expected.unsure_lag_s)
    if expected.misread is not None:
        levels = expected.misread.levels(levels)
    if expected.mean_unseen:
        levels = levels.wider("mean_law", UNSEEN_MEAN_LAW)
    return levels.wider("offset", ZERO_BY_HAND) if expected.other_zero else levels


def other_pressures(expected: Expected, late: Sequence[RecordContext]) -> tuple[Column, float]:
    """(n,) what pressures that are others than the reference's, and not only later, change in the expected angle, deg;
    and the share (rms) by which the reference's description misses the angles that it was made from. `late`: the
    contexts, as late as the measured pressures."""
    usual_deg = np.concatenate([context.reference.angle_deg for context in late])
    missed_deg = max(expected.response.misfit_deg, expected.missed_deg)
    return np.concatenate(list(expected.base)) - usual_deg, missed_deg / max(float(np.std(usual_deg)), 1e-9)


def _answering_other_pressures(factor: Factor, expected: Expected, prior: Prior) -> Factor:
    """The same with what is unsure of the angle because the pressures are others than usual, and not only later: the
    description of the rig is as rough in what they change as it is in the angles that it was made from, or as well
    several times as rough (`Prior.answer`); and what it misses of those comes with the motion, at another time than on
    the earlier days."""
    contexts = [as_late_as_measured(context) for context in expected.contexts]
    moved_deg, rho = other_pressures(expected, contexts)
    # a constant would reach into lines where there is nothing but noise, and what may be rougher free that
    moving_deg = _without_means(moved_deg, Course(tuple(contexts)))
    lines = factor.lines
    changed, moving = lines.of(np.column_stack([moved_deg, moving_deg])).T
    healthy = with_law(factor.healthy, lines, changed, rho, prior)
    commands = [(context.pair.u1_mpa - context.pair.u2_mpa, context.pair.dt_s) for context in contexts]
    rougher = rougher_beyond(lines, min(expected.known_hz, known_by_hz(commands)))
    healthy = healthy.with_variance(rougher**2 * rough_lines(lines, changed, rho, prior, moving_power(lines, changed)))
    later_s = np.array([
        displaced(angle, context.reference.angle_deg, context.pair.dt_s).rms_s(len(angle) * context.pair.dt_s)
        for context, angle in zip(contexts, expected.base, strict=True)
    ])  # fmt: skip
    missed = np.concatenate([context.reference.angle_deg - context.propagated for context in contexts])
    healthy = healthy.with_variance(at_another_time(lines, missed, later_s))
    return replace(factor, healthy=replace(healthy, as_well=(prior.answer * rho * moving) ** 2))


def rougher_beyond(lines: Lines, known_hz: float) -> Column:
    """(l,) by how many times the usual a description is rougher still in each line, since its rig was excited up to
    `known_hz` only: it grows with the square of how many times faster the line is, as what a time constant does that
    the description lacks, (2 pi f tau)^2; up to there nothing."""
    out: Column = np.maximum(lines.frequency_hz / known_hz, 1.0) ** 2 - 1.0
    return out


def moving_power(lines: Lines, column: Column) -> Column:
    """(l,) envelope of what of a column (l,) is no constant, near its own lines alone: a shift of both pressures says
    nothing of 5 Hz."""
    out: Column = lines.envelope(np.where(lines.frequency_hz > 0.0, column, 0.0), ENVELOPE_HZ, 0.0)
    return out


def at_another_time(lines: Lines, column: Column, later_s: Column) -> Column:
    """(l,) variance of a column (n,) less itself later, by so many seconds in each record (r,): 2 - 2 cos(2 pi f t) of
    its power, blurred, and twice its power from a quarter of a period on, where nothing is known of the phase."""
    turned = 2.0 - 2.0 * np.cos(2.0 * np.pi * np.minimum(lines.frequency_hz * later_s[lines.record], 0.25))
    out: Column = turned * lines.envelope(lines.of(column), ENVELOPE_HZ, ENVELOPE_EVEN)
    return out


def _where_fast(lines: Lines, expected: Expected) -> Column:
    """(l,) by how many times each line is known less surely, where experiments are faster than what the reference is
    known from."""
    if not np.isfinite(expected.known_hz):  # no experiments: nothing is fast
        return np.ones_like(lines.frequency_hz)
    return doubt([context.pair for context in expected.contexts], lines, expected.known_hz)


def on_records(expected: Expected, chosen: Sequence[int]) -> Expected:
    """The same with some of its records only."""
    return replace(
        expected, contexts=[expected.contexts[k] for k in chosen], base=tuple(expected.base[k] for k in chosen)
    )


def _telling(expected: Expected) -> Expected:
    """Three of its records: the two with the largest gap, and the middle one."""
    sizes = [
        float(np.mean(((context.pair.case.angle_deg - angle) * context.pair.used) ** 2))
        for context, angle in zip(expected.contexts, expected.base, strict=True)
    ]
    order = np.argsort(sizes)[::-1]
    return on_records(expected, sorted({int(order[k]) for k in (0, min(1, len(order) - 1), len(order) // 2)}))
