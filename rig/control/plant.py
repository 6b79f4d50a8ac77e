"""A model as what a controller sees of it: differential pressure in, angle from rest out, on the grid of the loop.

Angles are zeroed as a run zeroes them: from where the joint rests at P0. What no command can change or make undone
(noise, hum, lost samples, the steps of a converter) is left out.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from rig.excite.setpoints import around
from rig.model.chain import stage_of
from rig.model.parameters import Model
from rig.model.simulation import simulate
from rig.record import Column, Record

REST_S: Final = 4.0
"""At rest before anything moves: what is slow in a model (creep, tanks) has come to its end."""


@dataclass(frozen=True)
class Plant:
    """The response of `model` about the rest pressure `p0_mpa`, one sample each `period_s`."""

    model: Model
    p0_mpa: float
    period_s: float

    def angle_deg(self, dp_mpa: Column) -> Column:
        """The angle (n,) that the loop reads at each tick while it writes dp (n,), both at rest before; ModelError when
        the model diverges. A tick is read before its own set-point is written."""
        rest = round(REST_S / self.period_s)
        dp = np.concatenate([np.zeros(rest), dp_mpa])
        times = self.period_s * np.arange(len(dp), dtype=np.float64)
        record = Record("feed-forward", times, dp, None, *around(self.p0_mpa, dp))
        angle = simulate(self.model, record).angle_deg
        assert angle is not None
        return np.asarray(angle[rest:] - np.mean(angle[rest - rest // 8 : rest]))


def plant_of(model: Model, p0_mpa: float, period_ns: int, *, effects: bool = True) -> Plant:
    """The plant of a model, with those of its effects that a command can do something about, or without any."""
    kept = [one for one in model.effects if effects and not stage_of(one).in_samples]
    return Plant(replace(model, effects=kept), p0_mpa, period_ns * 1e-9)
