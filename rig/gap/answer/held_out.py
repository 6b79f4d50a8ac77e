"""How far the gap shrinks once the causes are in the simulator, on records that their fit has not seen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.gap.answer.augment import remaining_gap
from rig.gap.hypotheses.fit import Fit, refit
from rig.gap.hypotheses.given import scene_given
from rig.gap.hypotheses.scenes import PRESSURES, angle_scene, on_records, pressure_scene
from rig.gap.reference.build import Expected
from rig.gap.response.propagate import Applied
from rig.gap.settings import Fitted
from rig.model.parameters import Model
from rig.record import Column


@dataclass(frozen=True)
class HowFar:
    """Rms of the simulator's error, deg, with the causes in it."""

    after_deg: float
    per_record_deg2: tuple[float, ...]
    """Mean square of each record, by a fit to the others."""


def how_far(causes: Sequence[tuple[str, Fit]], expected: Expected, model: Model | None, settings: Fitted) -> HowFar:
    """Causes with the factor that each was found on; each record is judged by a fit to the other half of the
    records."""
    count = len(expected.tracks)
    left = np.zeros(count)
    for odd in (0, 1) if count > 1 else (0,):
        seen = [k for k in range(count) if k % 2 != odd] or [0]
        some = on_records(expected, seen)
        applied = [_refitted(k, causes, some, settings, expected) for k in range(len(causes))]
        remaining = remaining_gap(model, applied, expected)
        for k in range(count):
            if k % 2 == odd or count == 1:
                left[k] = _mean_square(remaining[k], expected.pairs[k].used)
    return HowFar(float(np.sqrt(left.mean())), tuple(left.tolist()))


def _refitted(k: int, causes: Sequence[tuple[str, Fit]], some: Expected, settings: Fitted, whole: Expected) -> Applied:
    """The k-th cause fitted to some of the records, beside the others on its factor."""
    name, fit = causes[k]
    scene = pressure_scene(some, settings, whole) if name == PRESSURES else angle_scene(some, settings, whole)
    for other in (one for j, (where, one) in enumerate(causes) if where == name and j != k):
        scene = scene_given(scene, other)
    return refit(fit, scene)


def _mean_square(gap: Column, used: Column) -> float:
    return float(np.sum(gap**2 * used) / max(float(used.sum()), 1.0))
