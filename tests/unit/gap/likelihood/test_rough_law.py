"""What a rough law leaves is judged as if its patterns were written out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.hypotheses.law_errors import law_patterns, log_densities, rough_law, with_law
from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.lines import lines_of
from rig.gap.priors import fitted

ROWS, DT_S = (2000, 1953, 1300), 0.01
LINES = lines_of(ROWS, [DT_S] * 3, [np.ones(rows) for rows in ROWS], 6.0)


def _drawn(seed: int) -> tuple[Gaussian, np.ndarray, np.ndarray]:
    """What is expected, what a law changes and what it leaves."""
    random = np.random.default_rng(seed)
    count = len(LINES.frequency_hz)
    patterns = random.normal(size=(count, 7)) * np.exp(random.normal(size=7))
    healthy = Gaussian(np.exp(random.normal(size=count)), patterns, 25.0, 12.0, 4, 10.0)
    return healthy, *random.normal(size=(2, count))


@given(st.integers(0, 1000), st.floats(0.01, 1.0))
def test_products_are_those_of_patterns_that_are_written_out(seed: int, rho: float) -> None:
    healthy, moved, left = _drawn(seed)
    scale = 1.0 / np.sqrt(healthy.variance)
    gram, shown = rough_law(healthy, LINES, moved, rho).products(scale, left * scale)
    whole = np.hstack([healthy.patterns, law_patterns(moved, LINES, rho)]) * scale[:, None]
    assert gram == pytest.approx(whole.T @ whole, rel=1e-9, abs=1e-9)
    assert shown == pytest.approx(whole.T @ (left * scale), rel=1e-9, abs=1e-9)


@given(st.integers(0, 1000))
def test_every_roughness_is_judged_as_by_itself(seed: int) -> None:
    healthy, moved, left = _drawn(seed)
    prior, rhos = fitted().prior, [0.0, 0.05, 0.4]
    alone = [with_law(healthy, LINES, moved, rho, prior).log_density(left) for rho in rhos]
    assert log_densities(healthy, LINES, moved, left, rhos, prior) == pytest.approx(alone, rel=1e-9)
