"""What a converter's step leaves in the angle is known by its spectrum, wherever its lattice lies."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.lines import lines_of
from rig.gap.reference.expectation import Factor
from rig.gap.settings import UNEVEN_CODES

ROWS, DT_S = 2000, 0.01
LINES = lines_of([ROWS], [DT_S], [np.ones(ROWS)], 6.0)
TIME_S = DT_S * np.arange(ROWS)
COUNT = len(LINES.frequency_hz)


def factor() -> Factor:
    healthy = Gaussian(np.full(COUNT, 1e-4), np.zeros((COUNT, 1)), 25.0, 6.0, 1)
    return Factor(LINES, np.zeros(ROWS), healthy, 0.01)


def rounding(angle_deg: "np.typing.NDArray[np.float64]", step_deg: float, at: float) -> "np.typing.NDArray[np.float64]":
    return step_deg * (np.round(angle_deg / step_deg + at) - at) - angle_deg


@settings(max_examples=25)
@given(st.floats(0.2, 1.0), st.floats(0.5, 4.0), st.floats(0.0, 1.0))
def test_what_rounding_leaves_is_as_large_as_is_said_in_the_lines_that_are_compared(
    hz: float, step_deg: float, at: float
) -> None:
    angle = 12.0 * np.sin(2 * np.pi * hz * TIME_S) + 3.0 * np.sin(2 * np.pi * 0.37 * hz * TIME_S)
    left = LINES.of(rounding(angle, step_deg, at))
    said = factor().rounded_to(step_deg, angle).healthy.variance - 1e-4
    assert np.sum(said) == pytest.approx(UNEVEN_CODES * np.sum(left**2), rel=0.7)


def test_it_lies_where_the_motion_puts_it() -> None:
    """A joint that moves over few steps leaves slow errors, and none at the frequencies that it does not reach."""
    angle = 1.5 * np.sin(2 * np.pi * 0.3 * TIME_S)
    said = factor().rounded_to(2.0, angle).healthy.variance - 1e-4
    slow, fast = LINES.frequency_hz < 1.5, LINES.frequency_hz > 4.0
    assert np.mean(said[slow]) > 5.0 * np.mean(said[fast])


def test_the_floor_rises_by_what_rounding_leaves() -> None:
    angle = 12.0 * np.sin(2 * np.pi * 0.3 * TIME_S)
    assert factor().rounded_to(2.0, angle).floor == pytest.approx(np.sqrt(UNEVEN_CODES / 12.0) * 2.0, rel=0.1)
    assert factor().rounded_to(1e-6, angle).floor == pytest.approx(0.01, rel=1e-3)
