"""Carries effects through the frozen nominal rig: what the healthy rig's record would have been with these causes in
it.

Everything is a difference on top of the measured baseline: set-points through the regulators, pressures through the
muscles, the angle through the joint and the sensor. What acts on a measured course itself (`EffectStage.exact`: a delay
of the commands, a gain or an offset of the pressures, everything of the sensor) is put onto that, so that nothing of
the nominal rig comes between. No fitting here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.gap.records.pairs import Pair
from rig.gap.response.causes import Ready, named
from rig.gap.response.lateness import IN_TIME, Lateness, all_delayed, delayed, displaced
from rig.gap.response.nominal import Reference
from rig.gap.response.without_monitor_noise import without_noise
from rig.model.compiled.machine_code import kernel
from rig.model.equations.drive import LEAST_SHARE
from rig.model.response.model import ResponseModel
from rig.model.slots import AHEAD, Slot
from rig.record import Column

SAME_STIFFNESS = 0.005
"""Changes of the mean pressure below this share are not worth solving the joint's balance again."""


@dataclass(frozen=True)
class RecordContext:
    """One pair with its reference, and the parts of the nominal response that every candidate needs."""

    pair: Pair
    reference: Reference
    regulated: tuple[Column, Column]
    propagated: Column
    quiet: tuple[Column, Column]
    """The reference's pressures without the noise of their monitors: what changes a measured pressure changes these."""

    @cached_property
    def every(self) -> Column:
        """(10, n) all its columns."""
        pair, reference = self.pair, self.reference
        return np.stack((
            pair.u1_mpa, pair.u2_mpa, reference.p1_mpa, reference.p2_mpa, reference.angle_deg, *self.regulated,
            self.propagated, *self.quiet,
        ))  # fmt: skip


class Driven(NamedTuple):
    """Pressures under some causes ahead of the monitors; all columns (n,)."""

    p1: Column
    p2: Column
    """Those of the healthy rig, without the noise of their monitors."""
    q1: Column
    q2: Column
    """Those of the nominal regulators."""


@dataclass(frozen=True)
class Course:
    """Contexts end to end: columns (n,) run over all their records, so that a stage is one call."""

    contexts: tuple[RecordContext, ...]

    @cached_property
    def ends(self) -> NDArray[np.intp]:
        """(r,) the row after the last of each record."""
        return np.cumsum([len(context.pair) for context in self.contexts])

    @cached_property
    def dt_s(self) -> Column:
        """(r,) of each record."""
        return np.array([context.pair.dt_s for context in self.contexts])

    @cached_property
    def begun_s(self) -> Column:
        """(r,) when each record began, seconds after the session's first."""
        return np.array([context.pair.begun_s for context in self.contexts])

    @cached_property
    def reference(self) -> Reference:
        """The healthy rig's columns (n,)."""
        every = [context.reference for context in self.contexts]
        return Reference(
            np.concatenate([one.p1_mpa for one in every]),
            np.concatenate([one.p2_mpa for one in every]),
            np.concatenate([one.angle_deg for one in every]),
        )

    @cached_property
    def regulated(self) -> tuple[Column, Column]:
        """Both regulators' pressures (n,)."""
        first, second = ([context.regulated[k] for context in self.contexts] for k in (0, 1))
        return np.concatenate(first), np.concatenate(second)

    @cached_property
    def quiet(self) -> tuple[Column, Column]:
        """Both pressures of the healthy rig (n,) without the noise of their monitors."""
        first, second = ([context.quiet[k] for context in self.contexts] for k in (0, 1))
        return np.concatenate(first), np.concatenate(second)

    @cached_property
    def noise(self) -> tuple[Column, Column]:
        """(n,) what their monitors add to these."""
        return self.reference.p1_mpa - self.quiet[0], self.reference.p2_mpa - self.quiet[1]

    @cached_property
    def measured(self) -> tuple[Column, Column] | None:
        """Both monitors (n,), where all cases have them."""
        cases = [context.pair.case for context in self.contexts]
        first = [case.p1_mpa for case in cases if case.p1_mpa is not None]
        second = [case.p2_mpa for case in cases if case.p2_mpa is not None]
        return (np.concatenate(first), np.concatenate(second)) if len(first) == len(second) == len(cases) else None

    @cached_property
    def _each(self) -> list[slice]:
        """The rows of each record."""
        return [slice(end - len(context.pair), end) for end, context in zip(self.ends, self.contexts, strict=True)]

    def split(self, column: Column) -> list[Column]:
        """A column (n,) as it is in each record."""
        return [column[rows] for rows in self._each]

    def later(self, column: Column, causes: Sequence[Ready]) -> Column:
        """A column (n,) as late as these causes make each record of it."""
        each = zip(self.split(column), self.contexts, strict=True)
        return np.concatenate([delayed(one, _lateness(causes, at.pair), at.pair.dt_s) for one, at in each])

    @cached_property
    def latest(self) -> "dict[object, HealthyJoint]":
        """The joint under the causes ahead of the muscles that were asked for last: beside one of those, everything
        behind the muscles is tried."""
        return {}

    @cached_property
    def begun(self) -> "dict[object, Driven]":
        """What the causes before the last one that was asked for do: beside one of those, all others are tried."""
        return {}


