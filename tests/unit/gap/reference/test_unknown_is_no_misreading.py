"""What something unknown does to the pressures is real: no hypothesis takes it for an error of the monitors."""

from dataclasses import replace

import pytest
from support.plants.gap_rigs import baselines, model, session

from rig.gap.both_factors import expected_given
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses.library import NONE, UNKNOWN
from rig.gap.pipeline import Grounds
from rig.gap.priors import fitted
from rig.gap.reference.own_days import pressure_days
from rig.model.parameters import AddedEffect

SHIFT = AddedEffect("valve_offset", {"offset_mpa": -0.015, "balance": 1.0})


@pytest.fixture(scope="module")
def shifted() -> Grounds:
    """A session with one valve 15 kPa low beside two earlier days."""
    _, grounds = diagnose_with_grounds(model(), session(157, SHIFT), [list(day) for day in baselines()])
    assert isinstance(grounds, Grounds)
    return grounds


def misread_mpa(grounds: Grounds, name: str, log_odds_beside: float) -> tuple[float, float] | None:
    """What the monitors misread where that hypothesis holds and leaves something unknown by these odds; None where what
    is left is not read as an error of theirs."""
    ahead, before = grounds.posteriors[0], replace(grounds.expected, misread=None)
    ahead = replace(ahead, log_odds_beside={**ahead.log_odds_beside, name: log_odds_beside})
    found = expected_given(ahead, name, before, pressure_days(before.contexts), fitted()).misread
    return None if found is None else found.offset_mpa


def test_what_a_cause_leaves_is_the_monitors_where_nothing_unknown_stands_beside_it(shifted: Grounds) -> None:
    nothing, real = (misread_mpa(shifted, name, -5.0) for name in (NONE, SHIFT.effect))
    assert nothing is not None
    assert real is not None
    assert nothing[0] < -0.005, "the shift is an error of the monitor"
    assert abs(real[0]) < 0.002, "it is one of the valve"


@pytest.mark.parametrize("name", ["delay", SHIFT.effect])
def test_what_a_cause_leaves_is_real_where_something_unknown_stands_beside_it(shifted: Grounds, name: str) -> None:
    assert misread_mpa(shifted, name, 5.0) is None
    assert misread_mpa(shifted, UNKNOWN, 0.0) is None
