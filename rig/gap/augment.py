"""The simulator with the named causes added: a model like any other, for `pamrig simulate` and the simulated rig; and how far the
gap shrinks with it.

The description of the healthy rig that names causes (`rig.gap.nominal`) carries an effect to the angle better than a simulator does.
What a user gets is the simulator's: so it is asked itself, on the records at hand.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.errors import RigError
from rig.gap.carry import Applied, full_numbers
from rig.gap.engine import overall_gap
from rig.gap.handover import must
from rig.gap.lost import high_rms
from rig.gap.nominal import Nominal
from rig.gap.prepared import Prepared
from rig.gap.result import Diagnosis
from rig.log.record import Column
from rig.model.kernels import simulate
from rig.model.parameters import AddedEffect, Model


def augmented(model: Model, diagnosis: Diagnosis, nominal: Nominal) -> Model:
    """`model` with every cause, those found by their signature included, and a word on where they come from."""
    causes = [cause.applied for cause in diagnosis.causes if cause.applied is not None]
    names = ", ".join(cause.effect for cause in causes) or "nothing"
    text = f"{model.provenance.text} With {names} added by pamrig gap diagnose.".strip()
    return replace(with_causes(model, causes, nominal), provenance=replace(model.provenance, text=text))


def with_causes(model: Model, causes: Sequence[Applied], nominal: Nominal) -> Model:
    """`model` with each cause as an added effect, all its numbers written out."""
    added = [
        AddedEffect(cause.stage, {name: float(value) for name, value in full_numbers(cause, nominal).items()}) for cause in causes
    ]
    return replace(model, effects=[*model.effects, *added])


def remaining_gap(model: Model | None, causes: Sequence[Applied], prepared: Prepared) -> list[Column]:
    """For each pair (n,): its angle gap (deg) less what the causes change in the simulated angle.

    By the description of the healthy rig where there is no simulator, or where it runs away under these records.
    """
    if model is None or not causes:
        return overall_gap(prepared, causes)
    changes = simulated_changes(model, causes, prepared)
    if changes is None:
        return overall_gap(prepared, causes)
    return [
        gap - np.interp(pair.t_s, pair.raw.t_s - pair.raw.t_s[0], change) * pair.used
        for pair, gap, change in zip(prepared.pairs, overall_gap(prepared, []), changes, strict=True)
    ]


def noise_fraction(model: Model | None, causes: Sequence[Applied], prepared: Prepared) -> float:
    """The explained fraction of the noise (rms of second differences), for causes whose course no simulator can repeat.

    1 without baselines or simulator: the numbers were fitted to just that.
    """
    changes = None if model is None else simulated_changes(model, causes, prepared)
    if changes is None or not prepared.has_baseline:
        return 1.0
    gap = left = floor = 0.0
    for pair, change in zip(prepared.pairs, changes, strict=True):
        days = [must(day.angle_deg) for day in pair.raw_baselines]
        usual = [high_rms(day) for day in days]
        base, now = float(np.mean(usual)), high_rms(must(pair.raw.angle_deg))
        rows = min(len(change), *(len(day) for day in days))
        said = float(np.mean([high_rms(day[:rows] + change[:rows]) for day in days]))
        gap, left, floor = gap + (now - base) ** 2, left + (now - said) ** 2, floor + float(np.var(usual))
    return float(np.clip((gap - left) / max(gap - floor, 1e-12), -1.0, 1.0))


def simulated_changes(model: Model, causes: Sequence[Applied], prepared: Prepared) -> list[Column] | None:
    """For each pair, at the raw record's times: what the causes change in the simulated angle (deg); None where the model runs away."""
    changed = with_causes(model, causes, prepared.nominal)
    try:
        sims = [[must(simulate(one, pair.raw).angle_deg) for one in (model, changed)] for pair in prepared.pairs]
    except RigError:
        return None
    return [after - before for before, after in sims]
