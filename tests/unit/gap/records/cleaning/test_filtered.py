"""Falls that are read through a filter: its share is found by how they die away, and undone; what is none stays."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.records.cleaning.dropouts import without_dropouts
from rig.gap.records.cleaning.filtered import before_filter, passed_in_a_row, through_filter
from rig.record import Column, Record

T = np.arange(0.0, 20.0, 0.005)
NOISE_DEG = 0.02


def fallen(share: float, rail: float, run: int, seed: int = 5) -> Column:
    """(n,) a joint on a sine whose sensor falls to a rail, `run` samples at a time."""
    angle = 25.0 * np.sin(2 * np.pi * 0.4 * T) + 4.0
    for start in np.flatnonzero(np.random.default_rng(seed).random(len(T)) < share / run):
        angle[start : start + run] = rail
    return angle


def read(angle: Column, passed: float, seed: int = 6) -> Record:
    """What a converter reads of it behind a filter, with its own noise."""
    noise = NOISE_DEG * np.random.default_rng(seed).standard_normal(len(T))
    return Record("sine", T, 0.2 * np.sin(2 * np.pi * 0.4 * T), angle_deg=through_filter(angle, passed) + noise)


@given(st.floats(0.05, 1.0), st.integers(0, 1000))
def test_a_filter_is_undone(passed: float, seed: int) -> None:
    column = np.random.default_rng(seed).standard_normal(200)
    np.testing.assert_allclose(before_filter(through_filter(column, passed), passed)[1:], column[1:], atol=1e-9)


@pytest.mark.parametrize("passed", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("run", [1, 3, 10])
def test_its_share_is_found_by_how_falls_die_away(passed: float, run: int) -> None:
    angles = [np.asarray(read(fallen(0.03, 0.0, run, seed), passed).angle_deg) for seed in (1, 2, 3)]
    assert passed_in_a_row(angles) == pytest.approx(passed, rel=0.02)


@pytest.mark.parametrize("passed", [0.4, 0.7, 1.0])
@pytest.mark.parametrize(("rail", "run"), [(0.0, 3), (-70.0, 1), (-70.0, 6)])
def test_what_fell_is_found_as_it_fell_and_is_taken_out(passed: float, rail: float, run: int) -> None:
    angle, whole = fallen(0.02, rail, run), fallen(0.0, rail, run)
    record = read(angle, passed)
    (cleaned,), ((found,),) = without_dropouts([record])
    assert found.level == pytest.approx(rail, abs=1.0)
    assert found.fallen[found.visible].sum() == pytest.approx((angle != whole)[found.visible].sum(), rel=0.1)
    off = np.abs(np.asarray(cleaned.angle_deg) - through_filter(whole, passed))
    assert np.nanquantile(off, 0.999) < 10.0 * NOISE_DEG
    assert np.isfinite(off).mean() > 0.6


def pulses(seed: int) -> Column:
    """What another machine adds: short, of any size, either way."""
    random = np.random.default_rng(seed)
    return np.where(random.random(len(T)) < 0.02, random.uniform(5.0, 30.0, len(T)) * random.choice([-1, 1], len(T)), 0)


@pytest.mark.parametrize(
    "angle",
    [
        25.0 * np.sign(np.sin(2 * np.pi * 3.0 * T)),
        25.0 * np.sin(2 * np.pi * 0.4 * T) + pulses(3),
        np.where((T % 2.0) < 0.15, 20.0, -10.0) * 1.0,
    ],
    ids=["a fast square wave", "pulses of any size", "short pulses of a slow joint"],
)
@pytest.mark.parametrize("passed", [0.15, 0.5])
def test_what_moves_or_disturbs_a_filtered_angle_falls_to_no_rail(angle: Column, passed: float) -> None:
    if passed == 0.15:  # a joint of one time constant behind regulators of another
        angle = through_filter(angle, 0.12)
    record = read(angle, passed)
    (cleaned,), _ = without_dropouts([record])
    assert np.isfinite(np.asarray(cleaned.angle_deg)).mean() > 0.95


def test_a_healthy_angle_shows_no_filter() -> None:
    assert passed_in_a_row([np.asarray(read(fallen(0.0, 0.0, 1), passed).angle_deg) for passed in (0.2, 1.0)]) == 1.0
    assert passed_in_a_row([]) == passed_in_a_row([np.zeros(1)]) == 1.0


@pytest.mark.parametrize("step_deg", [0.2, 0.548, 2.0])
def test_the_steps_of_a_coarse_converter_are_no_falls_behind_a_filter(step_deg: float) -> None:
    angles = [25.0 * np.sin(2 * np.pi * hz * T) + 3.0 for hz in (0.2, 0.5, 0.8)]
    written = [np.round(step_deg * np.round(angle / step_deg), 3) for angle in angles]  # neighbours differ by 0.001 deg
    assert passed_in_a_row(written) == 1.0
    cleaned, _ = without_dropouts([Record("sine", T, angle / 100.0, angle_deg=angle) for angle in written])
    assert all(np.isfinite(np.asarray(record.angle_deg)).all() for record in cleaned)
