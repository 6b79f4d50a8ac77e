"""What leaves many floors of a gap is not the whole of it beside a simulator, whether nothing wins or an effect: there
is something that nobody has a name for."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import model, session

from rig.gap.answer.consistency import contradictions
from rig.gap.answer.facts import Verdict
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses.library import NONE, UNKNOWN
from rig.gap.pipeline import Grounds
from rig.gap.settings import EITHER_CHANCE, LARGE_GAP
from rig.model.parameters import AddedEffect
from rig.record import Column, Record


def standing_still(column: Column, share: float, period: int = 400) -> Column:
    """A pressure that stands still for a share of every so many samples, as where commands do not arrive; its monitor
    goes on to flicker."""
    rows = np.arange(len(column))
    begun, flicker = rows - rows % period, np.random.default_rng(len(column)).normal(0.0, 0.0005, len(column))
    held: Column = np.where(rows % period < share * period, column[begun] + flicker, column)
    return held


def stalled(share: float) -> Callable[[Record], Record]:
    """Records whose pressures both stand still for so much of the time."""

    def stalls(record: Record) -> Record:
        assert record.p1_mpa is not None
        assert record.p2_mpa is not None
        return replace(record, p1_mpa=standing_still(record.p1_mpa, share), p2_mpa=standing_still(record.p2_mpa, share))

    return stalls


@pytest.mark.parametrize(("share", "said"), [(0.0, "none"), (0.5, "unknown")])
def test_nothing_is_no_answer_to_a_gap_that_no_healthy_rig_shows(share: float, said: Verdict) -> None:
    found, grounds = diagnose_with_grounds(model(), session(91, after=stalled(share)))
    assert isinstance(grounds, Grounds)
    pressures = grounds.posteriors[0]
    assert found.verdict == said
    assert (pressures.beyond > LARGE_GAP) is (said == "unknown")
    assert contradictions(found.to_json()) == []
    if said == "unknown":
        assert pressures.best == NONE
        first = found.causes[0]
        assert (first.effect, first.stage, first.judged_on) == (UNKNOWN, "valve", "pressures")
        assert found.confidence <= EITHER_CHANCE


@pytest.mark.parametrize(("share", "said"), [(0.0, "explained"), (0.1, "partly_explained")])
def test_an_effect_that_leaves_as_much_is_not_all_there_is(share: float, said: Verdict) -> None:
    late = AddedEffect("delay", {"delay_s": 0.05})
    found, grounds = diagnose_with_grounds(model(), session(91, late, after=stalled(share)))
    assert isinstance(grounds, Grounds)
    pressures = grounds.posteriors[0]
    assert (pressures.best, found.verdict) == ("delay", said)
    assert (pressures.beyond > LARGE_GAP) is (said == "partly_explained")
    assert pressures.beside < EITHER_CHANCE, "the likelihood holds the law for rough"
    assert [(one.effect, one.judged_on) for one in found.causes[1:]] == [(UNKNOWN, "pressures")] * len(found.causes[1:])
    assert contradictions(found.to_json()) == []
