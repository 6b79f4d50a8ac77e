"""When records are taken to count the angle from where the joint rested, on both sides of what is seen of a start."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.records.own_zero import OWN_ZERO_NOTE, count_from_rest
from rig.gap.records.pairs import pair_up
from rig.gap.records.settings import TELLS_A_START
from rig.record import ZERO_FACT, Record

T = np.arange(0.0, 60.0, 0.005)
TURNED = np.sin(2.0 * np.pi * 0.1371 * T) * np.minimum(T, 1.0)
SWINGS_DEG = 20.0
CODE_DEG = 0.03


def beginning_at(start_deg: float, code_deg: float = CODE_DEG, noise_deg: float = 0.0) -> Record:
    """A sine of 20 deg about where the record begins."""
    angle = start_deg + SWINGS_DEG * TURNED
    angle += noise_deg * np.random.default_rng(3).standard_normal(len(T))
    angle = code_deg * np.round(angle / code_deg) if code_deg else angle
    return Record(f"from_{start_deg:g}", T, 0.1 * TURNED, angle_deg=angle)


def test_all_that_begin_at_zero_count_from_there_and_one_that_does_not_says_that_none_does() -> None:
    assert count_from_rest([beginning_at(0.0), beginning_at(0.0)])
    assert not count_from_rest([beginning_at(0.0), beginning_at(0.5)])


def test_one_record_may_be_a_code_off_and_all_are_not_by_chance() -> None:
    one, other = beginning_at(CODE_DEG), beginning_at(0.0)
    assert count_from_rest([one, other, other])
    assert not count_from_rest([one, one, one])
    assert not count_from_rest([beginning_at(2.0 * CODE_DEG), *[other] * 9])


@pytest.mark.parametrize(("share", "counts"), [(0.9, True), (1.1, False)])
def test_a_coarse_encoder_does_not_tell(share: float, counts: bool) -> None:
    assert count_from_rest([beginning_at(0.0, share * TELLS_A_START * 2.0 * SWINGS_DEG)]) is counts


def test_a_sensor_with_more_noise_than_codes_does_not_tell() -> None:
    assert not count_from_rest([beginning_at(0.0, CODE_DEG, 2.0 * CODE_DEG)])
    assert not count_from_rest([beginning_at(0.0, 0.0, 0.001)])


@given(st.floats(0.02, 0.035))
def test_an_encoder_reads_the_code_of_zero(code_deg: float) -> None:
    assert count_from_rest([beginning_at(0.0, code_deg), beginning_at(0.0, code_deg)])
    assert not count_from_rest([beginning_at(2.0 * code_deg, code_deg)])


def test_records_that_say_what_was_taken_for_zero_are_believed() -> None:
    assert not count_from_rest([replace(beginning_at(0.0), facts={ZERO_FACT: 0.0})])


def test_a_servo_may_be_held_at_zero() -> None:
    channel = {"name": "position", "unit": "mm", "range": [-50.0, 50.0]}
    servo = {"channels": {"input": channel | {"name": "set_point"}, "output": channel}}
    assert not count_from_rest([replace(beginning_at(0.0), facts=servo)])


def test_the_answer_says_so_and_each_record_tells_nothing_of_its_mean() -> None:
    pairing = pair_up([beginning_at(0.0), beginning_at(0.0)], [], 0.2)
    assert OWN_ZERO_NOTE in pairing.notes
    assert all(pair.zeroed for pair in pairing.pairs)
    elsewhere = pair_up([beginning_at(1.0), beginning_at(0.0)], [], 0.2)
    assert OWN_ZERO_NOTE not in elsewhere.notes
    assert not any(pair.zeroed for pair in elsewhere.pairs)
