"""Falls of an input that comes open: found by the line that they lie on, with their rail, and taken out; what is none
stays."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.gap.records.cleaning.dropouts import without_dropouts
from rig.gap.records.cleaning.open_input import open_input
from rig.record import Column, Record

T = np.arange(0.0, 20.0, 0.005)
NOISE_DEG = 0.02
LONGEST = 50


def angle() -> Column:
    return np.asarray(25.0 * np.sin(2 * np.pi * 0.4 * T) + 4.0)


def noisy(column: Column, seed: int = 6) -> Column:
    return column + NOISE_DEG * np.random.default_rng(seed).standard_normal(len(column))


def opened(share: float, rail: float, kept: float, run: float, seed: int = 5) -> Column:
    """The angle with falls of `run` samples in the mean, each of which keeps so much of its distance from row to
    row."""
    random, read = np.random.default_rng(seed), angle()
    for start in np.flatnonzero(random.random(len(T)) < share / run):
        whole = angle()[start - 1 if start else 0]
        rows = np.arange(1, 1 + min(random.geometric(1.0 / run), len(T) - start))
        read[start : start + len(rows)] = rail + kept**rows * (whole - rail)
    return read


@settings(max_examples=40)
@given(
    st.floats(0.01, 0.04), st.sampled_from([60.0, -60.0]), st.floats(0.15, 0.6), st.floats(1.0, 4.0),
    st.integers(0, 1000),
)  # fmt: skip
def test_rail_and_share_are_found(share: float, rail: float, kept: float, run: float, seed: int) -> None:
    found = open_input([noisy(opened(share, rail, kept, run, seed + k)) for k in range(3)], LONGEST)
    assert found is not None
    assert found.kept == pytest.approx(kept, abs=0.04)
    assert found.rail == pytest.approx(rail, abs=2.0)


@pytest.mark.parametrize("run", [1.0, 2.0])
@pytest.mark.parametrize("rail", [0.0, 60.0, -60.0])
def test_falls_are_taken_out_and_nothing_else(rail: float, run: float) -> None:
    """Those of one sample never come to their rail."""
    read, kept = opened(0.03, rail, 0.4, run), 0.4
    record = Record("sine", T, 0.2 * np.sin(2 * np.pi * 0.4 * T), angle_deg=noisy(read))
    (cleaned,), ((found,),) = without_dropouts([record])
    assert found.level == pytest.approx(rail, abs=1.0)
    fell = read != angle()
    shows = fell & ((1.0 - kept) * np.abs(angle() - rail) > 5.0)
    assert np.mean(found.fallen[shows]) > 0.75
    assert np.mean(found.fallen[~fell]) < 0.001
    off = np.abs(np.asarray(cleaned.angle_deg) - angle())
    assert np.nanquantile(off, 0.99) < 2.0


@given(st.integers(0, 1000))
def test_pulses_of_any_size_are_no_falls(seed: int) -> None:
    random = np.random.default_rng(seed)
    size = random.uniform(5.0, 30.0, len(T)) * random.choice([-1, 1], len(T))
    pulses = np.where(random.random(len(T)) < 0.02, size, 0.0)
    assert open_input([noisy(angle() + pulses)], LONGEST) is None


def test_motion_and_noise_are_none() -> None:
    assert open_input([noisy(angle())], LONGEST) is None
    assert open_input([np.zeros(1000)], LONGEST) is None
    assert open_input([np.where(np.sin(2 * np.pi * T) > 0.0, 20.0, -20.0)], LONGEST) is None
