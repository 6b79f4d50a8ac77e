"""How a law may be wrong: in proportion to what it changes, and later in proportion to what moves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.hypotheses.law_errors import law_patterns
from rig.gap.likelihood.lines import lines_of

ROWS, DT_S = 2000, 0.01
LINES = lines_of([ROWS, ROWS], [DT_S, DT_S], [np.ones(ROWS)] * 2, 6.0)
MOTION = np.concatenate([np.sin(2 * np.pi * hz * DT_S * np.arange(ROWS)) for hz in (0.3, 0.8)])


@given(st.floats(0.1, 100.0))
def test_a_constant_makes_nothing_later(constant: float) -> None:
    """It is larger or smaller, and does not free what is fast in the change."""
    bare, shifted = (law_patterns(LINES.of(MOTION + add), LINES, 0.1) for add in (0.0, constant))
    assert shifted[:, -1] == pytest.approx(bare[:, -1], abs=1e-9 * constant)
    assert np.sum(shifted[:, 0] ** 2) > np.sum(bare[:, 0] ** 2)


@given(st.floats(0.01, 0.5))
def test_what_moves_is_later_by_as_much_as_it_is_larger(rho: float) -> None:
    moved = LINES.of(MOTION - MOTION.mean())
    made = law_patterns(moved, LINES, rho)
    assert np.sum(made[:, -1] ** 2) == pytest.approx(rho**2 * np.sum(moved**2), rel=1e-3)
    assert np.sum(made[:, :-1] ** 2) == pytest.approx(rho**2 * np.sum(moved**2), rel=1e-9)
