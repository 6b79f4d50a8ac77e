"""What a plan takes from the reference that is really there, the raw samples it would show, and how its predictions are
set beside what is found."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.plants.gap_rigs import model, session

from rig.app.gap.known_rigs import known_of
from rig.app.gap.study.smallest_sizes import TRIED_TIMES, SizesFound, rows_of, sizes_page, threshold
from rig.errors import RigError
from rig.excite.signals import Sine
from rig.excite.sweep import Entry, Timing
from rig.gap.hypotheses.inverse_problems import ANGLE, parts_of_pressures, pressure_forward
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.plan.candidates import SweepEnvelope, planned
from rig.gap.plan.capability import capability
from rig.gap.plan.directions import columns, usual_directions
from rig.gap.plan.information import Information, inform, separations
from rig.gap.plan.next_experiment import Hypothesis, next_experiment
from rig.gap.plan.planned_records import KnownRig, expect_planned, factors_of, known_rig
from rig.gap.plan.raw_ability import RAW, SIZE_FACTOR, raw_abilities, smallest
from rig.gap.priors import fitted
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect, known_how
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.response.causes import Applied
from rig.gap.settings import SESSION_S
from rig.identify.response.fingerprint import fingerprint_of

FEW = [LIBRARY[name] for name in ("valve_lag", "viscous_friction")]
SINE = Entry(Sine(0.5, 0.2), Timing(settle_s=1.0, duration_s=10.0), (0.2,))
PLANS = planned([SINE], 10_000_000)


@pytest.fixture(scope="module")
def known() -> KnownRig:
    rig = model()
    return known_of(replace(rig, fingerprint=fingerprint_of(session(1), rig)), [])


def test_a_fingerprint_s_own_misses_go_into_what_is_planned(known: KnownRig) -> None:
    rig = model()
    made = fingerprint_of(session(1), rig)
    assert made is not None
    assert (known.levels, known.missed_mpa, known.missed_deg) == known_how(made)
    assert expect_planned(known, PLANS).missed_deg == known.missed_deg > 0.0


def test_a_reference_that_misses_more_shows_less(known: KnownRig) -> None:
    sizes = []
    for worse in (1.0, 30.0):
        rig = replace(known, missed_deg=worse * known.missed_deg, missed_mpa=worse * known.missed_mpa)
        found = {one.effect: one for one in capability(expect_planned(rig, PLANS), FEW, fitted()).abilities}
        sizes.append(found["viscous_friction"].detectable or np.inf)
    assert sizes[1] > 1.5 * sizes[0]


def test_what_one_record_alone_may_take_needs_no_place_among_the_patterns_of_all(known: KnownRig) -> None:
    plans = planned([replace(SINE, signal=Sine(hertz, 0.2)) for hertz in (0.3, 0.5, 0.8)], 10_000_000)
    problem = factors_of(expect_planned(known, plans), fitted())[1]
    likelihood = problem.forward.factor.healthy
    found = usual_directions(FEW, problem, 0.05)
    told = inform(problem, columns(found))
    assert told.gram.shape[1] - told.directions <= likelihood.patterns.shape[1] - len(plans)
    apart = separations(told.of(range(3)))
    shorter = float(told.seconds.sum()) / SESSION_S
    likelihood = replace(likelihood, effective=fitted().prior.effective * shorter)
    for k, one in enumerate(found):
        assert apart[k, k] ** 2 == pytest.approx(likelihood.chi_square(one.moved), rel=1e-6)


def test_what_is_planned_after_an_earlier_day_is_judged_by_a_fingerprint_of_it() -> None:
    pairing = pair_up(session(2), [session(1)], 0.2)
    expected = expect(ReferenceKind.SESSION, False, model(), pairing)
    rig = known_rig(expected)
    assert (rig.kind, rig.levels) == (ReferenceKind.FINGERPRINT, "fingerprint")
    assert rig.missed_deg > 0.0
    alone = pair_up(session(2), [], 0.2)
    by_fingerprint = replace(
        expected, kind=ReferenceKind.FINGERPRINT, pairing=alone, levels="fingerprint", missed_deg=0.25
    )
    assert known_rig(by_fingerprint).missed_deg == 0.25


def test_raw_effects_are_seen_from_smaller_sizes_beside_an_earlier_day() -> None:
    effects = [LIBRARY[name] for name in ("quantisation", "sensor_noise", "valve_lag")]
    commands = [replace(record, angle_deg=None, p1_mpa=None, p2_mpa=None) for record in session(1)[:1]]
    alone, beside = (
        {one.effect: one for one in raw_abilities(model(), commands, 0.02, effects, kind, fitted().noise)}
        for kind in (ReferenceKind.SIMULATOR, ReferenceKind.SESSION)
    )
    assert alone["sensor_noise"].detectable is not None
    assert alone["sensor_noise"].detectable > 3.0 * (beside["sensor_noise"].detectable or np.inf)
    assert set(alone) == set(beside) == {"quantisation", "sensor_noise"}
    assert all(one.factor == RAW and one.nameable == one.detectable for one in beside.values())
    assert beside["sensor_noise"].detectable is not None
    assert 0.005 < beside["sensor_noise"].detectable < 0.2
    assert (beside["quantisation"].detectable or np.inf) <= (alone["quantisation"].detectable or np.inf)


@settings(max_examples=50, deadline=None)
@given(st.floats(1e-3, 9.0))
def test_the_smallest_size_is_found_to_a_step(edge: float) -> None:
    found = smallest(lambda size: size >= edge, 1e-3, 20.0)
    assert found is not None
    assert edge <= found <= edge * SIZE_FACTOR * 1.001


def test_a_size_between_the_last_doubled_step_and_the_end_of_the_range_is_found() -> None:
    found = smallest(lambda size: size >= 0.45, 1e-4, 0.5)
    assert found is not None
    assert 0.45 <= found <= 0.5


def test_a_size_that_is_never_found_is_none() -> None:
    assert smallest(lambda size: False, 1e-3, 1.0) is None


@settings(max_examples=50, deadline=None)
@given(st.floats(0.3, 3.5))
def test_what_plants_show_is_found_within_the_last_halving(edge: float) -> None:
    found = threshold(lambda size: size >= edge, 1.0)
    assert found is not None
    assert 1 / 1.1 <= found / edge <= 1.1


def refusing(size: float) -> bool:
    raise RigError("the joint left its travel")


@pytest.mark.parametrize("seen", [lambda size: False, lambda size: size > TRIED_TIMES, refusing])
def test_what_is_not_found_at_all_is_none(seen: Callable[[float], bool]) -> None:
    assert threshold(seen, 1.0) is None


def test_said_and_found_sizes_are_counted_effect_by_effect() -> None:
    found = [
        SizesFound("mckibben", 1, "delay", 0.01, 0.012),
        SizesFound("fluidic", 1, "delay", 0.01, 0.03),
        SizesFound("mckibben", 1, "backlash", 1.0, None),
    ]
    delay, backlash = rows_of(found)
    assert (delay.ratio, delay.within, backlash.found) == (3.0, False, None)
    (near,) = rows_of(found[:1])
    assert near.within
    page = sizes_page([delay, backlash], "session", "Written today.")
    assert "for 0 of 2 effects" in page
    assert "| backlash | 1 deg | not found |" in page


def test_directions_that_are_the_same_but_for_sign_are_one() -> None:
    first, other = np.array([1.0, 0.0, 2.0]), np.array([0.0, 1.0, 0.0])
    columns = np.column_stack([first, -2.0 * first, other, first])
    known = Information((columns.T @ columns)[None], 4, np.array([100.0]), fitted().prior)
    assert known.distinct(["a", "a", "a", "b"]) == [0, 2, 3]
    kept = known.only([0, 2, 3])
    assert kept.directions == 3
    assert np.allclose(kept.of([0]), known.of([0])[np.ix_([0, 2, 3], [0, 2, 3])])


def test_a_designed_session_pairs_with_the_usual_one_where_they_share_a_record(tmp_path: Path) -> None:
    usual, designed = session(1), session(2)
    newer = replace(designed[0], name="chirp", dp_cmd_mpa=designed[0].dp_cmd_mpa[::-1] * 0.5)
    pairing = pair_up([newer, *designed[1:]], [usual], 0.2)
    assert [pair.name for pair in pairing.pairs] == [record.name for record in designed[1:]]
    assert pairing.unpaired


@pytest.mark.parametrize(("hz", "times"), [(0.5, 1.0), (4.0, 5.0)])
def test_a_planned_record_faster_than_what_is_known_is_as_many_times_less_sure(
    known: KnownRig, hz: float, times: float
) -> None:
    plans = planned([Entry(Sine(hz, 0.1), Timing(settle_s=1.0, duration_s=10.0), (0.2,))], 10_000_000)
    steady = replace(known, missed_mpa=0.0, unrepeated_mpa=0.0)
    made = [expect_planned(replace(steady, known_hz=at), plans) for at in (np.inf, 0.8)]
    sure, unsure = (pressure_forward(expected, fitted()).factor.healthy for expected in made)
    noise = parts_of_pressures(made[0])[0].noise  # is as loud on a fast record
    np.testing.assert_allclose(unsure.variance - noise, times**2 * (sure.variance - noise))
    np.testing.assert_allclose(unsure.patterns, times * sure.patterns)


def test_what_is_slow_is_given_longer_records(known: KnownRig) -> None:
    slow = Applied("creep", {"share": 0.1, "tau_s": 10.0, "relaxed": 1.0})
    rivals = [
        Hypothesis(ANGLE, Applied("sensor_gain", {"gain": -0.04}), 0.5, {"gain": 0.01}),
        Hypothesis(ANGLE, slow, 0.5, {"share": 0.01, "tau_s": 3.0}),
    ]
    found = next_experiment(rivals, known, SweepEnvelope(rests_mpa=(0.2,)), fitted())
    assert found is not None
    assert max(entry.timing.duration_s for entry in found.entries) > 10.0
    assert found.seconds <= 60.0
    assert found.nats >= 0.1
