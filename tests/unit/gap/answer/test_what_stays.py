"""Something unknown is a cause where a gap stands above the floor, or stays beside a name; else a note."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import asked, names, session

from rig.gap.answer.consistency import contradictions
from rig.gap.answer.facts import Verdict
from rig.gap.answer.unknowns import closes_little, explains_too_little
from rig.gap.answer.words.sentences import headline
from rig.gap.hypotheses.library import UNKNOWN
from rig.gap.settings import ABOVE_FLOOR, EITHER_CHANCE, FAR
from rig.model.parameters import AddedEffect
from rig.record import Record


def ringing(size_deg: float, record: Record) -> Record:
    """A tone that swells and fades, which no effect of the library does."""
    t = record.t_s
    tone = size_deg * np.sin(2 * np.pi * 3.3 * t) * (1.0 + np.sin(2 * np.pi * 0.21 * t))
    return replace(record, angle_deg=record.angle_deg + tone)


@pytest.mark.parametrize(("size_deg", "stays"), [(0.1, False), (0.4, True)])
def test_what_is_unknown_beside_a_name_is_a_cause_where_it_is_above_the_floor(size_deg: float, stays: bool) -> None:
    slowed = AddedEffect("viscous_friction", {"tau_s": 0.06})
    said = asked(session(40, slowed, after=lambda record: ringing(size_deg, record)))
    assert said.verdict is (Verdict.PARTLY_EXPLAINED if stays else Verdict.EXPLAINED)
    assert (UNKNOWN in names(said)) is stays
    assert any("may act as well" in note for note in said.notes) is not stays
    assert (said.gap.after_deg > ABOVE_FLOOR * said.gap.floor_deg) is stays


@pytest.mark.parametrize(("size_deg", "stands"), [(0.12, False), (0.4, True)])
def test_what_is_unknown_by_itself_is_a_finding_where_it_is_above_the_floor(size_deg: float, stands: bool) -> None:
    said = asked(session(40, after=lambda record: ringing(size_deg, record)))
    assert said.evidence.factors["angle"].found, "its course is none that days have, whatever its size"
    assert said.verdict is (Verdict.UNKNOWN if stands else Verdict.NONE)
    assert (said.gap.ratio > ABOVE_FLOOR) is stands
    assert any("something small" in note for note in said.notes) is not stands
    assert (said.confidence > EITHER_CHANCE) is stands, "what a note takes back is not said for sure"
    assert contradictions(said.to_json()) == []
    assert ("Something smaller than that is likely there" in headline(said)[0]) is not stands


@pytest.mark.parametrize(("after_deg", "little"), [(2.1, True), (1.9, False)])
def test_what_closes_less_than_half_of_a_gap_does_not_explain_it(after_deg: float, little: bool) -> None:
    """Of 3 deg above a floor of 1: half is at 2."""
    assert closes_little(3.0, after_deg, 1.0) is little


@pytest.mark.parametrize(
    ("before_deg", "after_deg", "share", "too_little"),
    [
        (3.0, 1.9, 0.1, False),
        (FAR - 0.1, FAR - 0.1, 0.9, False),
        (FAR - 0.1, FAR - 0.1, 0.4, True),
        (FAR + 0.1, FAR + 0.1, 0.9, True),
    ],
    ids=["closes most", "the pressures are explained", "half of them are not", "a large gap stays as it was"],
)
def test_what_closes_nothing_of_a_large_gap_does_not_explain_it(
    before_deg: float, after_deg: float, share: float, too_little: bool
) -> None:
    """Above a floor of 1. A valve's gain, 2 % of the pressures, passed for all of an angle that was four floors off."""
    assert explains_too_little(before_deg, after_deg, 1.0, share) is too_little
