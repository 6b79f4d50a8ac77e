"""What the pressures show is in their monitors alone where the joint moves as if it were not there."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import asked, names, session

from rig.gap.answer.consistency import contradictions
from rig.gap.answer.observations import MONITORS_ALONE
from rig.gap.answer.words.sentences import answers, headline
from rig.model.parameters import AddedEffect
from rig.record import Column, Record

SLOW_S = 0.06
LAG = AddedEffect("valve_lag", {"tau_s": SLOW_S})
LESS_FRICTION = AddedEffect("viscous_friction", {"tau_s": -0.02})


def damped(record: Record) -> Record:
    """The pressures as a snubbed monitor reads them."""

    def behind(pressure: Column | None) -> Column:
        assert pressure is not None
        read, keep = pressure.copy(), float(np.exp(-record.period_s / SLOW_S))
        for row in range(1, len(read)):
            read[row] = keep * read[row - 1] + (1.0 - keep) * pressure[row]
        return read

    return replace(record, p1_mpa=behind(record.p1_mpa), p2_mpa=behind(record.p2_mpa))


def test_slow_monitors_are_no_slow_regulators_that_less_friction_undoes() -> None:
    said = asked(session(86, after=damped))
    assert said.verdict == "unknown"
    assert names(said) == {"unknown"}
    assert [cause.stage for cause in said.causes] == ["valve"]
    assert MONITORS_ALONE in {seen.test for seen in said.observations}
    assert headline(said)[0].startswith("The joint moves as if nothing had happened to the pressures")
    assert "Also seen:" not in answers(said)
    assert contradictions(said.to_json()) == []


@pytest.mark.parametrize("added", [(), (LESS_FRICTION,)])
def test_slow_regulators_that_the_joint_follows_stay_regulators(added: tuple[AddedEffect, ...]) -> None:
    said = asked(session(87, LAG, *added))
    assert "valve_lag" in names(said)
    assert MONITORS_ALONE not in {seen.test for seen in said.observations}
