"""Running means by numpy alone, judged by SciPy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter1d, median_filter, uniform_filter1d

from rig.smoothing import response_of_smoothing, running_mean, running_median_at, smoothed

SEEDS, LENGTHS = st.integers(0, 1000), st.integers(1, 80)


@given(seed=SEEDS, rows=LENGTHS, deviation=st.floats(0.1, 30.0))
def test_a_bell_is_scipys_at_both_kinds_of_end(seed: int, rows: int, deviation: float) -> None:
    column = np.random.default_rng(seed).standard_normal(rows)
    assert np.allclose(smoothed(column, deviation), gaussian_filter1d(column, deviation, mode="nearest"), atol=1e-13)
    assert np.allclose(smoothed(column, deviation, mirrored=True), gaussian_filter1d(column, deviation), atol=1e-13)


@given(st.floats(0.2, 8.0), st.floats(0.0, 0.5))
def test_what_is_left_of_a_sine_is_known(deviation: float, per_row: float) -> None:
    left = smoothed(np.cos(2.0 * np.pi * per_row * np.arange(-100, 101)), deviation)[100]
    assert response_of_smoothing(deviation, np.array([per_row])) == pytest.approx([left], abs=1e-12)


@given(seed=SEEDS, rows=LENGTHS, window=st.integers(1, 20))
def test_a_running_mean_is_scipys(seed: int, rows: int, window: int) -> None:
    column = np.random.default_rng(seed).standard_normal(rows)
    assert np.allclose(running_mean(column, window), uniform_filter1d(column, window), atol=1e-13)


@given(seed=SEEDS, rows=LENGTHS, window=st.integers(1, 60), at=st.integers(0, 79))
def test_a_running_median_is_scipys(seed: int, rows: int, window: int, at: int) -> None:
    column = np.random.default_rng(seed).standard_normal(rows)
    at %= rows
    assert running_median_at(column, at, window) == median_filter(column, window, mode="nearest")[at]
