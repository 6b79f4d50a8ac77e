"""The levels of a reference: slopes of the likelihood that they are fitted by, and what families have to do with it."""

from dataclasses import replace

import numpy as np
import pytest

from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.lines import lines_of
from rig.gap.prior_fitting.levels import START, fit_levels, fit_monitors
from rig.gap.priors import FactorLevels, Levels, fitted
from rig.gap.reference.expectation import Parts
from rig.gap.reference.monitors import misread
from rig.gap.reference.patterns import VALVE_PATTERNS

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


def both_factors(seed: int, own_share: float, offset_mpa: float = 2e-3) -> tuple[Parts, Parts]:
    """A day whose monitors show an offset of which `own_share` of the variance is their own error; 100 deg/MPa."""
    random = np.random.default_rng(seed)
    lines = lines_of([ROWS] * 2, [DT_S] * 2, [np.ones(ROWS)] * 2, 6.0)
    alone = lines_of([ROWS], [DT_S], [np.ones(ROWS)], 6.0)
    own, true = (offset_mpa * np.sqrt(part) * random.normal(size=2) for part in (own_share, 1.0 - own_share))
    first = np.zeros((2 * ROWS, 2 * len(VALVE_PATTERNS)))
    first[:ROWS, 0], first[ROWS:, len(VALVE_PATTERNS)] = 1.0, 1.0
    columns = lines.of(first)
    gap = np.repeat(own + true, ROWS) + random.normal(0.0, 1e-4, 2 * ROWS)
    even = np.full(len(columns), 1e-4)
    pressures = Parts(lines, gap, columns, VALVE_PATTERNS * 2, even, 0.2, np.full(len(columns), 1e-8))
    through = np.column_stack([np.full(ROWS, 100.0), np.full(ROWS, -100.0)])
    deg = -through @ own + random.normal(0.0, 0.01, ROWS)
    even = np.full(int(alone.counts[0]), 1e-4)
    angle = Parts(alone, deg, alone.of(through), ("monitor_mpa",) * 2, even, 20.0, np.full(len(even), 1e-4))
    return pressures, angle


SHOWN = FactorLevels(dict.fromkeys(VALVE_PATTERNS, 1e-6) | {"offset_mpa": 2e-3}, 1e-3, 1e-3, 0.01)
FELT = FactorLevels({"monitor_mpa": 2e-3}, 1e-3, 1e-3, 0.01)


@pytest.mark.parametrize(("own_share", "low", "high"), [(1.0, 0.9, 0.9), (0.0, 0.0, 0.2)])
def test_the_share_that_is_the_monitors_own_is_found(own_share: float, low: float, high: float) -> None:
    days = [both_factors(k, own_share) for k in range(12)]
    assert low <= fit_monitors([days[:6], days[6:]], SHOWN, FELT, fitted().prior) <= high


def test_what_the_pressures_show_is_taken_off_the_angle_and_leaves_less_doubt() -> None:
    pressures, angle = both_factors(1, 1.0)
    prior = fitted().prior
    factor = pressures.factor(SHOWN, prior)
    left = pressures.lines.of(pressures.gap)
    wrong = misread(factor, left, Levels(SHOWN, FELT, 0.0, 0.9))
    assert np.array(wrong.offset_mpa) == pytest.approx(0.9 * pressures.gap[[0, -1]], abs=2e-4)
    assert wrong.spread_mpa < 0.5 * FELT.patterns["monitor_mpa"]
    assert wrong.levels(FELT).patterns["monitor_mpa"] == wrong.spread_mpa
    untied = misread(factor, left, Levels(SHOWN, FELT, 0.0, 0.0))
    assert untied.offset_mpa == (0.0, 0.0)
    assert untied.spread_mpa == pytest.approx(FELT.patterns["monitor_mpa"])
    said = [
        angle.factor(levels, prior).healthy.log_density(angle.lines.of(angle.gap) + taken)
        for levels, taken in (
            (FELT, np.zeros(len(angle.columns))),
            (wrong.levels(FELT), angle.columns @ np.array(wrong.offset_mpa)),
        )
    ]
    assert said[1] > said[0], "the healthy day is the likelier for it"


def test_what_a_description_misses_counts_by_its_squares_and_without_the_start() -> None:
    quiet, loud = [day(k, 1e-4) for k in range(6)], [day(100 + k, 0.05) for k in range(12)]
    prior = fitted().prior
    alone, other, both = (
        fit_levels(each, prior, of_days=False).patterns["offset"] for each in ([quiet], [loud], [quiet, loud])
    )
    assert both == pytest.approx(np.sqrt(0.5 * (alone**2 + other**2)), rel=1e-6)
