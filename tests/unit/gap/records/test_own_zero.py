"""When records are taken to count the angle from where the joint rested, on both sides of what is seen of a start."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.records.own_zero import OWN_ZERO_NOTE, count_from_rest
from rig.gap.records.pairs import pair_up
from rig.gap.records.settings import MOVED_AT_FIRST, NOISE_OF_A_START, NOISE_OF_STARTS, TELLS_A_START
from rig.record import ZERO_FACT, Record

T = np.arange(0.0, 10.0, 0.005)
SWINGS_DEG = 20.0


def beginning_at(start_deg: float, noise_deg: float = 0.0, step_deg: float = 0.0, seed: int = 0) -> Record:
    """A sine of 20 deg about where the record begins."""
    angle = start_deg + SWINGS_DEG * np.sin(np.pi * T) * np.minimum(T, 1.0)
    angle += noise_deg * np.random.default_rng(seed).standard_normal(len(T))
    angle = step_deg * np.round(angle / step_deg) if step_deg else angle
    return Record(f"from_{start_deg:g}_{seed}", T, 0.1 * np.sin(np.pi * T), angle_deg=angle)


def test_all_that_begin_at_zero_count_from_there_and_one_that_does_not_says_that_none_does() -> None:
    assert count_from_rest([beginning_at(0.0), beginning_at(0.0, seed=1)])
    assert not count_from_rest([beginning_at(0.0), beginning_at(0.5)])


@pytest.mark.parametrize(("share", "counts"), [(0.8, True), (2.3, False)])
def test_what_a_quiet_sensor_shows_of_a_start(share: float, counts: bool) -> None:
    assert count_from_rest([beginning_at(share * MOVED_AT_FIRST * 2.0 * SWINGS_DEG)]) is counts


@pytest.mark.parametrize(("share", "counts"), [(0.1, True), (2.0, False)])
def test_a_noisy_one_shows_less(share: float, counts: bool) -> None:
    start_deg = share * NOISE_OF_A_START * 0.03
    assert count_from_rest([beginning_at(start_deg, 0.03, seed=k) for k in range(5)]) is counts


def test_one_record_may_lie_within_its_noise_and_many_show_their_mean() -> None:
    start_deg = 0.3 * NOISE_OF_A_START * 0.03
    assert count_from_rest([beginning_at(start_deg, 0.03, seed=3)])
    assert not count_from_rest([beginning_at(start_deg, 0.03, seed=k) for k in range(3, 12)])


@pytest.mark.parametrize(("noise_deg", "step_deg"), [(0.1, 0.0), (0.01, 0.4)])
def test_a_sensor_that_shows_little_of_a_start_does_not_tell(noise_deg: float, step_deg: float) -> None:
    least_deg = TELLS_A_START * 2.0 * SWINGS_DEG
    assert max(NOISE_OF_STARTS * noise_deg, step_deg / 2.0) > least_deg
    assert not count_from_rest([beginning_at(0.0, noise_deg, step_deg, seed=k) for k in range(5)])


@given(st.floats(0.03, 0.1), st.integers(0, 100))
def test_a_converter_reads_the_code_of_zero(step_deg: float, seed: int) -> None:
    assert count_from_rest([beginning_at(0.0, 0.002, step_deg, seed)])
    assert not count_from_rest([beginning_at(4.0 * step_deg, 0.002, step_deg, seed)])


def test_records_that_say_what_was_taken_for_zero_are_believed() -> None:
    assert not count_from_rest([replace(beginning_at(0.0), facts={ZERO_FACT: 0.0})])


def test_a_servo_may_be_held_at_zero() -> None:
    channel = {"name": "position", "unit": "mm", "range": [-50.0, 50.0]}
    servo = {"channels": {"input": channel | {"name": "set_point"}, "output": channel}}
    assert not count_from_rest([replace(beginning_at(0.0), facts=servo)])


def test_the_answer_says_so_and_each_record_tells_nothing_of_its_mean() -> None:
    pairing = pair_up([beginning_at(0.0), beginning_at(0.0, seed=1)], [], 0.2)
    assert OWN_ZERO_NOTE in pairing.notes
    assert all(pair.zeroed for pair in pairing.pairs)
    elsewhere = pair_up([beginning_at(1.0), beginning_at(0.0)], [], 0.2)
    assert OWN_ZERO_NOTE not in elsewhere.notes
    assert not any(pair.zeroed for pair in elsewhere.pairs)
