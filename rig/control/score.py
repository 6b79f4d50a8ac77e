"""How well an angle followed its reference: error, lag, and what it cost."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from rig.columns import filled_in, rms, vertex_offset
from rig.errors import RecordError
from rig.record import Column

MOST_LAG_S: Final = 0.5
"""Lags are looked for up to here, to both sides."""


@dataclass(frozen=True)
class TrackingScore:
    """Of one record's sweep."""

    rmse_deg: float
    max_deg: float
    lag_s: float
    """By how much the angle is later than its reference, where it fits best; NaN for a reference that stands still."""
    effort_mpa: float
    """rms of the differential pressure commanded."""
    travel_mpa_s: float
    """How far that went a second: what wears valves and uses air."""


def score(angle_deg: Column, reference_deg: Column, dp_cmd_mpa: Column, period_s: float) -> TrackingScore:
    """Of columns (n,) of one record; rows without a measured angle do not count. RecordError where none has one."""
    known = np.isfinite(angle_deg)
    if not known.any():
        raise RecordError("no angle was measured in any row: there is nothing to score")
    error = (reference_deg - angle_deg)[known]
    travel = float(np.sum(np.abs(np.diff(dp_cmd_mpa)))) / max(period_s * (len(dp_cmd_mpa) - 1), period_s)
    lag = lag_s(filled_in(angle_deg), reference_deg, period_s)
    return TrackingScore(rms(error), float(np.max(np.abs(error))), lag, rms(dp_cmd_mpa), travel)


def lag_s(angle_deg: Column, reference_deg: Column, period_s: float) -> float:
    """The shift (s) of the reference (n,) from which the angle (n,), without gaps, differs least but for an offset;
    between ticks by a parabola. NaN where the reference stands still or has fewer than four rows."""
    most = min(round(MOST_LAG_S / period_s), len(reference_deg) // 4)
    if most < 1 or not np.ptp(reference_deg) > 0.0:
        return float("nan")
    inner = angle_deg[most : len(angle_deg) - most]
    lags = np.arange(-most, most + 1)
    left = np.array([np.var(inner - reference_deg[most - lag : len(reference_deg) - most - lag]) for lag in lags])
    best = int(np.argmin(left))
    return float((lags[best] + vertex_offset(left, best)) * period_s)
