"""How far the gap shrinks once the causes are in the simulator, on records that their fit has not seen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from rig.gap.answer.augment import remaining_gap
from rig.gap.hypotheses.fit import Fit, refit
from rig.gap.hypotheses.given import scene_given
from rig.gap.hypotheses.propagate import Applied
from rig.gap.hypotheses.scenes import PRESSURES, angle_scene, on_records, pressure_scene
from rig.gap.reference.build import Expected
from rig.gap.settings import Fitted
from rig.model.parameters import Model
from rig.record import Column

DRAWS = 400
"""Resamples of the records behind the interval."""
SEED = 20
"""Of these resamples: the same records give the same interval."""
LEVEL = 0.90
"""Of the interval."""


@dataclass(frozen=True)
class HowFar:
    """Rms of the simulator's error, deg, with the causes in it."""

    after_deg: float
    low_deg: float
    high_deg: float
    """90 % interval for further records of the same kind."""
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
    random = np.random.default_rng(SEED)
    drawn = np.sqrt(np.mean(left[random.integers(count, size=(DRAWS, count))], axis=1))
    middle = float(np.sqrt(left.mean()))
    ends = np.quantile(drawn, (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL))
    low, high = (float(middle * (value / max(middle, 1e-12)) ** widening(count)) for value in ends)
    return HowFar(middle, low, high, tuple(left.tolist()))


def widening(count: int) -> float:
    """By how much the resampled spread of the mean over `count` records (on logarithmic axes) falls short of what as
    many further records will show: those scatter as well, the spread itself is known from few, and resampling takes it
    by one record too small (Efron and Tibshirani 1993, ch. 5; Student's t for a prediction)."""
    if count < 2:
        return 1.0
    quantile = 0.5 + 0.5 * LEVEL
    heavier = float(stdtrit(count - 1, quantile) / ndtri(quantile))
    return heavier * float(np.sqrt(2.0 * count / (count - 1)))


def _refitted(k: int, causes: Sequence[tuple[str, Fit]], some: Expected, settings: Fitted, whole: Expected) -> Applied:
    """The k-th cause fitted to some of the records, beside the others on its factor."""
    name, fit = causes[k]
    scene = pressure_scene(some, settings, whole) if name == PRESSURES else angle_scene(some, settings, whole)
    for other in (one for j, (where, one) in enumerate(causes) if where == name and j != k):
        scene = scene_given(scene, other)
    return refit(fit, scene)


def _mean_square(gap: Column, used: Column) -> float:
    return float(np.sum(gap**2 * used) / max(float(used.sum()), 1.0))