@dataclass(frozen=True)
class HealthyJoint:
    """The healthy rig's joint under given pressures; all columns (n,). What lies behind the muscles acts on it, and
    hundreds of trials begin with what its equilibrium is."""

    p1: Column
    p2: Column
    angle: Column
    course: Course
    nominal: ResponseModel

    @cached_property
    def driven_to(self) -> Column:
        """(n,) the angle (deg) to which the pressures drive it, by the response model."""
        return self.nominal.equilibrium(self.p1, self.p2)

    @cached_property
    def pulled_to(self) -> Column:
        """(n,) the angle (deg) of equilibrium where it has its own."""
        return self.nominal.pulled_to(self.angle, self.course.dt_s, self.course.ends)

    @cached_property
    def begun(self) -> "dict[object, Column]":
        """Its angle, (n,) in deg, with the causes before the last one that was asked for: beside one of those, all
        others are tried."""
        return {}

    def under(self, q1: Column, q2: Column) -> Column:
        """(n,) its angle (deg) once the muscles feel other pressures, `q1` and `q2` (n,) in MPa."""
        further = self.nominal.equilibrium(q1, q2) - self.driven_to
        compliance = _compliance(self.p1 + self.p2, q1 + q2, self.nominal)
        return self.nominal.settled(
            self.angle, self.pulled_to + further, compliance, self.course.dt_s, self.course.ends
        )


def contexts_of(pairs: Sequence[Pair], references: Sequence[Reference], nominal: ResponseModel) -> list[RecordContext]:
    """A context for each pair."""
    return [_laid(pair, reference, nominal) for pair, reference in zip(pairs, references, strict=True)]


def _laid(pair: Pair, reference: Reference, nominal: ResponseModel) -> RecordContext:
    dt_s = pair.dt_s
    q1, q2 = nominal.pressures(pair.u1_mpa, pair.u2_mpa, dt_s)
    quiet = without_noise(reference.p1_mpa, q1, dt_s), without_noise(reference.p2_mpa, q2, dt_s)
    propagated = nominal.angle(reference.p1_mpa, reference.p2_mpa, dt_s)
    return RecordContext(pair, reference, (q1, q2), propagated, quiet)


def pressures_with(causes: Sequence[Ready], course: Course, nominal: ResponseModel) -> tuple[Column, Column]:
    """Both pressures (n,), MPa, of the healthy rig with these timing and valve effects (the others are passed over).
    The monitors' noise stays as it was."""
    ahead = [*_in(causes, Slot.TIMING), *_in(causes, Slot.VALVE)]
    if not ahead:
        return course.reference.p1_mpa, course.reference.p2_mpa
    noise = course.noise
    if all(cause.exact and cause.slot is Slot.TIMING for cause in ahead):  # nothing else of the course is asked for
        p1, p2 = (course.later(column, ahead) for column in course.quiet)
    elif len(ahead) == 1 or ahead[-1].slot is Slot.TIMING:
        p1, p2, _, _ = _ahead(ahead, course, nominal)
    else:
        asked = (nominal, *map(named, ahead[:-1]))
        if asked not in course.begun:
            course.begun.clear()
            course.begun[asked] = _ahead(ahead[:-1], course, nominal)
        p1, p2, _, _ = _through(ahead[-1], course.begun[asked], course)
    return p1 + noise[0], p2 + noise[1]


