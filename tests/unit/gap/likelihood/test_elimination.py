"""Every factor of the days, judged by a dense solve of its own."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.likelihood.elimination import by_factors

FACTORS = np.array([1.0, 0.01, 0.5, 3.0, 100.0])


@given(
    seed=st.integers(0, 1000),
    days=st.integers(0, 9),
    others=st.integers(0, 5),
    decades=st.floats(0.0, 1.5),
    silent=st.integers(0, 3),
)
def test_a_factor_says_what_a_dense_solve_says(seed: int, days: int, others: int, decades: float, silent: int) -> None:
    random, count = np.random.default_rng(seed), days + others
    patterns = random.normal(size=(40, count)) * 10.0 ** random.uniform(-decades, decades, count)
    patterns[:, :silent] = 0.0  # patterns that these records do not show
    gram, shown = patterns.T @ patterns, patterns.T @ random.normal(size=40)
    said, log_root = by_factors(gram, shown, days, FACTORS)
    for k, factor in enumerate(FACTORS):
        times = np.concatenate([np.full(days, factor), np.ones(others)])
        matrix = np.eye(count) + gram * np.outer(times, times)
        assert said[k] == pytest.approx((shown * times) @ np.linalg.solve(matrix, shown * times), rel=1e-8, abs=1e-8)
        assert log_root[k] == pytest.approx(0.5 * np.linalg.slogdet(matrix)[1], rel=1e-8, abs=1e-8)
