"""What a rig's own days say of its levels: the population's without them, its own with many, and nothing that is not
there."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.lines import lines_of
from rig.gap.priors import FactorLevels, fitted
from rig.gap.reference import own_days
from rig.gap.reference.expectation import Parts
from rig.gap.reference.own_days import contrasts, learnt, own_factor, own_floor

ROWS = 2000
LINES = lines_of([ROWS], [0.01], [np.ones(ROWS)], 6.0)
COUNT = len(LINES.frequency_hz)


def population(spread: float, patterns: int = 1) -> Gaussian:
    """White lines of variance 1, and patterns that each stand on a line of their own."""
    columns = np.zeros((COUNT, patterns))
    columns[10 + 20 * np.arange(patterns), np.arange(patterns)] = spread
    return Gaussian(np.ones(COUNT), columns, float(COUNT), 6.0)


def days(random: np.random.Generator, count: int, true: Gaussian) -> np.ndarray:
    """(l, count) deviations drawn from what is true."""
    sizes = random.standard_normal((true.patterns.shape[1], count))
    return np.asarray(np.sqrt(true.variance)[:, None] * random.standard_normal((COUNT, count)) + true.patterns @ sizes)


@given(st.integers(2, 12))
def test_contrasts_are_orthonormal_and_see_no_mean(count: int) -> None:
    made = contrasts(count)
    assert made.T @ made == pytest.approx(np.eye(count - 1), abs=1e-12)
    assert np.ones(count) @ made == pytest.approx(np.zeros(count - 1), abs=1e-12)


@pytest.mark.parametrize("share", [0.2, 5.0])
def test_many_days_take_the_populations_place(share: float) -> None:
    true = population(share * 30.0)
    found = learnt(population(30.0), days(np.random.default_rng(1), 60, true), LINES)
    assert found.patterns[10, 0] == pytest.approx(share * 30.0, rel=0.25)


def test_a_pattern_faint_beside_the_lines_is_found_where_this_rigs_days_differ_in_it_far_more() -> None:
    """One day tells nothing of a pattern at the population's spread, and the lines' variance could take what it does
    here: a search from there never leaves."""
    column = np.zeros((COUNT, 1))
    column[10:40, 0] = 0.05
    usual = replace(population(0.0), patterns=column, effective=60.0)
    true = replace(usual, patterns=40.0 * column)
    found = [learnt(usual, days(np.random.default_rng(seed), 5, true), LINES).patterns[20, 0] for seed in range(12)]
    assert 15.0 < np.median(found) / 0.05 < 60.0


@pytest.mark.parametrize("loudness", [0.25, 4.0])
def test_lines_are_as_loud_as_on_the_own_days(loudness: float) -> None:
    quiet = population(1.0)
    true = Gaussian(loudness * quiet.variance, quiet.patterns, quiet.effective, quiet.degrees)
    found = learnt(quiet, days(np.random.default_rng(2), 12, true), LINES)
    assert float(np.mean(found.variance)) == pytest.approx(loudness, rel=0.2)


@pytest.mark.parametrize("count", [2, 5])
@pytest.mark.parametrize("loudness", [0.2, 1.0, 30.0])
def test_a_further_healthy_day_is_as_loud_as_expected(loudness: float, count: int) -> None:
    """Also of a rig whose spectrum falls steeply, far quieter or louder than others."""
    steep = 1.0 / (1.0 + (np.arange(COUNT) / 40.0) ** 4) + 0.001
    usual = replace(population(1.0), variance=np.full(COUNT, float(np.mean(steep))), effective=60.0)
    true = replace(usual, variance=loudness * steep)
    random = np.random.default_rng(4)
    found = learnt(usual, days(random, count, true), LINES)
    further = days(random, 40, true)
    seen = np.median([found.chi_square(one) / found.effective for one in further.T])
    assert 0.6 < seen < 1.6


def test_a_pattern_of_which_the_days_say_nothing_keeps_the_populations_spread() -> None:
    before = population(1e-3)
    found = learnt(before, days(np.random.default_rng(3), 5, before), LINES)
    assert found.patterns[10, 0] == pytest.approx(1e-3, rel=0.05)


@pytest.mark.parametrize(("count", "degrees"), [(0, np.inf), (1, 4.0), (4, 7.0)])
def test_by_how_much_days_differ_on_this_rig_is_known_the_better_the_more_there_are(count: int, degrees: float) -> None:
    """Without days nothing is said of what they differ by."""
    envelope = np.full(COUNT, 1.0)
    columns = LINES.of(np.column_stack([np.ones(ROWS)]))
    parts = Parts(LINES, np.zeros(ROWS), columns, ("offset",), envelope, 1.0, np.full(COUNT, 1e-4))
    levels = FactorLevels({"offset": 0.01}, 0.01, 0.003, 0.01)
    earlier = np.random.default_rng(5).normal(0.0, 0.01, (ROWS, count))
    assert own_factor(parts, earlier, levels, fitted().prior).healthy.pattern_degrees == degrees


@given(st.integers(2, 8), st.floats(0.1, 10.0))
def test_the_floor_lies_between_the_populations_and_the_own_days(count: int, share: float) -> None:
    random, used = np.random.default_rng(count), np.ones(4000)
    own = share * random.standard_normal((4000, count))
    usual = np.sqrt(2.0)
    low, high = sorted((np.sqrt(1.0 + 1.0 / count), share * np.sqrt(1.0 + 1.0 / count)))
    assert 0.95 * low <= own_floor(usual, own, used) <= 1.05 * high


@pytest.mark.parametrize("count", [0, 1])
def test_without_a_second_day_the_floor_is_the_usual_one(count: int) -> None:
    assert own_floor(0.3, np.ones((100, count)), np.ones(100)) == 0.3


@pytest.mark.parametrize("degrees", [1.5, 4.0, 12.0])
def test_a_spread_of_which_nothing_is_known_stays_however_sure_the_population_is(
    monkeypatch: pytest.MonkeyPatch, degrees: float
) -> None:
    """Whatever is computed from a number that decides is computed when it is used: a study moves that number."""
    monkeypatch.setattr(own_days, "PATTERN_DEGREES", degrees)
    before = population(1e-3)
    found = learnt(before, days(np.random.default_rng(3), 5, before), LINES)
    assert found.patterns[10, 0] == pytest.approx(1e-3, rel=0.05)
