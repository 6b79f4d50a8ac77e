"""How rough laws are, as `pamrig gap study laws` fits it: what counts, and fits that once went astray."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from hil.reference.cases import CASES_PER_UNIT, Case, Purpose, draw_sheet
from rig.app.gap.calibrating import FittingPlan
from rig.app.gap.study.laws import (
    LEAST_ROUGH,
    LawError,
    beside,
    of_rig,
    shares_of_usual,
    usual_answer,
    usual_errors,
    with_errors,
)
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.priors import PRIORS, fitted
from rig.gap.settings import MOST_ROUGH

SEED = 994003
LARGEST, MIDDLE = 2, 0
"""Numbers of a rig that bring the largest size, and the one in the middle."""


def unit(family: str, number: int) -> Case:
    """A case that stands for a unit of a family."""
    return draw_sheet(Purpose.DEVELOPMENT, SEED, (number + 1) * CASES_PER_UNIT, family)[number * CASES_PER_UNIT]


def errors(*shares: tuple[str, float]) -> list[LawError]:
    """Errors of one effect, by family."""
    return [LawError(family, "delay", share) for family, share in shares]


def test_families_count_alike_however_many_rigs_they_bring() -> None:
    found = usual_errors(errors(("a", 0.3), ("a", 0.3), ("a", 0.3), ("b", 0.1)))
    assert found == {"delay": pytest.approx(np.sqrt((0.09 + 0.01) / 2))}


def test_one_fit_that_went_astray_does_not_make_a_law_rough() -> None:
    assert usual_errors(errors(("a", 0.1), ("a", 0.12), ("a", 30.0)))["delay"] == pytest.approx(0.12)


@pytest.mark.parametrize(("share", "usual"), [(0.001, LEAST_ROUGH), (0.2, 0.2), (3.0, MOST_ROUGH)])
def test_no_law_is_exact_and_none_is_worth_nothing(share: float, usual: float) -> None:
    assert usual_errors(errors(("a", share)))["delay"] == pytest.approx(usual)


def test_each_family_is_held_against_the_usual_error_of_the_others() -> None:
    found = shares_of_usual(errors(("a", 0.2), ("a", 0.2), ("b", 0.1), ("b", 0.1)), (1.0,))
    assert found == pytest.approx((0.5, 0.5, 1.25, 2.0, 2.0)), "b is half as rough as a, a twice as rough as b"


def test_one_family_says_nothing_of_how_far_another_is_off() -> None:
    assert shares_of_usual(errors(("a", 0.2), ("a", 0.4)), (0.5, 2.0)) == (0.5, 2.0)


@given(st.lists(st.floats(0.02, 0.5), min_size=3, max_size=12))
def test_points_of_that_distribution_share_it_evenly(shares: list[float]) -> None:
    found = shares_of_usual([*errors(*(("a", share) for share in shares)), *errors(("b", 0.1))], ())
    ratios = [share / 0.1 for share in shares] + [
        0.1 / usual_errors(errors(*(("a", share) for share in shares)))["delay"]
    ]
    assert all(
        sum(ratio <= point for ratio in ratios) >= part * len(ratios) - 1
        for part, point in zip((0.1, 0.3, 0.5, 0.7, 0.9), found, strict=True)
    )
    assert list(found) == sorted(found)


@given(st.integers(0, 2**31), st.integers(1, 6))
def test_what_days_differ_in_counts_for_nothing_and_the_rest_in_full(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    patterns, rest = random.standard_normal((40, count)), random.standard_normal(40)
    along = patterns @ random.standard_normal(count)
    alone = beside(rest, patterns)
    np.testing.assert_allclose(patterns.T @ alone, 0.0, atol=1e-8)
    np.testing.assert_allclose(beside(along + rest, patterns), alone, atol=1e-8)


def test_the_library_takes_what_was_fitted_and_else_what_the_effect_says() -> None:
    effect = LIBRARY["delay"]
    assert effect.roughness(
        replace(fitted().prior, laws={"delay": 0.3}, rho_scale=2.0), effect.laws[0]
    ) == pytest.approx(0.6)
    assert effect.roughness(replace(fitted().prior, laws={}), effect.laws[0]) == effect.misfit


def test_every_effect_that_is_fitted_has_an_error_that_was_fitted() -> None:
    assert set(fitted().prior.laws) == {name for name, effect in LIBRARY.items() if not effect.signature}


def test_a_gain_of_the_sensor_is_nearly_exact() -> None:
    found = of_rig(MIDDLE, unit("mckibben", 0), ["sensor_gain"])
    assert [one.effect for one in found] == ["sensor_gain"]
    assert found[0].share < 0.05


@pytest.mark.parametrize(
    ("family", "number", "effect", "most"),
    [
        # a resonance is found within a tenth of its frequency only: on a grid of doubled times it was passed over
        ("mckibben", 2, "inertia", 0.45),
        # a filter in series takes the more of the flow the larger it is: no time constant does that
        ("fluidic", 2, "fill_exhaust_asymmetry", 0.45),
        # a tank that is nearly empty fills nothing, however large the orifice
        ("mckibben", 2, "supply_droop", 0.3),
    ],
)
def test_a_law_follows_what_a_plant_does(family: str, number: int, effect: str, most: float) -> None:
    found = of_rig(LARGEST, unit(family, number), [effect])
    assert found[0].share < most


def test_a_leak_that_makes_a_regulator_hunt_is_judged_by_the_angle_that_tells_it() -> None:
    found = of_rig(0, unit("airbeam", 0), ["leak"])
    assert found[0].share < 0.4, "its monitors hear an unrest that no leak explains"


def test_what_is_fitted_of_laws_is_written_beside_what_was_there() -> None:
    shipped = fitted()
    made, found = with_errors(shipped, FittingPlan(("a", "b"), 1, 7), errors(("a", 0.3), ("b", 0.1)))
    assert found == {"delay": pytest.approx(np.sqrt((0.09 + 0.01) / 2))}
    assert made.prior.laws == {**shipped.prior.laws, **found}
    assert made.levels == shipped.levels
    of = made.provenance.of
    assert of("prior.laws.delay") == of("prior.law_shares") != shipped.provenance.of("prior.laws.delay")
    assert of("prior.laws.leak") == shipped.provenance.of("prior.laws.leak")


def test_where_some_effects_are_fitted_the_others_keep_what_they_had() -> None:
    shipped = fitted()
    made, _ = with_errors(shipped, FittingPlan(("a",), 1, 7), errors(("a", 0.3)), ["delay"])
    assert made.prior == replace(shipped.prior, laws={**shipped.prior.laws, "delay": pytest.approx(0.3)})
    assert made.provenance.of("prior.laws.delay").command == "pamrig gap study laws --units 1 --seed 7 --effect delay"
    for kept in ("prior.laws.leak", "prior.law_shares", "prior.answer"):
        assert made.provenance.of(kept) == shipped.provenance.of(kept)


def test_how_rough_a_description_answers_is_what_is_in_the_middle_of_each_family() -> None:
    told = [
        LawError(family, "valve_gain", 0.1, times)
        for family, times in (("a", 4.0), ("a", 90.0), ("a", 3.0), ("b", 8.0))
    ]
    assert usual_answer(told) == pytest.approx(np.sqrt((4.0**2 + 8.0**2) / 2))
    assert usual_answer(errors(("a", 0.1))) is None


def test_pressures_that_come_late_or_change_nothing_tell_nothing_of_how_rough_the_answer_is() -> None:
    told = {one.effect: one.answer for one in of_rig(0, unit("sleeve", 0), ["delay", "sensor_gain", "valve_gain"])}
    assert told["delay"] is None
    assert told["sensor_gain"] is None
    assert told["valve_gain"] is not None
    assert 1.0 < told["valve_gain"] < 10.0


@pytest.mark.parametrize("number", ["laws", "law_shares", "answer", "log_beside", "temperature"])
def test_what_an_older_file_does_not_hold_is_as_shipped(tmp_path: Path, number: str) -> None:
    raw = yaml.safe_load(PRIORS.read_text(encoding="utf-8"))
    raw["prior"] = {"degrees": 5.0} | {
        key: value for key, value in raw["prior"].items() if key not in {number, "degrees"}
    }
    path = tmp_path / "priors.yaml"
    path.write_text(yaml.safe_dump(raw), encoding="utf-8")
    assert fitted(path).prior == replace(fitted().prior, degrees=5.0)
    assert getattr(fitted(path).prior, number) == getattr(fitted().prior, number)
