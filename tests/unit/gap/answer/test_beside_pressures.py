"""What acts behind the pressure monitors is judged beside what they measured: a law of the valves that is rough speaks
neither for it nor against it."""

from functools import cache

import pytest
from support.plants.gap_rigs import baselines, model, session

from rig.gap.answer.how_far.augment import beside_pressures, remaining_gap
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.pipeline import Grounds
from rig.gap.reference.gaps import rms_of
from rig.gap.response.causes import Applied
from rig.model.parameters import AddedEffect

PLAY = {"width_deg": 1.0}
LATE_S = 0.05


@cache
def grounds(late_s: float) -> Grounds:
    effects = [AddedEffect("backlash", PLAY)]
    if late_s:
        effects.insert(0, AddedEffect("valve_lag", {"tau_s": late_s}))
    days = [list(day) for day in baselines()]
    return diagnose_with_grounds(model(), session(91, *effects), days)[1]


def left_deg(known: Grounds, *behind: Applied, ahead: tuple[Applied, ...] = ()) -> float:
    return rms_of(beside_pressures(known.simulator, ahead, behind, known.expected), known.expected.pairs)


def test_play_is_as_large_beside_the_pressures_whatever_the_valves_do() -> None:
    alone, beside = grounds(0.0), grounds(LATE_S)
    assert left_deg(beside) == pytest.approx(left_deg(alone), rel=0.2)
    late, play = Applied("valve_lag", {"tau_s": LATE_S}), Applied("backlash", PLAY)
    assert left_deg(beside, play, ahead=(late,)) < 0.2 * left_deg(beside)
    assert left_deg(beside, play) < 0.6 * left_deg(beside), "at another time than where it was seen"
    rough = Applied("valve_lag", {"tau_s": 0.5 * LATE_S})
    assert left_deg(beside, play, ahead=(rough,)) < 0.4 * left_deg(beside), "and half of the lag missed"
    commanded = rms_of(remaining_gap(beside.simulator, [], beside.expected), beside.expected.pairs)
    assert commanded > 2.0 * left_deg(beside)


def test_without_a_simulator_the_gap_beside_the_pressures_stays() -> None:
    known = grounds(0.0)
    pairs = known.expected.pairs
    assert rms_of(beside_pressures(None, [], [Applied("backlash", PLAY)], known.expected), pairs) == left_deg(known)