def _ahead(causes: Sequence[Ready], course: Course, nominal: ResponseModel) -> Driven:
    """What timing and valve effects do."""
    course = _late(causes, course)
    (p1, p2), (q1, q2) = course.quiet, course.regulated
    early = [cause for cause in _in(causes, Slot.TIMING) if not cause.exact]
    if early:
        u1 = np.concatenate([context.pair.u1_mpa for context in course.contexts])
        u2 = np.concatenate([context.pair.u2_mpa for context in course.contexts])
        for cause in early:
            _run(cause, u1, u2, u1, course)
        (q1, q2), was = _regulated(u1, u2, course, nominal), (q1, q2)
        p1, p2 = p1 + q1 - was[0], p2 + q2 - was[1]
    driven = Driven(p1, p2, q1, q2)
    for cause in _in(causes, Slot.VALVE):
        driven = _through(cause, driven, course)
    return driven


def _through(cause: Ready, driven: Driven, course: Course) -> Driven:
    """The same with one more effect of the valves."""
    p1, p2, was1, was2 = driven
    q1, q2 = _changed(cause, was1, was2, course)
    p1, p2 = _changed(cause, p1, p2, course) if cause.exact else (p1 + q1 - was1, p2 + q2 - was2)
    return Driven(p1, p2, q1, q2)


def _regulated(u1: Column, u2: Column, course: Course, nominal: ResponseModel) -> tuple[Column, Column]:
    """What the nominal regulators make of set-points (n,)."""
    each = zip(course.split(u1), course.split(u2), course.contexts, strict=True)
    both = [nominal.pressures(one, other, context.pair.dt_s) for one, other, context in each]
    return np.concatenate([one for one, _ in both]), np.concatenate([other for _, other in both])


def _changed(cause: Ready, p1: Column, p2: Column, course: Course) -> tuple[Column, Column]:
    q1, q2 = p1.copy(), p2.copy()
    _run(cause, q1, q2, q1, course)
    return q1, q2


def _late(causes: Sequence[Ready], course: Course) -> Course:
    """`late` of every context."""
    if not any(cause.exact and cause.slot is Slot.TIMING for cause in causes):
        return course
    return Course(tuple(late(causes, context) for context in course.contexts))


def late(causes: Sequence[Ready], context: RecordContext) -> RecordContext:
    """The context as it would have been under commands that are late: everything in it is as late."""
    return later(context, _lateness(causes, context.pair))


def _lateness(causes: Sequence[Ready], pair: Pair) -> Lateness:
    return sum((cause.late_in(pair.begun_s) for cause in causes), IN_TIME)


def as_late_as_measured(context: RecordContext) -> RecordContext:
    """The context as late as the case's measured pressures are; as it is where none were measured."""
    p1, p2 = context.pair.case.p1_mpa, context.pair.case.p2_mpa
    return context if p1 is None or p2 is None else later(context, _behind(context, p1, p2))


def _behind(context: RecordContext, p1: Column, p2: Column) -> Lateness:
    """By how much the difference of these pressures is behind the reference's own."""
    return displaced(p1 - p2, context.reference.p1_mpa - context.reference.p2_mpa, context.pair.dt_s)


def later(context: RecordContext, late: Lateness) -> RecordContext:
    """Everything in it later by so much."""
    if late == IN_TIME:
        return context
    u1, u2, p1, p2, angle, q1, q2, propagated, quiet_1, quiet_2 = all_delayed(context.every, late, context.pair.dt_s)
    return RecordContext(
        replace(context.pair, u1_mpa=u1, u2_mpa=u2), Reference(p1, p2, angle), (q1, q2), propagated, (quiet_1, quiet_2)
    )


