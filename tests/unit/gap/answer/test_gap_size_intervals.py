"""How far a size may be off: fitted on cases whose size is known, and what is said without."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.answer.how_far.size_intervals import (
    SIZE_LEVEL,
    NamedSize,
    deviation_of,
    fit_reach,
    half_width,
    reference_of,
)
from rig.gap.priors import Reach, fitted
from rig.gap.reference.kinds import ReferenceKind

POSITIVE = st.floats(1e-3, 1e3)


def cases(seed: int, count: int, noise: float, law: float) -> list[NamedSize]:
    """Sizes that are off by `noise` of the likelihood's standard deviation and by `law` of their law's usual error."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        truth, deviation, rho = rng.uniform(0.5, 2.0), rng.uniform(0.01, 0.05), rng.uniform(0.02, 0.4)
        off = rng.normal() * noise * deviation + rng.normal() * law * rho * truth
        made.append(NamedSize(truth + off, deviation, rho, truth))
    return made


def held(reach: Reach, of: list[NamedSize]) -> float:
    return float(
        np.mean([abs(one.value - one.truth) <= half_width(one.value, one.deviation, one.rho, reach) for one in of])
    )


@pytest.mark.parametrize(("noise", "law"), [(1.0, 0.0), (3.0, 0.0), (1.0, 1.0)])
def test_fitted_on_some_cases_it_holds_as_many_of_others_as_it_says(noise: float, law: float) -> None:
    reach = fit_reach(cases(1, 400, noise, law))
    assert held(reach, cases(2, 2000, noise, law)) == pytest.approx(SIZE_LEVEL, abs=0.03)


def test_where_the_likelihood_is_right_the_fit_says_so() -> None:
    reach = fit_reach(cases(3, 4000, 1.0, 0.0))
    assert (reach.law, reach.cases) == (0.0, 4000)
    assert reach.deviations == pytest.approx(Reach().deviations, rel=0.06)


def test_a_family_whose_sizes_are_missed_more_counts_as_much_as_one_with_many_cases() -> None:
    near, far = cases(5, 400, 1.0, 0.0), cases(6, 40, 4.0, 0.0)
    pooled = fit_reach([*near, *far])
    assert held(fit_reach([*near, *(replace(one, family="far") for one in far)]), far) > held(pooled, far) + 0.1


def test_laws_that_miss_more_get_wider_intervals() -> None:
    reach = fit_reach(cases(4, 1000, 1.0, 2.0))
    assert reach.law > 0.0
    assert half_width(1.0, 0.01, 0.4, reach) > 5.0 * half_width(1.0, 0.01, 0.02, reach)


@given(st.floats(-1e3, 1e3), POSITIVE, st.floats(0.0, 0.5), st.floats(0.0, 4.0), st.floats(0.5, 10.0))
def test_the_deviation_behind_an_interval_is_found_again(
    value: float, deviation: float, rho: float, law: float, reach: float
) -> None:
    known = Reach(law, reach)
    half = half_width(value, deviation, rho, known)
    assert deviation_of(value, half, rho, known) == pytest.approx(
        deviation, rel=1e-3, abs=1e-5 * (1.0 + abs(law * rho * value))
    )


def test_what_was_not_fitted_has_no_width() -> None:
    assert half_width(1.0, 0.0, 0.1, Reach(1.0, 2.0)) == 0.0


@pytest.mark.parametrize("kind", list(ReferenceKind))
def test_every_reference_has_a_fitted_reach(kind: ReferenceKind) -> None:
    reach = fitted().reach_of(reference_of(kind))
    assert reach.cases >= 20
    assert half_width(1.0, 0.02, 0.1, reach) > half_width(1.0, 0.02, 0.1, Reach())
