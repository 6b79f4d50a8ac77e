"""The response's laws are as late under records of 50 ms as under those of 10: between far rows they go in steps."""

from collections.abc import Callable

import numpy as np
import pytest

from rig.model.compiled.response import RESPONSE_TERMS, STEP_S, propagated, regulated, response_terms
from rig.record import Column

HERTZ = 0.5
LENGTH_S = 12.0


def late_s(column: Column, dt_s: float) -> float:
    """By how much it is behind a sine, over whole periods once that has settled."""
    t = dt_s * np.arange(len(column))
    whole = (t >= 4.0 - 1e-9) & (t < 12.0 - 1e-9)
    turned = np.angle(1j * np.sum(column[whole] * np.exp(-2j * np.pi * HERTZ * t[whole])))
    return -float(turned) / (2 * np.pi * HERTZ)


def sine(dt_s: float) -> Column:
    course: Column = 0.05 * np.sin(2 * np.pi * HERTZ * dt_s * np.arange(round(LENGTH_S / dt_s)))
    return course


def of_regulator(dt_s: float) -> float:
    return late_s(regulated(sine(dt_s), 0.012, 0.04, 0.04, dt_s), dt_s)


def of_bank(dt_s: float) -> float:
    weights = np.zeros(RESPONSE_TERMS)
    weights[[1, 5, 6]] = 20.0, 60.0, 40.0
    return late_s(propagated(0.2 + sine(dt_s), 0.2 - sine(dt_s), 0.2, 0.0, dt_s, weights), dt_s)


@pytest.mark.parametrize("late", [of_regulator, of_bank])
@pytest.mark.parametrize("dt_s", [0.02, 0.05])
def test_coarse_records_are_as_late_as_fine_ones(late: Callable[[float], float], dt_s: float) -> None:
    assert late(dt_s) == pytest.approx(late(STEP_S), abs=2e-3)


@pytest.mark.parametrize("dt_s", [0.005, 0.05])
def test_the_terms_are_those_that_are_propagated(dt_s: float) -> None:
    p1, p2 = 0.2 + sine(dt_s), 0.2 - sine(dt_s)
    terms, weights = np.empty((len(p1), RESPONSE_TERMS)), np.arange(1.0, RESPONSE_TERMS + 1.0)
    response_terms(p1, p2, 0.2, 1.0, dt_s, terms)
    assert propagated(p1, p2, 0.2, 1.0, dt_s, weights) == pytest.approx(terms @ weights)
