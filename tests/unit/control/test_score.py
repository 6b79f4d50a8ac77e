"""How well an angle followed: known errors give their own numbers."""

import math

import numpy as np
import pytest

from rig.control.score import lag_s, score
from rig.errors import RecordError

PERIOD_S = 0.005
T = PERIOD_S * np.arange(2000)


@pytest.mark.parametrize("late_s", [-0.1, -0.0123, 0.0, 0.004, 0.05, 0.2])
def test_a_lag_is_found_between_ticks(late_s: float) -> None:
    reference, angle = (20 * np.sin(2 * np.pi * 0.5 * (T - shift)) for shift in (0.0, late_s))
    assert lag_s(angle, reference, PERIOD_S) == pytest.approx(late_s, abs=2e-4)


def test_a_reference_that_stands_still_has_no_lag() -> None:
    assert math.isnan(lag_s(np.zeros(100), np.ones(100), PERIOD_S))


def test_an_offset_is_error_and_no_lag() -> None:
    reference = 20 * np.sin(2 * np.pi * 0.5 * T)
    found = score(reference + 2.0, reference, np.sin(T), PERIOD_S)
    assert (found.rmse_deg, found.max_deg) == pytest.approx((2.0, 2.0))
    assert found.lag_s == pytest.approx(0.0, abs=1e-3)
    assert found.travel_mpa_s == pytest.approx(float(np.mean(np.abs(np.cos(T)))), rel=0.01)


def test_where_no_angle_was_measured_there_is_nothing_to_score() -> None:
    with pytest.raises(RecordError, match="no angle was measured"):
        score(np.full(50, np.nan), np.zeros(50), np.zeros(50), 0.005)


def test_rows_without_an_angle_do_not_count() -> None:
    reference = 20 * np.sin(2 * np.pi * 0.5 * T)
    angle = reference + 1.0
    angle[100:200] = np.nan
    assert score(angle, reference, np.zeros_like(T), PERIOD_S).rmse_deg == pytest.approx(1.0)
