"""How a column is heard to follow its command: the correlations at all lags are those of each lag by itself."""

import numpy as np
import pytest

from rig.identify.records.monitors import FOLLOWED_S, LONGEST_LAG_S, correlation, correlations
from rig.record import Column, Record

T_S = np.arange(0.0, 8.0, FOLLOWED_S)


def steps_late() -> Column:
    """Still but for its last half second, and far from zero."""
    return 1e3 + np.where(T_S > 7.5, np.sin(9.0 * T_S), 0.0)


@pytest.mark.parametrize(
    "command", [0.2 * np.sin(2.0 * T_S), steps_late(), np.random.default_rng(1).standard_normal(len(T_S))]
)
@pytest.mark.parametrize("lag_s", [0.0, 0.4])
def test_at_every_lag_it_is_the_correlation_of_the_rows_that_are_so_far_apart(command: Column, lag_s: float) -> None:
    column = 0.3 + np.interp(T_S - lag_s, T_S, command) + 0.01 * np.random.default_rng(2).standard_normal(len(T_S))
    found = correlations(Record("one", T_S, command), column, command)
    t = np.linspace(T_S[0], T_S[-1], int((T_S[-1] - T_S[0]) / FOLLOWED_S))
    heard, said = np.interp(t, T_S, column), np.interp(t, T_S, command)
    assert len(found) == round(LONGEST_LAG_S / FOLLOWED_S)
    expected = [correlation(said[: len(t) - lag], heard[lag:]) for lag in range(len(found))]
    assert found == pytest.approx(np.array(expected), abs=1e-9)


@pytest.mark.parametrize("value", [0.0, 0.2, 1e3])
def test_what_stands_still_follows_nothing(value: float) -> None:
    still = np.full(len(T_S), value)
    command = np.sin(2.0 * T_S)
    record = Record("one", T_S, command)
    assert not np.any(correlations(record, still, command))
    assert not np.any(correlations(record, command, still))
