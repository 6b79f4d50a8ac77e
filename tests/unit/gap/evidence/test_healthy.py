"""How likely a healthy rig is counts on the joint where nothing acts ahead of the monitors, and nowhere else."""

import math
from dataclasses import replace

import pytest
from support.plants.gap_rigs import baselines, model, session

from rig.gap.evidence.posterior import Posterior
from rig.gap.hypotheses.library import NONE
from rig.gap.pipeline import weigh
from rig.gap.priors import Fitted, fitted
from rig.gap.question import Question
from rig.gap.reference.kinds import ReferenceKind
from rig.model.parameters import AddedEffect

FEW = ("valve_lag", "sensor_gain", "coulomb_friction")
LESS = -3.0


def settings(healthy: float) -> Fitted:
    known = fitted()
    own = known.levels["session"]
    return replace(known, levels={**known.levels, "session": replace(own, odds=replace(own.odds, healthy=healthy))})


def weighed(healthy: float, *effects: AddedEffect) -> tuple[Posterior, ...]:
    days = [list(day) for day in baselines()]
    asked = Question(
        model(), session(9, *effects), days, ReferenceKind.SESSIONS, library=FEW, settings=settings(healthy)
    )  # fmt: skip
    return weigh(asked)[2]


def log_odds(posterior: Posterior) -> float:
    chance = posterior.probability[NONE]
    return math.log(chance / (1.0 - chance))


def test_a_healthy_rigs_joint_is_so_many_nats_less_likely_to_have_nothing() -> None:
    (ahead, joint), (ahead_less, joint_less) = weighed(0.0), weighed(LESS)
    assert log_odds(joint_less) - log_odds(joint) == pytest.approx(LESS, abs=1e-6)
    assert not ahead.found
    assert not ahead_less.found


def test_behind_a_cause_ahead_of_the_monitors_the_joint_is_judged_as_before() -> None:
    slow = AddedEffect("valve_lag", {"tau_s": 0.02})
    before, after = weighed(0.0, slow), weighed(LESS, slow)
    assert before[0].best == after[0].best == "valve_lag"
    assert after[-1].probability == pytest.approx(before[-1].probability, abs=1e-9)
