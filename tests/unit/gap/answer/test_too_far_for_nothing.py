"""A gap of many floors that no hypothesis wins is not nothing beside a simulator: something that nobody has a name
for."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import model, session

from rig.gap.answer.consistency import contradictions
from rig.gap.answer.facts import Verdict
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses.library import NONE, UNKNOWN
from rig.gap.pipeline import Grounds
from rig.gap.settings import EITHER_CHANCE, FAR
from rig.record import Column, Record


def standing_still(column: Column, share: float, period: int = 400) -> Column:
    """A pressure that stands still for a share of every so many samples, as where commands do not arrive."""
    rows = np.arange(len(column))
    begun = rows - rows % period
    held: Column = np.where(rows % period < share * period, column[begun], column)
    return held


@pytest.mark.parametrize(("share", "said"), [(0.0, "none"), (0.5, "unknown")])
def test_nothing_is_no_answer_to_a_gap_that_no_healthy_rig_shows(share: float, said: Verdict) -> None:
    def stalls(record: Record) -> Record:
        assert record.p1_mpa is not None
        assert record.p2_mpa is not None
        return replace(record, p1_mpa=standing_still(record.p1_mpa, share), p2_mpa=standing_still(record.p2_mpa, share))

    found, grounds = diagnose_with_grounds(model(), session(91, after=stalls))
    assert isinstance(grounds, Grounds)
    pressures = grounds.posteriors[0]
    assert found.verdict == said
    assert (pressures.beyond_nothing > FAR) == (said == "unknown")
    assert contradictions(found.to_json()) == []
    if said == "unknown":
        assert pressures.best == NONE
        first = found.causes[0]
        assert (first.effect, first.stage, first.judged_on) == (UNKNOWN, "valve", "pressures")
        assert found.confidence <= EITHER_CHANCE
