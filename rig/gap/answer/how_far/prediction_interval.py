"""The interval of what is left on further records: how far one may be off who says how far the gap shrinks.

What is left on records that the fit has not seen is known as its mean square, L^2, with a standard error e by those
records. Further records are of another excitation: what a law misses grows with what it changes, rho (G^2 - F^2) for a
law that usually misses the share rho, and a day is never known better than a healthy day is, F^2. So

    left^2 lies between max(L, F)^2 - below s and max(L, F)^2 + above s,
    s^2 = e^2 + (floor F^2)^2 + (law rho (G^2 - F^2))^2.

The four numbers are fitted as split conformal prediction does (Lei et al., JASA 113, 2018, 1094): `below` and `above`
are quantiles of (left^2 - max(L, F)^2) / s on development cases, whose untouched records show what is left. Cases of
one build are alike, and the next build is another: the ends are the mean over plant families of each family's own
quantiles (docs/decisions/0588).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.gap.priors import Spread
from rig.record import Column

PREDICTION_LEVEL = 0.90
"""Of the interval."""
FLOORS = (0.1, 0.2, 0.4, 0.8)
PREDICTION_LAW_SHARES = (0.1, 0.2, 0.4, 0.8)
"""Shares that are tried."""


@dataclass(frozen=True)
class Shrunk:
    """What a gap was and what is left of it, rms in deg."""

    before_deg: float
    floor_deg: float
    per_record_deg2: tuple[float, ...]
    """Mean squares left on each record, by fits that have not seen it."""
    rho: float
    """The roughest law's usual error, as a share."""

    @property
    def after_deg2(self) -> float:
        """Mean square left."""
        return float(np.mean(self.per_record_deg2))

    @property
    def middle_deg2(self) -> float:
        """Mean square that further records are expected to show: no less than a healthy day's."""
        return max(self.after_deg2, self.floor_deg**2)


def scale_deg2(one: Shrunk, floor: float, law: float) -> float:
    """s, deg^2."""
    count = len(one.per_record_deg2)
    error = float(np.std(one.per_record_deg2, ddof=1)) / np.sqrt(count) if count > 1 else one.after_deg2
    closed = max(one.before_deg**2 - one.floor_deg**2, 0.0)
    return float(np.sqrt(error**2 + (floor * one.floor_deg**2) ** 2 + (law * one.rho * closed) ** 2)) + 1e-12


def prediction_interval(one: Shrunk, spread: Spread) -> tuple[float, float]:
    """Rms (deg) that further records will show, low and high; what was left here lies between."""
    scale = scale_deg2(one, spread.floor, spread.law)
    low = min(one.middle_deg2 - spread.below * scale, one.after_deg2)
    return float(np.sqrt(max(low, 0.0))), float(np.sqrt(one.middle_deg2 + spread.above * scale))


def fit_spread(cases: Sequence[Shrunk], left_deg2: Sequence[float], families: Sequence[str]) -> Spread:
    """The shares with the narrowest intervals (mean logarithm of their width), and the quantiles that hold
    PREDICTION_LEVEL of what was left (mean squares, deg^2, above what a healthy day shows there), on average over the
    families."""
    off = np.array([left - one.middle_deg2 for one, left in zip(cases, left_deg2, strict=True)])
    of = np.array(families)
    return min(
        (_at(cases, off, of, floor, law) for floor in FLOORS for law in PREDICTION_LAW_SHARES),
        key=lambda found: found[0],
    )[1]


def _at(cases: Sequence[Shrunk], off: Column, of: NDArray[np.str_], floor: float, law: float) -> tuple[float, Spread]:
    """(mean logarithm of the width, the spread) with these shares."""
    scale = np.array([scale_deg2(one, floor, law) for one in cases])
    each = [conformal((off / scale)[of == family]) for family in np.unique(of)]
    ends = float(np.mean([below for below, _ in each])), float(np.mean([above for _, above in each]))
    return float(np.mean(np.log(scale))) + float(np.log(sum(ends))), Spread(floor, law, *ends, len(cases))


def conformal(scores: Column) -> tuple[float, float]:
    """How far below and above zero an interval must reach to hold PREDICTION_LEVEL of further scores (n,) like
    these: the quantiles of order (n + 1) p, the outermost where there are too few."""
    ordered, count, tail = np.sort(scores), len(scores), 0.5 * (1.0 - PREDICTION_LEVEL)
    least = int(np.floor((count + 1) * tail)) - 1
    below, above = ordered[max(least, 0)], ordered[min(count - 1 - least, count - 1)]
    return max(float(-below), 0.01), max(float(above), 0.01)
