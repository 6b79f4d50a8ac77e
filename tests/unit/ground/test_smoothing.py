"""Running means by numpy alone, judged by SciPy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter1d, median_filter, uniform_filter1d

from rig.smoothing import filled, response_of_smoothing, running_mean, running_median_at, smoothed, thinned

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


@given(seed=SEEDS, rows=st.integers(40, 600), apart=st.integers(1, 9), share=st.floats(0.0, 0.7))
def test_what_is_slow_goes_through_thinning_and_back(seed: int, rows: int, apart: int, share: float) -> None:
    per_row, phase = 0.5 * share / apart, 2.0 * np.pi * np.random.default_rng(seed).random()
    column = np.sin(2.0 * np.pi * per_row * np.arange(rows * apart) + phase)
    back = filled(thinned(column, apart), apart, len(column))
    inner = slice(16 * apart, -16 * apart)
    assert len(back) == len(column)
    assert back[inner] == pytest.approx(column[inner], abs=0.02)


@given(apart=st.integers(2, 9), share=st.floats(1.3, 1.9))
def test_what_is_too_fast_is_gone_after_thinning(apart: int, share: float) -> None:
    column = np.sin(np.pi * share / apart * np.arange(80 * apart))
    assert np.max(np.abs(thinned(column, apart)[10:-10])) < 0.02


def test_a_straight_line_stays_one_to_its_ends() -> None:
    line, level = np.linspace(-3.0, 7.0, 203), np.full(203, 3.0)
    assert filled(thinned(line, 8), 8, 203)[:190] == pytest.approx(line[:190], abs=1e-3)
    assert filled(thinned(level, 8), 8, 203) == pytest.approx(level)
