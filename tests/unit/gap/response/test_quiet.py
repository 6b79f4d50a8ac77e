"""A pressure without its monitor's noise: what is the rig's stays, and a change computed on it is not noisy."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.plants.gap_rigs import session

from rig.columns import rms
from rig.gap import diagnose
from rig.gap.response.without_monitor_noise import without_noise
from rig.model.parameters import AddedEffect
from rig.record import Column, Record
from rig.smoothing import smoothed

DT_S = 0.005
T = np.arange(0.0, 20.0, DT_S)
SAID = 0.2 + 0.1 * np.sin(2 * np.pi * 0.5 * T)
MISSED = 0.003 * np.sin(2 * np.pi * 1.5 * T + 0.7) + 0.002 * np.cos(2 * np.pi * 2.5 * T)
"""What a description misses of a rig: harmonics of the sweep."""


def slow(column: Column) -> Column:
    """(n,) what is compared of it, below some hertz."""
    return smoothed(column, 0.03 / DT_S)


def coloured(level_mpa: float) -> Column:
    """(n,) noise that a regulator's monitor has: some rows alike."""
    white = np.random.default_rng(1).standard_normal(len(T) + 4)
    return level_mpa * np.sqrt(5.0) * np.convolve(white, np.ones(5) / 5.0, "valid")


def test_noise_goes() -> None:
    noise = coloured(0.0006)
    assert rms(slow(without_noise(SAID + noise, SAID, DT_S) - SAID)) < 0.7 * rms(slow(noise))


@pytest.mark.parametrize(("noise_mpa", "most"), [(1e-4, 0.02), (3e-4, 0.05)])
def test_what_a_description_misses_stays(noise_mpa: float, most: float) -> None:
    quiet = without_noise(SAID + MISSED + coloured(noise_mpa), SAID, DT_S)
    assert rms(slow(quiet - SAID - MISSED)) < most * rms(MISSED)


def test_without_noise_nothing_changes() -> None:
    assert rms(without_noise(SAID + MISSED, SAID, DT_S) - SAID - MISSED) < 0.02 * rms(MISSED)
    np.testing.assert_allclose(without_noise(SAID, SAID, DT_S), SAID, atol=1e-12)


@given(st.integers(50, 800), st.integers(0, 1000), st.floats(1e-4, 1e4), st.floats(-1.0, 1.0))
def test_it_knows_no_unit_and_no_offset(rows: int, seed: int, times: float, off: float) -> None:
    random = np.random.default_rng(seed)
    said, course = random.standard_normal((2, rows))
    plain = without_noise(course, said, DT_S)
    np.testing.assert_allclose(
        without_noise(times * course + off, times * said, DT_S), times * plain + off, atol=1e-9 * max(times, 1.0)
    )
    assert rms(plain - said) <= rms(course - said) * (1.0 + 1e-9)


def with_noise(seed: int, *effects: AddedEffect) -> list[Record]:
    """A day whose monitors have 0.7 kPa of coloured noise."""
    random = np.random.default_rng(seed)

    def noise(rows: int) -> Column:
        return np.convolve(0.0012 * random.standard_normal(rows + 2), np.ones(3) / 3, "valid")

    def noisy(record: Record) -> Record:
        assert record.p1_mpa is not None
        assert record.p2_mpa is not None
        rows = len(record)
        return replace(record, p1_mpa=record.p1_mpa + noise(rows), p2_mpa=record.p2_mpa + noise(rows))

    return session(seed, *effects, after=noisy)


@pytest.mark.parametrize(
    ("effect", "number"), [("delay", "delay_s"), ("valve_lag", "tau_s")], ids=["a delay", "a slower regulator"]
)
def test_a_filter_does_not_win_by_smoothing_the_one_earlier_days_noise(effect: str, number: str) -> None:
    found = diagnose(None, with_noise(31, AddedEffect(effect, {number: 0.039})), [with_noise(11)])
    assert [cause.effect for cause in found.causes] == [effect]
    assert found.causes[0].confidence > 0.6
