"""The simulator with the named causes added: a model like any other, for `pamrig simulate` and the simulated rig; and
how far the gap shrinks with it.

The response model that names causes (`rig.gap.reference.nominal`) propagates an effect to the angle better than a
simulator does. What a user gets is the simulator's: so it is asked itself, on the records at hand.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from rig.errors import RigError
from rig.gap.answer.result import Diagnosis
from rig.gap.days.engine import overall_gap
from rig.gap.days.handover import MEAN_MOVED, must
from rig.gap.days.prepared import Prepared
from rig.gap.hypotheses.propagate import Applied, full_numbers
from rig.gap.raw_tests.levels import loudness
from rig.identify.descent import descend, square_sum
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.kernels import simulate
from rig.model.parameters import AddedEffect, Model
from rig.record import Column

MEAN_EXPONENTS = (0.6, 0.7, 0.8, 0.9, 1.0)
"""Laws of the mean pressure that are tried: d = (p1 - p2) (2 P0 / (p1 + p2))^exponent; 1 without, less with passive
stiffness."""

TUNED = 0.4
"""Most by which a size is changed for the simulator's sake."""
WORSE = 0.8
"""A cause is left out of the simulator when without it this share of the mean square is left."""


def augmented(model: Model, diagnosis: Diagnosis, prepared: Prepared) -> Model:
    """`model` with every cause, those found by their signature included, and a word on where they come from."""
    causes = [cause.applied for cause in diagnosis.causes if cause.applied is not None]
    names = ", ".join(cause.effect for cause in causes) or "nothing"
    made = with_causes(model, causes, prepared)
    law = "" if made.muscle == model.muscle else " and another law of the mean pressure"
    text = f"{model.provenance.text} With {names}{law} added by pamrig gap diagnose.".strip()
    return replace(made, provenance=replace(model.provenance, text=text))


def with_causes(model: Model, causes: Sequence[Applied], prepared: Prepared) -> Model:
    """`model` with each cause as an added effect, all its numbers written out."""
    return _with_all(model, causes, prepared, _simulated(model, prepared))[0]


def helping(model: Model | None, causes: Sequence[Applied], prepared: Prepared) -> list[Applied]:
    """The causes without those that make the simulator follow the records worse; all of them without a simulator."""
    kept = list(causes)
    if model is None or not kept:
        return kept
    before = _simulated(model, prepared)
    best = _with_all(model, kept, prepared, before)[1]
    while kept:
        fewer = [kept[:k] + kept[k + 1 :] for k in range(len(kept))]
        left = [_with_all(model, some, prepared, before)[1] for some in fewer]
        k = int(np.argmin(left))
        if not left[k] < WORSE * best:
            break
        kept, best = fewer[k], left[k]
    return kept


def tuned(
    model: Model | None, causes: Sequence[Applied], sizes: Sequence[Collection[str]], prepared: Prepared
) -> list[Applied]:
    """The causes with the numbers that are each one's size (`sizes`: their names) as serves the simulator best on these
    records: its loops are not the rig's, and the same cause counts a little more or less in them. Unchanged without a
    simulator, or where it runs away."""
    before = None if model is None or not causes else _simulated(model, prepared)
    if model is None or before is None:
        return list(causes)
    mean_learnt = _with_all(model, causes, prepared, before)[0]

    def scaled(shares: Column) -> list[Applied]:
        return [
            replace(cause, numbers=_scaled(cause, names, float(share)))
            for cause, names, share in zip(causes, sizes, shares, strict=True)
        ]

    def left(shares: Column) -> Column:
        changed = replace(mean_learnt, effects=[*model.effects, *_added(scaled(shares), prepared)])
        changes = _changes(before, _simulated(changed, prepared))
        if changes is None:
            return np.full(sum(len(pair) for pair in prepared.pairs), np.inf)
        return np.concatenate(_less(changes, prepared))

    ones = np.ones(len(causes))
    best = descend(left, ones, (1.0 - TUNED) * ones, (1.0 + TUNED) * ones, 4)
    return scaled(best.x) if np.isfinite(best.cost) else list(causes)


def _scaled(cause: Applied, names: Collection[str], share: float) -> dict[str, float]:
    """The cause's numbers, those named times a share; within the stage's bounds."""
    bounds = {number.name: (number.low, number.high) for number in EFFECT_STAGES[cause.stage].numbers}
    return {
        name: float(np.clip(share * value, *bounds[name])) if name in names else value
        for name, value in cause.numbers.items()
    }


def _added(causes: Sequence[Applied], prepared: Prepared) -> list[AddedEffect]:
    return [
        AddedEffect(cause.stage, {name: float(value) for name, value in full_numbers(cause, prepared.nominal).items()})
        for cause in causes
    ]


