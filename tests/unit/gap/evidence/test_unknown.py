"""Something unknown beside an effect counts for the effect only as far as the effect is needed for it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.plants.gap_rigs import baselines, model, session

from rig.gap.evidence.posterior import Posterior
from rig.gap.evidence.unknown import parts
from rig.gap.hypotheses.library import UNKNOWN
from rig.gap.pipeline import weigh
from rig.gap.question import Question
from rig.gap.reference.kinds import ReferenceKind
from rig.model.parameters import AddedEffect
from rig.record import Record

FEW = ("sensor_gain", "sensor_offset", "sensor_lag", "coulomb_friction", "end_stop")
NATS = st.floats(-300.0, 300.0)


@given(NATS, NATS)
def test_the_two_parts_are_all_there_is(log_both: float, log_unneeded: float) -> None:
    found = parts(log_both, log_unneeded)
    assert np.logaddexp(found.needed, found.unneeded) == pytest.approx(log_both, abs=1e-6)
    assert found.unneeded == min(log_both, log_unneeded)


@given(NATS, st.floats(0.0, 50.0))
def test_an_effect_that_makes_it_no_likelier_is_not_needed(log_unneeded: float, worse: float) -> None:
    assert parts(log_unneeded - worse, log_unneeded).needed == -math.inf


def hunting(record: Record) -> Record:
    """The angle swings by itself, at another frequency in each record: no law of the library does that."""
    angle = record.angle_deg
    assert angle is not None
    hertz = 1.0 + 0.1 * (len(record.name) % 7)
    return replace(record, angle_deg=angle + 1.5 * np.sin(2.0 * np.pi * hertz * record.t_s + 2.0 * np.sin(record.t_s)))


def judged(records: list[Record]) -> Posterior:
    days = [list(day) for day in baselines()]
    return weigh(Question(model(), records, days, ReferenceKind.SESSIONS, library=FEW))[2][-1]


def test_what_explains_nothing_of_something_unknown_has_none_of_its_mass() -> None:
    found = judged(session(85, after=hunting))
    assert found.best == UNKNOWN
    assert found.probability[UNKNOWN] > 0.99


def test_an_effect_that_is_needed_beside_it_keeps_its_mass() -> None:
    found = judged(session(85, AddedEffect("sensor_gain", {"gain": 0.3}), after=hunting))
    assert found.best == "sensor_gain"
    assert found.beside > 0.5
