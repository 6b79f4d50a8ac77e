"""What a rig does not repeat between the periods of its excitation: noise of any colour, and nothing that repeats."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.plants.gap_rigs import model, session

from rig.gap import diagnose
from rig.gap.answer.result import Verdict
from rig.gap.likelihood.lines import lines_of
from rig.gap.reference.unrepeated import unrepeated
from rig.record import Record

ROWS, DT_S = 2000, 0.01
T_S = DT_S * np.arange(ROWS)


def sine(hertz: float) -> np.ndarray:
    return np.asarray(0.2 * np.sin(2.0 * np.pi * hertz * T_S))


def heard(commands: list[np.ndarray], days: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequency and variance of every line, records one after the other."""
    lines = lines_of([ROWS] * len(commands), [DT_S] * len(commands), [np.ones(ROWS)] * len(commands), 6.0)
    return lines.frequency_hz, unrepeated(lines, commands, days)


@given(st.floats(0.2, 1.6), st.integers(12, 16), st.integers(0, 1000))
def test_white_noise_is_as_strong_on_every_line_as_it_is(hertz: float, count: int, seed: int) -> None:
    """Of a dozen days: what a single one says is off by 15 % (standard deviation), and once in 300 by 60 and more."""
    noise = 0.3 * np.random.default_rng(seed).standard_normal((ROWS, count))
    _, variance = heard([sine(hertz)], noise)
    assert np.mean(variance) == pytest.approx(0.09, rel=0.25)


@given(st.floats(0.2, 1.6), st.floats(0.1, 3.0))
def test_what_repeats_is_no_noise_whatever_its_shape_and_though_periods_are_no_whole_rows(
    hertz: float, bend: float
) -> None:
    phase = 2.0 * np.pi * hertz * T_S
    answer = np.tanh(bend * np.sin(phase - 0.4)) + 0.2 * np.cos(3.0 * phase)
    _, variance = heard([sine(hertz)], answer[:, None])
    assert np.sum(variance) < 2e-3 * np.sum(answer**2)


@given(st.floats(1.6, 4.5))
def test_a_fast_sine_repeats_though_whole_rows_are_few_and_any_other_number_of_periods_is_near(hertz: float) -> None:
    answer = np.sin(2.0 * np.pi * hertz * T_S - 0.4)
    _, variance = heard([sine(hertz)], answer[:, None])
    assert np.sum(variance) < 2e-4 * np.sum(answer**2)


def test_regulators_that_hunt_are_heard_where_they_do() -> None:
    random = np.random.default_rng(1)
    phase = 2.0 * np.pi * 4.5 * T_S + np.cumsum(0.1 * random.standard_normal(ROWS))
    frequency, variance = heard([sine(0.43)], np.sin(phase)[:, None])
    near = np.abs(frequency - 4.5) < 1.0
    assert np.sum(variance[near]) > 0.8 * np.sum(variance)
    assert np.sum(variance) == pytest.approx(0.5 * ROWS, rel=0.4)


def test_a_drift_and_the_settling_of_the_first_period_are_no_noise() -> None:
    drift = 0.05 * T_S[:, None]
    settling = np.exp(-T_S / 0.4)[:, None]
    _, variance = heard([sine(0.5)], drift + settling)
    assert np.sum(variance) < 0.01 * np.sum((drift - drift.mean()) ** 2 + settling**2)


def test_a_record_without_a_period_is_taken_to_be_as_loud_as_the_others() -> None:
    random = np.random.default_rng(2)
    chirp = 0.2 * np.sin(2.0 * np.pi * (0.2 * T_S + 0.03 * T_S**2))
    days = np.concatenate([s * random.standard_normal(ROWS) for s in (1.0, 5.0, 3.0)])[:, None]
    frequency, variance = heard([sine(0.5), chirp, sine(0.8)], days)
    each = np.mean(np.split(variance, 3), axis=1)
    assert each[1] == pytest.approx(0.5 * (each[0] + each[2]), rel=1e-9)
    assert each[1] == pytest.approx(5.0, rel=0.4), "its own noise is not looked at"
    assert not heard([chirp], days[:ROWS])[1].any(), "nothing is known where no record has a period"
    assert len(frequency) == len(variance)


def test_holes_count_for_nothing() -> None:
    random, hole = np.random.default_rng(3), slice(700, 900)
    noise = random.standard_normal(ROWS)
    noise[hole] = 1e6
    used = np.ones(ROWS)
    used[hole] = 0.0
    lines = lines_of([ROWS], [DT_S], [used], 6.0)
    assert np.mean(unrepeated(lines, [sine(0.5)], noise[:, None])) == pytest.approx(1.0, rel=0.4)


def hunting(seed: int) -> Callable[[Record], Record]:
    """Both regulators swing against each other at 4.5 Hz, each run in its own way, and the joint with them."""
    random = np.random.default_rng(seed)

    def swings(record: Record) -> Record:
        assert record.p1_mpa is not None
        assert record.p2_mpa is not None
        assert record.angle_deg is not None
        wandering = np.cumsum(0.05 * random.standard_normal(len(record.t_s)))
        swing = np.sin(2.0 * np.pi * 4.5 * record.t_s + random.uniform(0.0, 6.0) + wandering)
        return replace(
            record,
            p1_mpa=record.p1_mpa + 0.006 * swing,
            p2_mpa=record.p2_mpa - 0.006 * swing,
            angle_deg=record.angle_deg + 0.6 * swing,
        )

    return swings


def test_a_rig_that_hunts_as_it_did_the_day_before_lacks_nothing_and_one_that_has_begun_to_does() -> None:
    before, steady = session(21, after=hunting(1)), session(21)
    now = session(22, after=hunting(2))
    as_usual = diagnose(model(), now, [before])
    assert as_usual.verdict is Verdict.NONE
    assert as_usual.gap.rms_deg < as_usual.gap.floor_deg
    assert any("does not repeat itself" in note and "near 4." in note for note in as_usual.notes)
    begun = diagnose(model(), now, [steady])
    assert begun.verdict is not Verdict.NONE
    assert not any("does not repeat itself" in note for note in begun.notes), "the day before did"
