"""Something unknown is a cause where a gap stands above the floor, or stays beside a name; else a note."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.plants.gap_rigs import asked, names, session

from rig.gap.answer.consistency import contradictions
from rig.gap.answer.facts import Verdict
from rig.gap.answer.smoothed_gap import SmoothedGap
from rig.gap.answer.unknowns import unknowns
from rig.gap.answer.words.sentences import headline
from rig.gap.hypotheses.library import UNKNOWN
from rig.gap.settings import ABOVE_FLOOR, EITHER_CHANCE, LARGE_GAP
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


def likely_beside(name: str | None, floors: float) -> Any:
    """What competes on the angle, with something unknown likely beside a name, or in the place of one, and so many
    floors left beyond all that may differ."""
    fit = SimpleNamespace(effect=SimpleNamespace(name="viscous_friction", stage="joint"))
    return SimpleNamespace(
        found=True, fit=fit if name else None, fits={"viscous_friction": fit}, beside=0.99, beyond=floors,
        probability={"viscous_friction": 0.5, UNKNOWN: 0.49}, problem=SimpleNamespace(name="angle"), monitors_alone=0.0,
        best=name or UNKNOWN,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "floors", "cause"),
    [
        ("viscous_friction", ABOVE_FLOOR - 0.1, False),
        ("viscous_friction", ABOVE_FLOOR + 0.1, True),
        (None, ABOVE_FLOOR - 0.1, True),
    ],
    ids=["less than the floor beyond what may differ", "more", "nothing is named"],
)
def test_beside_a_name_it_is_measured_by_what_that_leaves_beyond_all_that_may_differ(
    name: str | None, floors: float, cause: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The simulator's error of 0.6 deg with the cause in it holds what may differ as well: three floors of 0.2."""
    judged = likely_beside(name, floors)
    named = [(judged, judged.fit)] if name else []
    kept = [SimpleNamespace(posterior=judged, fit=judged.fit, alone_deg=0.6)] if name else []
    findings = SimpleNamespace(posteriors=[judged], named=named, limited=False)
    monkeypatch.setattr("rig.gap.answer.unknowns.share_closed", lambda *_: 0.9)
    said = unknowns(findings, kept, SmoothedGap(before_deg=2.8, after_deg=0.6, floor_deg=0.2))  # type: ignore[arg-type]
    assert [one.effect for one in said.causes] == [UNKNOWN] * cause
    assert len(said.notes(kept)) == (not cause)  # type: ignore[arg-type]


@pytest.mark.parametrize(("after_deg", "little"), [(2.1, True), (1.9, False)])
def test_what_closes_less_than_half_of_a_gap_does_not_explain_it(after_deg: float, little: bool) -> None:
    """Of 3 deg above a floor of 1: half is at 2."""
    assert SmoothedGap(3.0, after_deg, 1.0).closes_little is little


@pytest.mark.parametrize(
    ("before_deg", "after_deg", "share", "too_little"),
    [
        (3.0, 1.9, 0.1, False),
        (LARGE_GAP - 0.1, LARGE_GAP - 0.1, 0.9, False),
        (LARGE_GAP - 0.1, LARGE_GAP - 0.1, 0.4, True),
        (LARGE_GAP + 0.1, LARGE_GAP + 0.1, 0.9, True),
    ],
    ids=["closes most", "the pressures are explained", "half of them are not", "a large gap stays as it was"],
)
def test_what_closes_nothing_of_a_large_gap_does_not_explain_it(
    before_deg: float, after_deg: float, share: float, too_little: bool
) -> None:
    """Above a floor of 1. A valve's gain, 2 % of the pressures, passed for all of an angle that was four floors off."""
    assert SmoothedGap(before_deg, after_deg, 1.0).is_explained_too_little(share) is too_little
