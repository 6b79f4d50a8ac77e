"""How far a gap shrinks is judged on what the fit has not seen: other records, or the other half of a single one."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.plants.gap_rigs import model, session

from rig.gap.answer.how_far import held_out
from rig.gap.answer.how_far.halves import in_halves
from rig.gap.answer.how_far.held_out import how_far
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses.fit import Fit, ForwardModel, refit
from rig.gap.priors import fitted
from rig.gap.reference.gaps import commanded_gaps, rms_of
from rig.gap.response.causes import Applied
from rig.model.parameters import AddedEffect
from rig.record import Column


@given(st.lists(st.lists(st.sampled_from([0.0, 1.0]), min_size=4, max_size=30), min_size=1, max_size=5))
def test_every_row_lies_in_one_half_and_a_single_record_is_cut_in_time(records: list[list[float]]) -> None:
    used = [np.array(rows) for rows in records]
    halves = in_halves(used)
    assert all(set(half) <= {0.0, 1.0} and len(half) == len(rows) for half, rows in zip(halves, used, strict=True))
    if len(records) > 1:
        assert [set(half) for half in halves] == [{float(k % 2)} for k in range(len(records))]
    else:
        assert np.all(np.diff(halves[0]) >= 0.0)
        assert abs(used[0] @ halves[0] - used[0] @ (1.0 - halves[0])) <= 1.0


@pytest.mark.parametrize("count", [1, 3])
def test_each_row_is_judged_once_by_a_fit_that_has_not_seen_it(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    records = session(71, AddedEffect("valve_lag", {"tau_s": 0.03}))[:count]
    found, grounds = diagnose_with_grounds(model(), records)
    expected = grounds.expected
    fit = grounds.posteriors[0].fits["valve_lag"]
    seen: list[float] = []

    def watched(one: Fit, forward: ForwardModel) -> Applied:
        seen.append(float(forward.factor.lines.used.sum()))
        return refit(one, forward)

    def remaining(_model: Any, _causes: Sequence[Applied], given: Any) -> list[Column]:
        return [np.ones(len(pair)) for pair in given.pairs]

    monkeypatch.setattr(held_out, "refit", watched)
    monkeypatch.setattr(held_out, "remaining_gap", remaining)
    far = how_far([("pressures", fit)], expected, grounds.simulator, fitted())
    assert far.per_record_deg2 == pytest.approx([1.0] * count)
    whole = 2.0 * sum(float(pair.used.sum()) for pair in expected.pairs)  # both valves
    assert len(seen) == 2
    assert sum(seen) == pytest.approx(whole)
    assert max(seen) < 0.75 * whole
    assert len(found.evidence.records) == count


def test_what_one_half_of_a_record_teaches_holds_for_the_other() -> None:
    found, grounds = diagnose_with_grounds(model(), session(71, AddedEffect("valve_lag", {"tau_s": 0.03}))[:1])
    assert [cause.effect for cause in found.causes] == ["valve_lag"]
    assert found.gap.after_deg < 0.5 * found.gap.rms_deg
    assert found.retuning is not None
    assert found.retuning.after_deg > 0.0
    assert len(grounds.expected.contexts) == 1


def test_a_long_record_counts_for_more_after_as_before() -> None:
    """Before, each row counted alike, and after, each record: with nothing in the simulator a gap of 1 deg was left as
    another one, and what closed some of it was no better than nothing."""
    short, *whole = session(71, AddedEffect("valve_lag", {"tau_s": 0.03}))[:3]
    few = short.t_s < short.t_s[0] + 0.3 * (short.t_s[-1] - short.t_s[0])
    records = [short.rows(few), *whole]
    _, grounds = diagnose_with_grounds(model(), records)
    expected = grounds.expected
    left = how_far([], expected, grounds.simulator, fitted())
    assert left.after_deg == pytest.approx(rms_of(commanded_gaps(expected), expected.pairs))
    assert left.after_deg**2 != pytest.approx(float(np.mean(left.per_record_deg2)), rel=1e-3)
