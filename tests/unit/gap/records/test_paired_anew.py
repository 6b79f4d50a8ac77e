"""Records whose lost samples are bridged are paired once more: what was found out the first time stands."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import baselines, model, session

from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.pairing import paired_anew
from rig.gap.pipeline import Grounds
from rig.gap.question import Question
from rig.gap.records.pairs import pair_up
from rig.gap.reference.kinds import ReferenceKind
from rig.record import Record


def losing(record: Record) -> Record:
    """Every twentieth sample or so repeats the one before."""
    angle = np.array(record.angle_deg)
    lost = np.random.default_rng(len(record.name)).random(len(angle)) < 0.05
    for row in np.flatnonzero(lost)[1:]:
        angle[row] = angle[row - 1]
    return replace(record, angle_deg=angle)


def alien(record: Record) -> Record:
    return replace(record, name="alien", dp_cmd_mpa=0.3 * np.asarray(record.dp_cmd_mpa))


def test_what_was_left_out_is_still_said_when_samples_were_lost() -> None:
    records = [losing(record) for record in session(71)]
    found, grounds = diagnose_with_grounds(model(), [*records, alien(records[0])], [list(day) for day in baselines()])
    assert isinstance(grounds, Grounds)
    pairing = grounds.expected.pairing
    assert "lost_samples" in {cause.effect for cause in found.causes}
    assert pairing.unpaired == ["alien"]
    assert any(note.startswith("alien: no baseline of this sweep") for note in found.notes)
    assert {match.record for match in pairing.matches} == {*(record.name for record in records), "alien"}


@pytest.mark.parametrize("spoilt", [1, None], ids=["one", "all"])
def test_a_repair_that_leaves_records_unusable_is_none(spoilt: int | None) -> None:
    records, days = session(71), [list(day) for day in baselines()]
    pairing = pair_up(records, days, 0.2)

    def straight(record: Record) -> Record:
        return replace(record, angle_deg=np.zeros(len(record)))

    of_case = [straight if spoilt in (k, None) else replace for k in range(len(pairing.pairs))]
    question = Question(model(), records, days, ReferenceKind.SESSIONS, False, True, None)
    anew = paired_anew(question, pairing, of_case, [replace] * len(pairing.pairs))
    assert [pair.name for pair in anew.pairs] == [pair.name for pair in pairing.pairs]
    assert all(pair.case.angle_deg.any() for pair in anew.pairs)
