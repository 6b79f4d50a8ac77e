"""The numbers of a law that leave least of a gap: the least that there is, and with how few trials."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from rig.gap.hypotheses.descent import Changed, Nearest, nearest
from rig.gap.likelihood.gaussian import Gaussian
from rig.record import Column

LINES = 40


def judged_by(seed: int) -> Gaussian:
    draw = np.random.default_rng(seed)
    return Gaussian(draw.uniform(0.5, 2.0, LINES), 3.0 * draw.normal(size=(LINES, 4)), 20.0, 6.0)


def counted(changed: Changed, trials: list[Column]) -> Changed:
    def at(x: Column) -> Column:
        trials.append(x)
        return changed(x)

    return at


def found(changed: Changed, gap: Column, by: Gaussian, start: Column, steps: int = 30) -> Nearest:
    return nearest(changed, gap, by, start, (-5.0 * np.ones(len(start)), 5.0 * np.ones(len(start))), steps)


@given(st.integers(0, 10_000), st.integers(1, 3))
def test_a_law_in_proportion_is_found_by_its_slopes_and_one_step(seed: int, count: int) -> None:
    draw, by, trials = np.random.default_rng(seed), judged_by(seed), list[Column]()
    shapes = draw.normal(size=(LINES, count))
    gap = shapes @ draw.uniform(-1.0, 1.0, count) + 0.1 * draw.normal(size=LINES)
    fit = found(counted(lambda x: shapes @ x, trials), gap, by, np.zeros(count))
    gram, pull = by.normal(shapes, gap)
    assert fit.x == pytest.approx(np.linalg.solve(gram, pull), abs=2e-3)
    assert fit.slopes == pytest.approx(shapes)
    assert len(trials) <= 1 + count + 2  # where it begins, its slopes, the step, and one where damping left a rest


@given(st.integers(0, 10_000))
def test_a_law_that_bends_is_found_too(seed: int) -> None:
    draw, by = np.random.default_rng(seed), judged_by(seed)
    shapes = draw.normal(size=(LINES, 2))

    def changed(x: Column) -> Column:
        out: Column = shapes @ np.array([np.sinh(x[0]), x[1] * np.exp(0.3 * x[0])])
        return out

    truth = draw.uniform(0.5, 1.5, 2)
    gap = changed(truth) + 0.05 * draw.normal(size=LINES)
    root = np.linalg.cholesky(np.linalg.inv(np.diag(by.variance) * LINES / by.effective + by.patterns @ by.patterns.T))
    best = least_squares(lambda x: root.T @ (gap - changed(x)), truth)
    fit = found(changed, gap, by, np.array([1.0, 1.0]))
    assert fit.chi_square == pytest.approx(2.0 * best.cost, rel=1e-3)


def test_slopes_that_are_known_are_not_asked_for() -> None:
    by, trials = judged_by(1), list[Column]()
    slopes, gap = np.linspace(-1.0, 1.0, LINES)[:, None], np.sin(np.arange(LINES))
    gram, pull = by.normal(slopes, gap)
    likeliest, bounds = pull / gram[0], (-np.ones(1), np.ones(1))
    nearest(counted(lambda x: slopes @ x, trials), gap, by, likeliest, bounds, 6, slopes)
    assert len(trials) == 1


def test_a_law_that_runs_away_from_the_start_leaves_no_number() -> None:
    fit = found(lambda _: np.full(LINES, np.nan), np.ones(LINES), judged_by(1), np.ones(1))
    assert not np.isfinite(fit.chi_square)


def test_a_step_into_a_law_that_runs_away_is_shortened() -> None:
    shape = np.linspace(-1.0, 1.0, LINES)
    fit = found(lambda x: shape * (x[0] if x[0] < 1.0 else np.nan), 1.2 * shape, judged_by(2), np.array([0.1]))
    assert 0.1 < fit.x[0] < 1.0
