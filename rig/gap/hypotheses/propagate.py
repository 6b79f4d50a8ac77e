"""Carries effects through the frozen nominal rig: what the healthy rig's record would have been with these causes in
it.

Everything is a difference on top of the measured baseline: set-points through the regulators, pressures through the
muscles, the angle through the joint and the sensor. No fitting here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.gap.records.pairs import Pair
from rig.gap.reference.nominal import Nominal, Reference
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.kernels import compiled
from rig.model.slots import Slot
from rig.record import Column

SAME_STIFFNESS = 0.005
"""Changes of the mean pressure below this share are not worth solving the joint's balance again."""


@dataclass(frozen=True)
class Applied:
    """An effect stage with its numbers; numbers left out come from the nominal rig or stand at their usual values."""

    stage: str
    numbers: Mapping[str, float]

    @property
    def effect(self) -> str:
        return EFFECT_STAGES[self.stage].effect


@dataclass(frozen=True)
class Track:
    """One pair with its reference, and the parts of the nominal response that every candidate needs."""

    pair: Pair
    reference: Reference
    regulated: tuple[Column, Column]
    propagated: Column
    driven_by: tuple[Column, Column] | None = None
    """The case's pressures without what their monitors misread, once a cause explains them; before that, as
    measured."""


def lay_tracks(pairs: Sequence[Pair], references: Sequence[Reference], nominal: Nominal) -> list[Track]:
    """A track for each pair."""
    return [
        Track(
            pair,
            reference,
            nominal.pressures(pair.u1_mpa, pair.u2_mpa, pair.dt_s),
            nominal.angle(reference.p1_mpa, reference.p2_mpa, pair.dt_s),
        )
        for pair, reference in zip(pairs, references, strict=True)
    ]


def full_numbers(applied: Applied, nominal: Nominal) -> dict[str, float]:
    """Every number of the stage, the nominal rig's filled in."""
    known = EFFECT_STAGES[applied.stage]
    given = {"p0_mpa": nominal.p0_mpa, "tau0_s": nominal.tau0_s} | nominal.balance.stage_numbers()
    return known.neutral() | {name: given[name] for name in known.parameters if name in given} | dict(applied.numbers)


@dataclass(frozen=True)
class Ready:
    """An effect stage with its numbers in a row, as the compiled function reads them."""

    slot: Slot
    stage: Any
    params: Column
    state_size: int


def ready(causes: Sequence[Applied], nominal: Nominal) -> list[Ready]:
    """The causes as they run, in the order given."""
    made = []
    for cause in causes:
        known = EFFECT_STAGES[cause.stage]
        numbers = full_numbers(cause, nominal)
        params = np.array([numbers[name] for name in known.parameters])
        made.append(Ready(known.slot, compiled(known.stage), params, max(known.state_size, 1)))
    return made


def pressures_with(causes: Sequence[Ready], track: Track, nominal: Nominal) -> tuple[Column, Column]:
    """The pressures of the healthy rig with these timing and valve effects (the others are passed over)."""
    ahead = _in(causes, Slot.TIMING)
    behind = _in(causes, Slot.VALVE)
    if not ahead and not behind:
        return track.reference.p1_mpa, track.reference.p2_mpa
    dt = track.pair.dt_s
    q1, q2 = track.regulated
    if ahead:
        u1, u2 = track.pair.u1_mpa.copy(), track.pair.u2_mpa.copy()
        for cause in ahead:
            _run(cause, u1, u2, u1, dt)
        q1, q2 = nominal.pressures(u1, u2, dt)
    elif behind:
        q1, q2 = q1.copy(), q2.copy()
    for cause in behind:
        _run(cause, q1, q2, q1, dt)
    return track.reference.p1_mpa + q1 - track.regulated[0], track.reference.p2_mpa + q2 - track.regulated[1]


def angle_under(p1: Column, p2: Column, track: Track, nominal: Nominal) -> Column:
    """The healthy rig's angle had its pressures been p1 and p2.

    The response model gives what the difference of the pressures does; their mean changes the stiffness, and with it
    how much the joint's friction and inertia count.
    """
    reference = track.reference
    if p1 is reference.p1_mpa and p2 is reference.p2_mpa:
        return reference.angle_deg
    dt = track.pair.dt_s
    angle = reference.angle_deg + nominal.angle(p1, p2, dt) - track.propagated
    compliance = _compliance(reference.p1_mpa, reference.p2_mpa, p1, p2, nominal)
    if abs(float(compliance.mean()) - 1.0) < SAME_STIFFNESS and float(compliance.std()) < SAME_STIFFNESS:
        return angle
    return nominal.balanced(angle, np.zeros_like(angle), compliance, dt)


def _compliance(p1: Column, p2: Column, q1: Column, q2: Column, nominal: Nominal) -> Column:
    """How much less stiff the joint is under q than under p."""
    least = 0.2 * nominal.p0_mpa
    ratio: Column = (np.maximum(p1 + p2, least) / np.maximum(q1 + q2, least)) ** nominal.compliance
    return ratio


def angle_with(
    causes: Sequence[Ready], p1: Column, p2: Column, angle: Column, track: Track, nominal: Nominal
) -> Column:
    """`angle` (n,) that the healthy rig has under p1 and p2, with these muscle, joint and sensor effects."""
    dt = track.pair.dt_s
    out = angle
    muscle = _in(causes, Slot.MUSCLE)
    if muscle:
        q1, q2 = p1.copy(), p2.copy()
        for cause in muscle:
            _run(cause, q1, q2, q1, dt)
        out = nominal.balanced(
            out, nominal.equilibrium(q1, q2) - nominal.equilibrium(p1, p2), _compliance(p1, p2, q1, q2, nominal), dt
        )
    behind = _in(causes, Slot.JOINT) + _in(causes, Slot.SENSOR)
    if behind:
        out = out.copy()
        for cause in behind:
            _run(cause, p1, p2, out, dt)
    return out


def response_with(causes: Sequence[Ready], track: Track, nominal: Nominal) -> tuple[Column, Column, Column]:
    """Pressures and angle of the healthy rig under its commands with all these causes."""
    p1, p2 = pressures_with(causes, track, nominal)
    return p1, p2, angle_with(causes, p1, p2, angle_under(p1, p2, track, nominal), track, nominal)


def _in(causes: Sequence[Ready], slot: Slot) -> list[Ready]:
    return [cause for cause in causes if cause.slot is slot]


def _run(cause: Ready, p1: Column, p2: Column, y: Column, dt_s: float) -> None:
    cause.stage(p1, p2, y, np.zeros(cause.state_size), cause.params, dt_s)