def angle_under(p1: Column, p2: Column, context: RecordContext, nominal: ResponseModel) -> Column:
    """(n,) the healthy rig's angle (deg) had its pressures (n,) been p1 and p2, MPa.

    Pressures that come later make the measured angle as late, whatever made them late; of the rest, the response model
    gives what the difference of the pressures does; their mean changes the stiffness, and with it how much the joint's
    friction and inertia count.
    """
    reference, dt = context.reference, context.pair.dt_s
    late = _behind(context, p1, p2)
    angle = nominal.angle(p1, p2, dt) + delayed(reference.angle_deg - context.propagated, late, dt)
    compliance = _compliance(delayed(reference.p1_mpa + reference.p2_mpa, late, dt), p1 + p2, nominal)
    mean, variance = mean_and_variance(compliance)
    if abs(mean - 1.0) < SAME_STIFFNESS and variance < SAME_STIFFNESS**2:
        return angle
    return nominal.balanced(angle, np.zeros_like(angle), compliance, dt)


@kernel(nogil=True)
def mean_and_variance(column: Column) -> tuple[float, float]:  # pragma: no cover
    """Of (n,): numpy's own take four times as long for columns of this length."""
    mean, variance = 0.0, 0.0
    for i in range(len(column)):
        mean += column[i]
    mean /= len(column)
    for i in range(len(column)):
        variance += (column[i] - mean) ** 2
    return mean, variance / len(column)


def _compliance(usual: Column, now: Column, nominal: ResponseModel) -> Column:
    """How much less stiff the joint is under one sum of the pressures (n,) than under another, in proportion to it."""
    least = LEAST_SHARE * nominal.p0_mpa
    ratio: Column = np.maximum(usual, least) / np.maximum(now, least)
    return ratio


def angle_with(causes: Sequence[Ready], joint: HealthyJoint) -> Column:
    """The joint's angle (n,) with these muscle, joint and sensor effects."""
    muscle, behind = _in(causes, Slot.MUSCLE), [*_in(causes, Slot.JOINT), *_in(causes, Slot.SENSOR)]
    if not behind:
        return _pulled_by(muscle, joint) if muscle else joint.angle
    before, last = [*muscle, *behind[:-1]], behind[-1]
    asked = tuple(map(named, before))
    if asked not in joint.begun:
        joint.begun.clear()
        joint.begun[asked] = angle_with(before, joint)
    out: Column = joint.begun[asked] - last.from_deg
    _run(last, joint.p1, joint.p2, out, joint.course)
    out += last.from_deg
    return out


def _pulled_by(muscle: Sequence[Ready], joint: HealthyJoint) -> Column:
    """Its angle with these muscle effects."""
    q1, q2 = joint.p1.copy(), joint.p2.copy()
    for cause in muscle:
        _run(cause, q1, q2, q1, joint.course)
    return joint.under(q1, q2)


def response_with(causes: Sequence[Ready], course: Course, nominal: ResponseModel) -> Column:
    """The angle (n,) of the healthy rig under its commands with all these causes."""
    asked = (nominal, *(named(cause) for cause in causes if cause.slot in AHEAD))
    if asked not in course.latest:
        found = _driven(causes, course, nominal)
        course.latest.clear()
        course.latest[asked] = found
    return angle_with(causes, course.latest[asked])


def _driven(causes: Sequence[Ready], course: Course, nominal: ResponseModel) -> HealthyJoint:
    """The joint under its commands, before the muscles, the joint and the sensor are others."""
    course = _late(causes, course)
    causes = [cause for cause in causes if not (cause.exact and cause.slot is Slot.TIMING)]
    p1, p2 = pressures_with(causes, course, nominal)
    usual = course.reference
    angle = usual.angle_deg
    if p1 is not usual.p1_mpa or p2 is not usual.p2_mpa:
        each = zip(course.split(p1), course.split(p2), course.contexts, strict=True)
        angle = np.concatenate([angle_under(one, other, context, nominal) for one, other, context in each])
    return HealthyJoint(p1, p2, angle, course, nominal)


def _in(causes: Sequence[Ready], slot: Slot) -> list[Ready]:
    return [cause for cause in causes if cause.slot is slot]


def _run(cause: Ready, p1: Column, p2: Column, y: Column, course: Course) -> None:
    begun_s = course.begun_s * cause.whole_session
    cause.stage(p1, p2, y, course.ends, np.zeros(cause.state_size), cause.params, course.dt_s, begun_s)
