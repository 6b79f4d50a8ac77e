"""How sure an answer is: that what it says of every factor is right, and no more than it says."""

from dataclasses import replace

import pytest
from support.plants.gap_rigs import baselines, model, session

from rig.gap.answer.findings import Findings, Kept
from rig.gap.answer.sureness import confidence_of
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses.library import NONE
from rig.gap.pipeline import Grounds
from rig.gap.priors import fitted
from rig.gap.settings import EITHER_CHANCE
from rig.model.parameters import AddedEffect


@pytest.fixture(scope="module")
def findings() -> Findings:
    """Later set-points, of which the pressures say that they may as well be slower regulators."""
    late = session(157, AddedEffect("delay", {"delay_s": 0.03}))
    _, grounds = diagnose_with_grounds(model(), late, [list(day) for day in baselines()])
    assert isinstance(grounds, Grounds)
    ahead, *others = grounds.posteriors
    said = {NONE: 0.1, "delay": 0.4, "valve_lag": 0.3, "clock_drift": 0.2}
    return Findings(
        grounds.expected, grounds.simulator, (replace(ahead, probability=said), *others), [], None, fitted()
    )


def test_a_name_is_as_sure_as_the_name(findings: Findings) -> None:
    ahead, angle = findings.posteriors
    kept = [Kept(ahead, ahead.fits["delay"], 0.0)]
    assert confidence_of(findings, kept, [], doubted=0) == pytest.approx(
        0.4 * ahead.sure_beside * angle.probability[NONE]
    )


def test_that_something_without_a_name_is_there_is_surer_than_the_name_that_was_dropped(findings: Findings) -> None:
    angle = findings.angle.probability[NONE]
    assert confidence_of(findings, [], [], doubted=0) == pytest.approx((1.0 - 0.1) * EITHER_CHANCE * angle)


@pytest.mark.parametrize(("odds", "right"), [(-2.0, 0.881), (2.0, 0.881), (0.0, 0.5)])
def test_an_effect_and_what_is_said_of_something_beside_it_are_both_to_be_right(
    findings: Findings, odds: float, right: float
) -> None:
    ahead, angle = findings.posteriors
    beside = replace(ahead, log_odds_beside={**ahead.log_odds_beside, "delay": odds})
    seen, kept = replace(findings, posteriors=(beside, angle)), [Kept(beside, beside.fits["delay"], 0.0)]
    expected = 0.4 * right * angle.probability[NONE]
    assert confidence_of(seen, kept, [], doubted=0) == pytest.approx(expected, rel=1e-3)
    assert confidence_of(seen, kept, [], doubted=1) == pytest.approx(expected * EITHER_CHANCE, rel=1e-3)