def _with_all(
    model: Model, causes: Sequence[Applied], prepared: Prepared, before: list[Column] | None
) -> tuple[Model, float]:
    """`model` with all causes, and the sum of squares that it leaves of the gap; where they change the mean pressure,
    with the law of the mean pressure that leaves least, because the records that `model` was identified on never showed
    another."""
    changed = replace(model, effects=[*model.effects, *_added(causes, prepared)], fingerprint=None)
    tried = [changed]
    if causes and "mean_exponent" in model.muscle.parameters and _mean_moves(model, changed, prepared):
        tried = [with_mean_exponent(changed, exponent) for exponent in MEAN_EXPONENTS]
    left = [_left_deg2(before, _simulated(one, prepared), prepared) for one in tried]
    k = int(np.argmin(left))
    return (tried[k], left[k]) if np.isfinite(left[k]) else (changed, left[k])


def with_mean_exponent(model: Model, exponent: float) -> Model:
    """`model` with another law of the mean pressure."""
    muscle = model.muscle
    parameters = dict(muscle.parameters)
    parameters["mean_exponent"] = replace(parameters["mean_exponent"], value=exponent)
    return replace(model, muscle=replace(muscle, parameters=parameters))


def _mean_moves(model: Model, changed: Model, prepared: Prepared) -> bool:
    """Whether the mean of the simulated pressures changes by more than MEAN_MOVED in the first record."""
    try:
        before, after = (simulate(one, prepared.pairs[0].raw) for one in (model, changed))
    except RigError:
        return False
    if before.p1_mpa is None or before.p2_mpa is None or after.p1_mpa is None or after.p2_mpa is None:
        return False
    share = float(np.mean(after.p1_mpa + after.p2_mpa) / np.mean(before.p1_mpa + before.p2_mpa))
    return abs(share - 1.0) > MEAN_MOVED


def _left_deg2(before: list[Column] | None, after: list[Column] | None, prepared: Prepared) -> float:
    """Sum of squares that is left of the gap; infinite where the simulator runs away."""
    changes = _changes(before, after)
    return np.inf if changes is None else sum(square_sum(left) for left in _less(changes, prepared))


def _less(changes: Sequence[Column], prepared: Prepared) -> list[Column]:
    """For each pair (n,): its angle gap (deg) less these changes at the raw record's times."""
    return [
        gap - np.interp(pair.t_s, pair.raw.t_s - pair.raw.t_s[0], change) * pair.used
        for pair, gap, change in zip(prepared.pairs, overall_gap(prepared, []), changes, strict=True)
    ]


def remaining_gap(model: Model | None, causes: Sequence[Applied], prepared: Prepared) -> list[Column]:
    """For each pair (n,): its angle gap (deg) less what the causes change in the simulated angle.

    By the description of the healthy rig where there is no simulator, or where it runs away under these records.
    """
    if model is None or not causes:
        return overall_gap(prepared, causes)
    changes = simulated_changes(model, with_causes(model, causes, prepared), prepared)
    return overall_gap(prepared, causes) if changes is None else _less(changes, prepared)


def noise_fraction(model: Model | None, causes: Sequence[Applied], prepared: Prepared) -> float:
    """The explained fraction of the noise (rms of second differences), for causes whose course no simulator can repeat.

    1 without baselines or simulator: the numbers were fitted to just that.
    """
    changes = None if model is None else simulated_changes(model, with_causes(model, causes, prepared), prepared)
    if changes is None or not prepared.has_baseline:
        return 1.0
    parts = [
        loudness(must(pair.raw.angle_deg), [must(day.angle_deg) for day in pair.raw_baselines], change)
        for pair, change in zip(prepared.pairs, changes, strict=True)
    ]
    gap, left, floor = (sum(part) for part in zip(*parts, strict=True))
    return float(np.clip((gap - left) / max(gap - floor, 1e-12), -1.0, 1.0))


def simulated_changes(model: Model, changed: Model, prepared: Prepared) -> list[Column] | None:
    """For each pair, at the raw record's times: by how much the angle (deg) of `changed` differs; None where one runs
    away."""
    return _changes(_simulated(model, prepared), _simulated(changed, prepared))


def _changes(before: list[Column] | None, after: list[Column] | None) -> list[Column] | None:
    if before is None or after is None:
        return None
    return [now - then for then, now in zip(before, after, strict=True)]


def _simulated(model: Model, prepared: Prepared) -> list[Column] | None:
    """The simulated angle (deg) of each pair at the raw record's times; None where the model runs away."""
    try:
        return [must(simulate(model, pair.raw).angle_deg) for pair in prepared.pairs]
    except RigError:
        return None
