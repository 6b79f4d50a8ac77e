"""Where a gap lies over time, by the rows that were measured."""

from dataclasses import replace

import numpy as np
import pytest

from rig.gap.answer.where import over_time
from rig.gap.records.pairs import Pair, pair_up
from rig.record import Column, Record

T = np.arange(0.0, 20.0, 0.005)


def pair(hole: tuple[float, float] | None) -> Pair:
    """A record whose rows count but for a hole, s."""
    command = 0.1 * np.sin(2 * np.pi * 0.5 * T)
    made = pair_up([Record("sine", T, command, angle_deg=100.0 * command)], [], 0.2).pairs[0]
    if hole is None:
        return made
    inside = (made.t_s > hole[0]) & (made.t_s < hole[1])
    return replace(made, used=np.where(inside, 0.0, made.used))


def steps(of: Pair, at_s: float) -> Column:
    return np.where(of.t_s < at_s, 1.0, 3.0) * of.used


@pytest.mark.parametrize("hole", [None, (0.0, 6.0), (14.0, 20.0), (8.0, 12.0)])
def test_a_steady_gap_has_neither_drift_nor_step_whatever_was_not_measured(hole: tuple[float, float] | None) -> None:
    one = pair(hole)
    (told,) = over_time([one], [2.0 * one.used])
    assert told.first_quarter_rms_deg == told.last_quarter_rms_deg == pytest.approx(2.0)
    assert told.drift_deg_min == pytest.approx(0.0, abs=1e-9)
    assert told.step_at_s is None


@pytest.mark.parametrize("hole", [None, (14.0, 20.0), (1.0, 4.0)])
def test_a_step_is_told_where_it_is(hole: tuple[float, float] | None) -> None:
    one = pair(hole)
    (told,) = over_time([one], [steps(one, 9.0)])
    assert told.step_at_s == pytest.approx(9.0, abs=0.05)
    assert told.first_quarter_rms_deg == pytest.approx(1.0)
    assert told.last_quarter_rms_deg == pytest.approx(3.0)
