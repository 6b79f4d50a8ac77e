"""Least squares with coefficients that cannot be negative, judged by SciPy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from rig.identify.response.nonnegative import nonnegative


@given(seed=st.integers(0, 10_000), columns=st.integers(1, 11), free=st.integers(0, 11))
def test_it_misses_as_little_as_scipys_bounded_least_squares(seed: int, columns: int, free: int) -> None:
    random = np.random.default_rng(seed)
    rows, wanted = random.normal(size=(columns + 3, columns)), random.normal(size=columns + 3)
    found = nonnegative(rows, wanted, free)
    low = np.where(np.arange(columns) < free, -np.inf, 0.0)
    best = lsq_linear(rows, wanted, (low, np.full(columns, np.inf)), method="bvls", tol=1e-14)
    assert np.all(found >= low)
    assert np.sum((rows @ found - wanted) ** 2) == pytest.approx(2.0 * best.cost, rel=1e-9, abs=1e-12)


def test_what_would_be_negative_is_nought_and_the_others_make_up_for_it() -> None:
    rows = np.array([[1.0, 1.0], [0.0, 1.0]])
    assert nonnegative(rows, np.array([1.0, -1.0]), 0) == pytest.approx([1.0, 0.0])
    assert nonnegative(rows, np.array([1.0, -1.0]), 2) == pytest.approx([2.0, -1.0])
