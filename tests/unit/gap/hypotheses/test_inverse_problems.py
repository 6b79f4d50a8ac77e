"""What is unsure of the angle because the pressures are others than on the earlier days."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.plants.gap_rigs import baselines, model, session

from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses.inverse_problems import angle_forward, at_another_time, other_pressures, rougher_beyond
from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.lines import lines_of
from rig.gap.priors import fitted
from rig.gap.response.propagate import as_late_as_measured
from rig.model.parameters import AddedEffect

ROWS, DT_S = 2000, 0.01
LINES = lines_of([ROWS], [DT_S], [np.ones(ROWS)], 6.0)
TIME_S = DT_S * np.arange(ROWS)


@given(st.floats(2.5, 5.0), st.floats(0.0, 0.2), st.floats(0.01, 3.0))
def test_a_line_taken_at_another_time_leaves_what_it_turned_by(hz: float, later_s: float, size: float) -> None:
    later_s = min(later_s, 0.24 / hz)
    missed = size * np.sin(2 * np.pi * hz * TIME_S)
    left = size * np.sin(2 * np.pi * hz * (TIME_S - later_s)) - missed
    said = float(at_another_time(LINES, missed, np.array([later_s])).sum())
    assert said == pytest.approx(float(np.sum(left**2)), rel=0.4, abs=1e-3 * size**2 * ROWS)


def test_what_is_far_away_in_time_is_twice_as_much_and_no_more() -> None:
    missed = np.sin(2 * np.pi * 2.0 * TIME_S)
    said = [float(at_another_time(LINES, missed, np.array([later_s])).sum()) for later_s in (0.25, 1.0, 60.0)]
    assert said[0] == pytest.approx(2.0 * np.sum(missed**2), rel=0.2)
    assert said[2] == pytest.approx(said[1], rel=0.15)


def test_at_the_same_time_nothing_is_left() -> None:
    assert float(at_another_time(LINES, np.cos(TIME_S), np.zeros(1)).sum()) == 0.0


@pytest.mark.parametrize("known_hz", [0.8, 2.0])
def test_a_description_is_rougher_beyond_what_its_rig_was_excited_at_and_nowhere_else(known_hz: float) -> None:
    rougher = rougher_beyond(LINES, known_hz)
    assert not rougher[LINES.frequency_hz <= known_hz].any()
    far = LINES.frequency_hz > known_hz
    assert rougher[far] == pytest.approx((LINES.frequency_hz[far] / known_hz) ** 2 - 1.0)


def test_a_description_may_answer_other_pressures_several_times_as_roughly_or_as_well_as_it_says() -> None:
    slow = AddedEffect("valve_lag", {"tau_s": 0.1})
    _, grounds = diagnose_with_grounds(model(), session(157, slow), [list(day) for day in baselines()])

    def healthy(answer: float) -> Gaussian:
        shipped = fitted()
        settings = replace(shipped, prior=replace(shipped.prior, answer=answer))
        return angle_forward(grounds.expected, settings).factor.healthy

    lines = angle_forward(grounds.expected, fitted()).factor.lines
    late = [as_late_as_measured(context) for context in grounds.expected.contexts]
    moved_deg, missed = other_pressures(grounds.expected, late)
    changed = lines.of(moved_deg)
    rough = 4.0 * missed * changed * np.random.default_rng(5).standard_normal(len(changed))
    assert healthy(6.0).log_density(rough) > healthy(0.0).log_density(rough) + 3.0, "so rough it may be"
    exact = np.zeros_like(changed)
    assert healthy(6.0).log_density(exact) > healthy(0.0).log_density(exact) - np.log(2.0) - 1e-9, "or as it says"
