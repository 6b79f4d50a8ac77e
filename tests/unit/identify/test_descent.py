"""Least squares within bounds: what stands at a bound does not hold the others; SciPy judges."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from rig.identify.response.descent import descend
from rig.record import Column


def line(
    slopes: Column, wanted: Column, start: Column, low: Column, high: Column, steps: int = 80
) -> tuple[Column, float]:
    fit = descend(lambda x: slopes @ x - wanted, start, low, high, steps)
    return fit.x, fit.cost


@pytest.mark.parametrize("start", [[0.5, 0.0], [1.0, 0.0], [1.0, 4.0], [0.0, -5.0]])
def test_a_least_beyond_one_bound_lets_the_other_parameter_move(start: list[float]) -> None:
    """A long narrow valley whose end lies at x = 2; the least within x <= 1 is where the valley meets the bound."""
    slopes = np.array([[1.0, 0.99], [0.0, 0.05]])
    low, high = np.array([0.0, -5.0]), np.array([1.0, 5.0])
    x, _ = line(slopes, slopes @ np.array([2.0, 0.5]), np.array(start), low, high, 8)
    second = 0.5 + 0.99 / (0.99**2 + 0.05**2)
    assert x == pytest.approx([1.0, second], abs=1e-6)


@given(seed=st.integers(0, 10**6), count=st.integers(1, 6))
def test_the_least_within_a_box_is_found(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    slopes = random.normal(size=(30, count)) * 10.0 ** random.uniform(-1, 1, count)
    slopes[:, 0] += 3.0 * random.uniform(-1, 1) * slopes[:, -1] * (count > 1)
    wanted = slopes @ random.uniform(-2, 2, count) + random.normal(0, 0.05 * np.max(np.abs(slopes)), 30)
    low, high = -np.ones(count), np.ones(count)
    x, cost = line(slopes, wanted, random.uniform(-1, 1, count), low, high)
    assert np.all((low <= x) & (x <= high))
    assert cost <= 2.0 * lsq_linear(slopes, wanted, (low, high), tol=1e-12).cost * 1.001 + 1e-12


def test_from_a_corner_that_all_want_to_leave_outwards_nothing_moves() -> None:
    x, cost = line(np.eye(2), np.array([3.0, -3.0]), np.array([1.0, -1.0]), -np.ones(2), np.ones(2))
    assert (x.tolist(), cost) == ([1.0, -1.0], 8.0)
