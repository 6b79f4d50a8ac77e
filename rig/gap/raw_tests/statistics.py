"""Intervals and probabilities of the raw-data tests."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from rig.columns import NORMAL_95
from rig.gap.raw_tests.settings import PRIOR_DEGREES
from rig.gap.raw_tests.signature import Size

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(100)
_MANY: Final = 1000.0
"""From so many degrees of freedom on, Student's t is taken for normal."""


def wilson(count: float, rows: float, run: float = 1.0) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927) of rows that come `run` in a row in the mean: so many fewer rows are
    independent."""
    n = max(rows / max(2.0 * run - 1.0, 1.0), 1.0)
    share = count / max(rows, 1.0)
    middle = (share + NORMAL_95**2 / (2 * n)) / (1 + NORMAL_95**2 / n)
    half = NORMAL_95 / (1 + NORMAL_95**2 / n) * float(np.sqrt(share * (1 - share) / n + NORMAL_95**2 / (4 * n**2)))
    return max(middle - half, 0.0), min(middle + half, 1.0)


def about(value: float, spread: float, least: float, most: float = np.inf) -> Size:
    """The value with its normal 95 % interval, within bounds."""
    half = NORMAL_95 * float(spread)
    return Size(value, max(value - half, least), min(value + half, most))


def between_days(values: Sequence[float], prior: float) -> tuple[float, float]:
    """(standard deviation, degrees of freedom) of what days differ by: the days at hand and a prior."""
    own = float(np.sum((np.asarray(values) - np.mean(values)) ** 2)) if len(values) else 0.0
    degrees = PRIOR_DEGREES + max(len(values) - 1, 0)
    return float(np.sqrt((PRIOR_DEGREES * prior**2 + own) / degrees)), degrees


def by_chance(excess: float, spread: float, degrees: float = np.inf, days: int = 0) -> float:
    """One-sided probability that a new day exceeds the others' mean by so much; Student's t with the days' degrees of
    freedom."""
    scale = spread * np.sqrt(1.0 + 1.0 / days) if days else spread
    return student_above(excess / max(float(scale), 1e-30), degrees)


def student_above(t: float, degrees: float) -> float:
    """Probability that Student's t is above t (SciPy's `stdtr` of -t): with t = sqrt(degrees) tan(angle) the density is
    a power of a cosine, which Gauss and Legendre's rule integrates."""
    if degrees > _MANY:
        return 0.5 * math.erfc(t / math.sqrt(2.0))
    if t < 0.0:
        return 1.0 - student_above(-t, degrees)
    from_end = math.atan2(math.sqrt(degrees), t)
    angle = 0.5 * from_end * (_POINTS + 1.0)
    area = 0.5 * from_end * float(_WEIGHTS @ np.sin(angle) ** (degrees - 1.0))
    scale = math.lgamma(0.5 * (degrees + 1.0)) - math.lgamma(0.5 * degrees)
    return min(area * math.exp(scale) / math.sqrt(math.pi), 0.5)
