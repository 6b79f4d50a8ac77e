"""A healthy physics rig, run by the shipped session and diagnosed by its own model's file: as a newcomer tries it.

One record of that session leaves the joint elsewhere than any description of it says.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pamrig
import pytest

from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.lines import lines_of
from rig.gap.reference.expectation import Factor

ROWS, DT_S, OFF_DEG = 400, 0.02, 1.5


def test_a_healthy_rig_lacks_nothing_by_its_own_model(tmp_path: Path) -> None:
    rig = pamrig.load_rig("physics_mckibben")
    first, second = (pamrig.run("gap", replace(rig, seed=seed), out=tmp_path / f"day_{seed}") for seed in (3, 4))
    model = pamrig.identify(first.records).model
    assert pamrig.diagnose(model, second.records, reference="fingerprint").verdict == "none"


@pytest.fixture
def factor() -> Factor:
    """Two records of which the second stands off as a whole."""
    lines = lines_of([ROWS, ROWS], [DT_S, DT_S], [np.ones(ROWS)] * 2, 6.0)
    gap = np.concatenate([np.zeros(ROWS), np.full(ROWS, OFF_DEG)])
    count = len(lines.frequency_hz)
    return Factor(lines, gap, Gaussian(np.full(count, 0.01 * ROWS), np.zeros((count, 1)), 60.0, 6.0), 0.1)


def test_a_record_may_stand_off_by_what_is_missed_and_no_more(factor: Factor) -> None:
    gap = factor.lines.of(factor.gap)
    assert factor.standing_off(0.0) is factor, "earlier days rest where the case does"
    far, near = (factor.standing_off(missed).healthy.chi_square(gap) for missed in (0.1 * OFF_DEG, OFF_DEG))
    plain = factor.healthy.chi_square(gap)
    assert near < 0.2 * plain
    assert near < far < plain
    inside = replace(factor, gap=OFF_DEG * np.sin(2 * np.pi * DT_S * np.arange(2 * ROWS)))
    left = inside.standing_off(OFF_DEG).healthy.chi_square(inside.lines.of(inside.gap))
    each = OFF_DEG * np.repeat(np.eye(2), ROWS, axis=0)
    np.testing.assert_array_equal(factor.standing_off(OFF_DEG).healthy.patterns[:, 1:], factor.lines.of(each))
    assert left > 0.9 * inside.healthy.chi_square(inside.lines.of(inside.gap)), "a course within a record is no offset"
