"""Fits the levels of a reference: how much healthy days differ from what it expects, by maximum likelihood.

What comes in are healthy days beside their reference, of many units; nothing of a case with an effect is looked at.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from rig.gap.reference.expectation import Parts
from rig.gap.settings import FactorLevels, Prior
from rig.record import Column

START = {
    "offset_mpa": 1e-3, "gain": 5e-3, "lag_s": 2e-3, "curvature_s2": 1e-4, "one_way_s": 1e-3, "bend": 5e-3,
    "offset": 3e-3,
    "loop": 0.05, "monitor_mpa": 8e-4, "monitor_gain": 5e-3, "mean_law": 0.03, "drift": 1e-3, "warming": 2e-3,
    "bank": 3e-3,
}  # fmt: skip
"""Where the search begins, and what a level falls back to of which the days say nothing; units as in the names."""
MOST = {"gain": 0.1, "monitor_gain": 0.06, "loop": 0.5, "mean_law": 0.5}
"""Largest levels that physics allows: a monitor is at most 6 % of full scale off (data sheet), a simulator 10 % of
gain. Two patterns that all but undo each other would else grow without end."""
START_SHARE, START_EVEN = 0.01, 0.003
PULL = 0.02
"""How firmly levels are held to the start, per squared factor e, in nats."""
ROUNDS = 40


def fit_levels(days: Sequence[Parts], prior: Prior) -> FactorLevels:
    """The likeliest levels of one factor over all days."""
    names = list(dict.fromkeys(days[0].names))
    start = np.log([*(START[name] for name in names), START_SHARE, START_EVEN])

    def levels(x: Column) -> FactorLevels:
        values = np.exp(x).tolist()
        return FactorLevels(dict(zip(names, values, strict=False)), values[-2], values[-1], floor)

    floor = float(np.sqrt(np.mean([(day.rms(day.gap) / day.span) ** 2 for day in days])))
    residuals = [day.lines.of(day.gap) for day in days]

    def cost(x: Column) -> float:
        here = levels(x)
        said = sum(day.factor(here, prior).healthy.log_density(gap) for day, gap in zip(days, residuals, strict=True))
        return float(PULL * np.sum((x - start) ** 2) - said)

    bounds = [(None, float(np.log(MOST[name])) if name in MOST else None) for name in names] + [(None, None)] * 2
    found = minimize(cost, start, method="L-BFGS-B", bounds=bounds, options={"maxiter": ROUNDS})
    return levels(found.x)
