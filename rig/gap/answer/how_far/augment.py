"""The simulator with the named causes added: a model like any other, for `pamrig simulate` and the simulated rig; and
how far the gap shrinks with it.

The response model by which causes are named (`rig.model.response.model`) propagates an effect to the angle better than
a simulator does. What a user gets is the simulator with the causes: so that is run itself, on the records at hand.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.errors import RigError
from rig.gap.answer.result import Diagnosis
from rig.gap.answer.settings import MEAN_EXPONENTS, MEAN_MOVED
from rig.gap.reference.expected import Expected
from rig.gap.reference.gaps import commanded_gaps, from_own_zeros
from rig.gap.response.causes import Applied, full_numbers
from rig.identify.response.descent import square_sum
from rig.model.parameters import AddedEffect, Model
from rig.model.simulation import simulate
from rig.record import Column


def augmented(model: Model, diagnosis: Diagnosis, expected: Expected) -> Model:
    """`model` with every cause, those found by their signature included, and a word on where they come from."""
    causes = [cause.applied for cause in diagnosis.causes if cause.applied is not None]
    names = ", ".join(cause.effect for cause in causes) or "nothing"
    made, _ = _with_causes(model, causes, expected)
    law = "" if made.muscle == model.muscle else " and another law of the mean pressure"
    text = f"{model.provenance.text} With {names}{law} added by pamrig gap diagnose.".strip()
    return replace(made, provenance=replace(model.provenance, text=text))


def _with_causes(model: Model, causes: Sequence[Applied], expected: Expected) -> tuple[Model, list[Column] | None]:
    """`model` with each cause as an added effect, all its numbers written out, and what it leaves of the gap (deg; for
    each pair (n,); None where it runs away). Where they change the mean pressure, with the law of the mean pressure
    that leaves least, because the records that `model` was identified on never showed another."""
    changed = _with_effects(model, causes, expected)
    tried = [changed]
    if causes and "mean_exponent" in model.muscle.parameters and _mean_moves(model, changed, expected):
        tried = [with_mean_exponent(changed, exponent) for exponent in MEAN_EXPONENTS]
    gaps, before = commanded_gaps(expected), _simulated(model, expected)
    left = [_less(gaps, before, _simulated(one, expected), expected) for one in tried]
    squares = [np.inf if each is None else sum(map(square_sum, each)) for each in left]
    k = int(np.argmin(squares))
    return (tried[k] if np.isfinite(squares[k]) else changed), left[k]


def _with_effects(model: Model, causes: Sequence[Applied], expected: Expected) -> Model:
    numbers = [full_numbers(cause, expected.response) for cause in causes]
    added = [
        AddedEffect(cause.stage, {name: float(value) for name, value in each.items()})
        for cause, each in zip(causes, numbers, strict=True)
    ]
    return replace(model, effects=[*model.effects, *added], fingerprint=None)


def with_mean_exponent(model: Model, exponent: float) -> Model:
    """`model` with another law of the mean pressure."""
    muscle = model.muscle
    parameters = dict(muscle.parameters)
    parameters["mean_exponent"] = replace(parameters["mean_exponent"], value=exponent)
    return replace(model, muscle=replace(muscle, parameters=parameters))


def _mean_moves(model: Model, changed: Model, expected: Expected) -> bool:
    """Whether the mean of the simulated pressures changes by more than MEAN_MOVED in the first record."""
    try:
        first = expected.pairs[0]
        before, after = (simulate(one, first.raw, begun_s=first.begun_s) for one in (model, changed))
    except RigError:
        return False
    if before.p1_mpa is None or before.p2_mpa is None or after.p1_mpa is None or after.p2_mpa is None:
        return False
    share = float(np.mean(after.p1_mpa + after.p2_mpa) / np.mean(before.p1_mpa + before.p2_mpa))
    return abs(share - 1.0) > MEAN_MOVED


def _less(
    gaps: Sequence[Column], before: list[Column] | None, after: list[Column] | None, expected: Expected
) -> list[Column] | None:
    """For each pair (n,): its gap (deg) less what changes in the simulated angle, at the raw record's times; None where
    a simulator runs away."""
    if before is None or after is None:
        return None
    left = [
        gap - np.interp(pair.t_s, pair.raw.t_s - pair.raw.t_s[0], now - then)
        for pair, gap, then, now in zip(expected.pairs, gaps, before, after, strict=True)
    ]
    return from_own_zeros(left, expected)


def remaining_gap(model: Model | None, causes: Sequence[Applied], expected: Expected) -> list[Column]:
    """For each pair (n,): its angle gap (deg) less what the causes change in the simulated angle.

    By the description of the healthy rig where there is no simulator, or where it runs away under these records.
    """
    if model is None or not causes:
        return commanded_gaps(expected, causes)
    _, left = _with_causes(model, causes, expected)
    return commanded_gaps(expected, causes) if left is None else left


def beside_pressures(
    model: Model | None, ahead: Sequence[Applied], behind: Sequence[Applied], expected: Expected
) -> list[Column]:
    """As `remaining_gap`, for each pair (n,) in deg, but of the angle's gap under the measured pressures, and less only
    what the causes `behind` the monitors change. The simulator has the causes `ahead` of them in it before and after,
    so that what it misses of the pressures counts neither for nor against those behind."""
    gaps = [pair.case.angle_deg - base for pair, base in zip(expected.pairs, expected.base, strict=True)]
    if model is None or not behind:
        return from_own_zeros(gaps, expected)
    before, after = (
        _simulated(_with_effects(model, causes, expected), expected) for causes in (ahead, [*ahead, *behind])
    )
    left = _less(gaps, before, after, expected)
    return remaining_gap(model, [*ahead, *behind], expected) if left is None else left


def _simulated(model: Model, expected: Expected) -> list[Column] | None:
    """The simulated angle (deg) of each pair at the raw record's times; None where the model runs away."""
    try:
        angles = [simulate(model, pair.raw, begun_s=pair.begun_s).angle_deg for pair in expected.pairs]
    except RigError:
        return None
    return [angle for angle in angles if angle is not None]
