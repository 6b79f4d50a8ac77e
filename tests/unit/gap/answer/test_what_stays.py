"""Something unknown beside a name is a cause where what stays is a gap, else a note."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import asked, names, session

from rig.gap.answer.facts import Verdict
from rig.gap.hypotheses.library import UNKNOWN
from rig.gap.settings import ABOVE_FLOOR
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
