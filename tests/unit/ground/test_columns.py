"""What is asked of columns everywhere, with values missing and without."""

import numpy as np
import pytest

from rig.columns import correlation, filled_in, vertex_offset
from rig.record import Column

NAN = np.nan


@pytest.mark.parametrize(
    ("column", "whole"),
    [
        ([1.0, NAN, NAN, 4.0], [1.0, 2.0, 3.0, 4.0]),
        ([NAN, 2.0, 3.0, NAN], [2.0, 2.0, 3.0, 3.0]),
        ([1.0, 2.0], [1.0, 2.0]),
        ([NAN, NAN], [NAN, NAN]),
        ([], []),
    ],
    ids=["between", "at the ends", "none missing", "all missing", "no row"],
)
def test_missing_values_lie_on_lines_between_their_neighbours(column: list[float], whole: list[float]) -> None:
    given: Column = np.array(column)
    found = filled_in(given)
    assert np.array_equal(found, whole, equal_nan=True)
    assert found is not given, "whoever fills in may write to what comes out"


RISING: Column = np.arange(5.0)


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (RISING, 3.0 - 2.0 * RISING, -1.0),
        (RISING, np.array([NAN, 1.0, 2.0, 3.0, 99.0]) * [1, 1, 1, 1, NAN], 1.0),
        (RISING, np.full(5, 0.2), 0.0),
        (RISING, np.array([0.0, NAN, NAN, NAN, NAN]), 0.0),
    ],
    ids=["against", "of the rows that both have", "one stands still", "one row"],
)
def test_a_correlation_is_of_what_both_have(one: Column, other: Column, expected: float) -> None:
    assert correlation(one, other) == pytest.approx(expected)


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["smallest", "largest"])
def test_an_extremum_of_a_parabola_is_found_between_its_rows(sign: float) -> None:
    column: Column = sign * (np.arange(7.0) - 3.2) ** 2
    assert vertex_offset(column, 3) == pytest.approx(0.2)


@pytest.mark.parametrize("row", [0, 2, 4], ids=["first", "three equal", "last"])
def test_an_extremum_without_a_parabola_stays_at_its_row(row: int) -> None:
    assert vertex_offset(np.ones(5), row) == 0.0
