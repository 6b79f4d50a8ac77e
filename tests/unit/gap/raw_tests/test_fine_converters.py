"""A converter so fine that few of its values come twice still repeats rows by chance; they are no lost samples."""

import numpy as np
import pytest

from rig.gap.raw_tests.all_tests import read_signatures
from rig.gap.raw_tests.quantisation import fine_step_deg, step_deg
from rig.gap.records.pairs import pair_up
from rig.record import Column, Record

ROWS, PERIOD_S = 4000, 0.004
STEP_DEG = 200.0 / 2**14
NOISE_DEG = 0.04


def course(k: int) -> Column:
    return np.asarray(np.sin(2 * np.pi * 0.05 * (1 + k / 4) * PERIOD_S * np.arange(ROWS)))


def angle(seed: int, lost: float = 0.0, noise_deg: float = NOISE_DEG, step_deg: float = STEP_DEG) -> Column:
    """A slow sine behind a converter of 14 bits; a share of the samples repeats the one before."""
    random = np.random.default_rng(seed)
    read = 40.0 * course(seed) + random.normal(0.0, noise_deg, ROWS)
    read = step_deg * np.round(read / step_deg)
    for k in 1 + np.flatnonzero(random.random(ROWS - 1) < lost):
        read[k] = read[k - 1]
    return read


def day(lost: float = 0.0, noise_deg: float = NOISE_DEG, step_deg: float = STEP_DEG) -> list[Record]:
    """As a file with three decimals has it."""
    t = PERIOD_S * np.arange(ROWS)
    return [Record(f"sine_{k}", t, 0.2 * course(k), np.round(angle(k, lost, noise_deg, step_deg), 3)) for k in range(5)]


@pytest.mark.parametrize("bits", [14, 16])
@pytest.mark.parametrize("noise_deg", [NOISE_DEG, 10 * NOISE_DEG])
@pytest.mark.parametrize(("lost", "found"), [(0.0, False), (0.05, True)])
def test_chance_is_told_from_loss_without_an_earlier_day(lost: float, found: bool, noise_deg: float, bits: int) -> None:
    records = day(lost, noise_deg, 200.0 / 2**bits)
    pairs = pair_up(records, [], 0.2).pairs
    (said,) = (test for test in read_signatures(pairs) if test.effect == "lost_samples")
    assert said.found == found, said.text
    assert said.sizes["probability"].value == pytest.approx(lost, abs=0.005), "a few in a hundred repeat by chance"


def test_the_step_of_a_fine_converter_is_read_from_its_nearest_values() -> None:
    angles = [angle(k) for k in range(3)]
    assert step_deg(angles)[0] == 0.0, "too many values for the usual way"
    assert fine_step_deg(angles) == pytest.approx(STEP_DEG, rel=1e-3)
    written = [np.round(each, 3) for each in angles]
    assert fine_step_deg(written) == pytest.approx(STEP_DEG, rel=0.1), "as a file with three decimals has it"


@pytest.mark.parametrize("step_deg", [STEP_DEG, STEP_DEG / 4.0])
def test_a_step_that_a_file_rounds_is_read_all_the_same(step_deg: float) -> None:
    """0.0031 is 0.003 and 0.004 in turn with three decimals."""
    written = [np.round(angle(k, step_deg=step_deg), 3) for k in range(3)]
    assert fine_step_deg(written) == pytest.approx(step_deg, rel=0.02)


def test_a_sensor_without_a_converter_has_no_step() -> None:
    noise = [each + np.random.default_rng(9).normal(0.0, 0.01, ROWS) for each in map(angle, range(3))]
    assert fine_step_deg(noise) == 0.0
