"""The levels of a reference: slopes of the likelihood that they are fitted by, and what families have to do with it."""

from dataclasses import replace

import numpy as np
import pytest

from rig.gap.calibrate import START, fit_levels
from rig.gap.evidence.gaussian import Gaussian
from rig.gap.evidence.lines import lines_of
from rig.gap.reference.expectation import Parts
from rig.gap.settings import fitted

ROWS, DT_S = 400, 0.02


def day(seed: int, offset: float) -> Parts:
    """A day whose angle differs from what is expected by an offset of that usual size, and by noise."""
    random = np.random.default_rng(seed)
    lines = lines_of([ROWS], [DT_S], [np.ones(ROWS)], 6.0)
    angle = 10.0 * np.sin(2 * np.pi * 0.3 * DT_S * np.arange(ROWS))
    columns = lines.of(np.column_stack([np.full(ROWS, 20.0), angle]))
    gap = 20.0 * offset * random.normal() + 0.003 * random.normal() * angle + random.normal(0.0, 0.1, ROWS)
    envelope = lines.envelope(lines.of(angle), 0.5, 0.1)
    return Parts(lines, gap, columns, ("offset", "gain"), envelope, 20.0, np.full(len(envelope), 1e-4))


def test_slopes_of_the_density_are_those_of_differences() -> None:
    random = np.random.default_rng(3)
    one = Gaussian(np.exp(random.normal(0.0, 0.5, 40)), random.normal(0.0, 1.0, (40, 3)), 25.0, 8.0)
    residual = random.normal(0.0, 2.0, 40)
    by_pattern, by_line = one.log_slopes(residual)
    step = 1e-5
    for k in range(3):
        scale = np.ones(3)
        scale[k] += step
        moved = replace(one, patterns=one.patterns * scale).log_density(residual)
        assert by_pattern[k] == pytest.approx((moved - one.log_density(residual)) / step, rel=1e-3, abs=1e-4)
    for k in (0, 7, 39):
        variance = one.variance.copy()
        variance[k] *= 1.0 + step
        moved = replace(one, variance=variance).log_density(residual)
        assert by_line[k] == pytest.approx((moved - one.log_density(residual)) / step, rel=1e-3, abs=1e-4)


def test_a_family_counts_once_and_the_start_as_one_more() -> None:
    quiet, loud = [day(k, 1e-4) for k in range(6)], [day(100 + k, 0.05) for k in range(12)]
    prior = fitted().prior
    alone, other, both = (fit_levels(each, prior) for each in ([quiet], [loud], [quiet, loud]))
    assert alone.patterns["offset"] < 0.7 * START["offset"], "the days count"
    assert alone.patterns["offset"] > 1.5 * 1e-4, "and are not believed of the next build"
    assert alone.patterns["offset"] < both.patterns["offset"] < other.patterns["offset"]
    by_hand = (alone.patterns["offset"] * other.patterns["offset"]) ** (2 / 3) * START["offset"] ** (-1 / 3)
    assert both.patterns["offset"] == pytest.approx(by_hand, rel=1e-6)
