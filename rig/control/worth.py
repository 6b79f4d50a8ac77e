"""What a better simulator is worth to a controller, from records alone: the error that its feed-forward leaves.

A record is a movement of which it is known what command made it. A feed-forward from the simulator would have been off
by what the simulator misses of the record, and the feedback would have mended that: the error left is S times the
residual, with the sensitivity S = 1 / (1 + C G) of the loop (see ../explanation/tracking.md). No run is needed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from rig.columns import rms
from rig.control.frequency_response import FrequencyResponse, best_linear_approximation
from rig.control.plant import plant_of
from rig.control.tuning import controller
from rig.gains import ClosedLoop
from rig.model.parameters import Model
from rig.model.resample import on_clock
from rig.model.simulation import simulate
from rig.record import Column, Record

ERROR_AMPLITUDE_MPA: Final = 0.1
"""Size at which the plant is made linear, MPa: what the loop leaves of an error is that of a linear plant."""


@dataclass(frozen=True)
class Worth:
    """rms (deg) of the error that the loop leaves with the feed-forward of each simulator, over all records."""

    before_deg: float
    after_deg: float

    @property
    def closer(self) -> float:
        """Share of the error that goes; negative when it grows."""
        return 1.0 - self.after_deg / self.before_deg if self.before_deg > 0.0 else 0.0


def worth(before: Model, after: Model, records: Sequence[Record], gains: ClosedLoop) -> Worth:
    """Both simulators on the records (with a measured angle), put onto their own clock, under a feedback with these
    gains on the better one. ModelError when one diverges."""
    plant = plant_of(after, after.p0_mpa, round(after.sample_time_s * 1e9))
    response = best_linear_approximation(plant, ERROR_AMPLITUDE_MPA)
    even = [on_clock(record, after.sample_time_s) for record in records]
    left = [
        rms(np.concatenate([mended(_missed(model, record), response, gains) for record in even]))
        for model in (before, after)
    ]
    return Worth(*left)


def mended(error_deg: Column, plant: FrequencyResponse, gains: ClosedLoop) -> Column:
    """What the feedback leaves of an error (n,) that comes by itself: S times it. The error is taken to be at rest
    before and after."""
    n = len(error_deg)
    size = 1 << (2 * n - 1).bit_length()
    frequency = np.fft.rfftfreq(size, plant.period_s).astype(np.float64)
    frequency[0] = frequency[1] / 100.0  # an integral has no value at 0
    loop = plant.at(frequency) * controller(gains, frequency, plant.period_s)
    return np.asarray(np.fft.irfft(np.fft.rfft(error_deg, size) / (1.0 + loop), size)[:n])


def _missed(model: Model, record: Record) -> Column:
    """Measured less simulated angle (n,), 0 where none was measured."""
    simulated = simulate(model, record).angle_deg
    assert simulated is not None
    assert record.angle_deg is not None
    return np.nan_to_num(record.angle_deg - simulated)
