"""A difference of set-points is split about the P0 that its record says, whatever the model's is."""

import numpy as np
import pytest

from rig.conditions import MEASURED_REST
from rig.model.resample import held_commands, set_points
from rig.record import Record

DP = 0.1 * np.sin(np.linspace(0.0, 6.0, 50))


@pytest.mark.parametrize(
    ("facts", "rest"),
    [({}, 0.2), ({"p0_mpa": 0.15}, 0.15), ({MEASURED_REST: 0.25}, 0.25), ({"p0_mpa": 0.15, MEASURED_REST: 0.25}, 0.15)],
)
def test_a_difference_is_split_about_the_records_own_rest(facts: dict[str, float], rest: float) -> None:
    record = Record("one", 0.005 * np.arange(50), DP, facts=facts)
    first, second = set_points(record, 0.2)
    np.testing.assert_allclose(first, rest + DP / 2)
    np.testing.assert_allclose(second, rest - DP / 2)
    np.testing.assert_allclose(held_commands(record, 0.2)[0][1:], first[:-1])


def test_set_points_that_were_written_stand() -> None:
    record = Record("one", 0.005 * np.arange(50), DP, None, 0.3 + DP / 2, 0.3 - DP / 2, facts={"p0_mpa": 0.15})
    np.testing.assert_allclose(set_points(record, 0.2)[0], 0.3 + DP / 2)
