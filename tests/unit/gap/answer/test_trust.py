"""A name is believed half where a clipped sensor, or another commanded P0, may have done the same."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import model, session

from rig.gap import diagnose
from rig.gap.answer.consistency import contradictions
from rig.gap.answer.sureness import trust
from rig.gap.records.pairs import Pairing
from rig.gap.settings import EITHER_CHANCE
from rig.record import Record


@pytest.mark.parametrize(
    ("clipped", "elsewhere", "name", "left"),
    [
        ((), (), "co_contraction", 1.0),
        (("clipped?",), (), "sensor_nonlinearity", EITHER_CHANCE),
        ((), ("P0",), "co_contraction", EITHER_CHANCE),
        ((), ("P0",), "delay", 1.0),
        (("clipped?",), ("P0",), "none", 1.0),
    ],
)
def test_what_is_left_of_a_names_probability(
    clipped: tuple[str, ...], elsewhere: tuple[str, ...], name: str, left: float
) -> None:
    pairing = Pairing([], True, 0, 0.2, clipped=clipped, elsewhere=elsewhere)
    assert trust(pairing, name) == left


def coarse_and_cut_off(record: Record) -> Record:
    """Steps of 5 deg, and no angle above 25 deg."""
    assert record.angle_deg is not None
    return replace(record, angle_deg=5.0 * np.round(np.minimum(record.angle_deg, 25.0) / 5.0))


def test_an_answer_is_no_surer_than_what_its_samples_show() -> None:
    """A converter's steps were believed half for a sensor that seemed cut off, and the answer as a whole was not."""
    day = session(5, after=coarse_and_cut_off)
    found = diagnose(model(), day, library=["quantisation"], reference="simulator")
    (steps,) = (cause for cause in found.causes if cause.effect == "quantisation")
    assert steps.doubted_by
    assert steps.confidence == EITHER_CHANCE
    assert found.confidence <= EITHER_CHANCE
    assert contradictions(found.to_json()) == []
