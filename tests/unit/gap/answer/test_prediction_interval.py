"""How far: the interval holds what further records show, as often as it says, and never takes back what was seen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.answer.how_far.prediction_interval import (
    PREDICTION_LEVEL,
    Shrunk,
    conformal,
    fit_spread,
    prediction_interval,
    scale_deg2,
)
from rig.gap.priors import Spread

SPREAD = Spread(floor=0.2, law=0.2, below=1.0, above=3.0, cases=100)
positive = st.floats(0.01, 10.0)


@given(positive, positive, st.lists(positive, min_size=1, max_size=8), st.floats(0.0, 0.5))
def test_what_was_left_lies_in_its_interval(before: float, floor: float, left: list[float], rho: float) -> None:
    one = Shrunk(before, floor, tuple(value**2 for value in left), rho)
    low, high = prediction_interval(one, SPREAD)
    assert 0.0 <= low <= np.sqrt(one.after_deg2) * (1.0 + 1e-9)
    assert high >= max(np.sqrt(one.after_deg2), floor) * (1.0 - 1e-9), "a healthy day is left at least"


def test_a_rougher_law_and_records_that_disagree_make_it_wider() -> None:
    exact, rough = (prediction_interval(Shrunk(2.0, 0.2, (0.09, 0.09), rho), SPREAD) for rho in (0.02, 0.4))
    apart = prediction_interval(Shrunk(2.0, 0.2, (0.01, 0.17), 0.02), SPREAD)
    assert rough[0] <= exact[0]
    assert rough[1] > exact[1]
    assert apart[1] > exact[1]


def drawn(count: int, seed: int) -> tuple[list[Shrunk], list[float]]:
    """Cases whose further records are left with more in proportion to the law's roughness."""
    random, cases, left = np.random.default_rng(seed), [], []
    for _ in range(count):
        floor, before, rho = 0.2, random.uniform(0.8, 3.0), random.choice([0.03, 0.1, 0.4])
        one = Shrunk(before, floor, tuple(random.uniform(0.02, 0.08, 7)), rho)
        cases.append(one)
        left.append(max(one.middle_deg2 + scale_deg2(one, 0.4, 0.2) * random.normal(0.5, 1.0), 0.0))
    return cases, left


def test_the_fitted_interval_holds_further_cases_as_often_as_it_says() -> None:
    spread = fit_spread(*drawn(300, 1), ["a build"] * 300)
    cases, left = drawn(1000, 2)
    said = [prediction_interval(one, spread) for one in cases]
    held = [low**2 <= value <= high**2 for (low, high), value in zip(said, left, strict=True)]
    assert np.mean(held) == pytest.approx(PREDICTION_LEVEL, abs=0.03)


def test_a_build_that_is_missed_more_counts_as_much_as_one_with_many_cases() -> None:
    """Cases of one build are alike: many that are followed closely do not make up for a build that is not."""
    near, far = drawn(400, 3), drawn(60, 4)
    left_far = [one.middle_deg2 + 4.0 * (left - one.middle_deg2) for one, left in zip(*far, strict=True)]
    cases, left = [*near[0], *far[0]], [*near[1], *left_far]

    def held(names: list[str]) -> float:
        spread = fit_spread(cases, left, names)
        highest = [prediction_interval(one, spread)[1] for one in far[0]]
        return float(np.mean(np.square(highest) >= left_far))

    assert held(["near"] * 400 + ["far"] * 60) > held(["one"] * 460) + 0.1


def test_too_few_scores_reach_to_the_outermost() -> None:
    assert conformal(np.array([-0.5, 0.1, 2.0])) == (0.5, 2.0)
    many = np.linspace(-1.0, 1.0, 1001)
    below, above = conformal(many)
    assert below == pytest.approx(PREDICTION_LEVEL, abs=0.01)
    assert above == pytest.approx(PREDICTION_LEVEL, abs=0.01)
