"""How much less surely a response is known under records that are faster than those its levels were fitted on."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.lines import lines_of
from rig.gap.records.pairs import Pair
from rig.gap.reference.expectation import Factor
from rig.gap.reference.faster_records import doubt, fastest_hz, known_hz
from rig.gap.settings import USUAL_HZ
from rig.record import Column, Record

DT_S = 0.01
T_S = np.arange(2000) * DT_S


def pair(dp: Column) -> Pair:
    return cast(Any, SimpleNamespace(u1_mpa=0.2 + dp / 2, u2_mpa=0.2 - dp / 2, dt_s=DT_S))


def sine(hz: float) -> Column:
    return np.asarray(0.2 * np.sin(2 * np.pi * hz * T_S))


@given(st.floats(0.1, 10.0))
def test_a_sine_is_as_fast_as_it_is(hz: float) -> None:
    assert fastest_hz(sine(hz), DT_S) == pytest.approx(hz, abs=0.15)


def test_a_slow_triangle_is_no_fast_record_and_rest_is_none() -> None:
    triangle = 0.2 * np.abs((0.5 * T_S) % 1.0 - 0.5)
    assert fastest_hz(triangle, DT_S) == pytest.approx(0.5, abs=0.06)
    assert fastest_hz(np.zeros_like(T_S), DT_S) == 0.0


def test_a_rig_is_known_up_to_its_fastest_record_and_at_least_as_far_as_levels_are() -> None:
    records = [Record(f"{hz}", T_S, sine(hz)) for hz in (0.2, 3.0)]
    assert known_hz(records) == pytest.approx(3.0, abs=0.06)
    assert known_hz(records[:1]) == USUAL_HZ


def test_only_records_faster_than_what_is_known_are_doubted() -> None:
    known = 0.9
    pairs = [pair(sine(hz)) for hz in (0.5, 4.0 * known)]
    lines = lines_of([2000] * 4, [DT_S] * 4, [np.ones(2000)] * 4, 6.0)  # two monitors
    times = doubt(pairs, lines, known)
    slow = np.isin(lines.record, (0, 2))
    np.testing.assert_array_equal(times[slow], 1.0)
    np.testing.assert_allclose(times[~slow], 4.0, rtol=0.05)


def test_what_is_known_less_surely_is_no_louder() -> None:
    noise, times = np.array([1.0, 1.0, 3.0]), np.array([1.0, 4.0, 4.0])
    lines = lines_of([5], [DT_S], [np.ones(5)], 50.0)
    known = Gaussian(np.array([2.0, 2.0, 2.0]), np.ones((3, 1)), 3.0, 5.0)
    factor = Factor(lines, np.zeros(5), known, 1.0).less_sure(times, noise)
    np.testing.assert_allclose(factor.healthy.variance, [2.0, 1.0 + 16.0, 2.0])
    np.testing.assert_allclose(factor.healthy.patterns[:, 0], times)
