"""What records would tell before they are made: information, capability, designed sessions, the next experiment."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CONFIGS
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.fft import idct

from rig.app.gap.known_rigs import Asked, described_by_call
from rig.excite.envelope import check
from rig.excite.run_plan import expand
from rig.excite.sweep import load_sweep
from rig.gap.evidence.posterior import judge
from rig.gap.hypotheses.inverse_problems import ANGLE, PRESSURES, InverseProblem
from rig.gap.hypotheses.law_errors import with_law
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.plan.candidates import SweepEnvelope, candidates, lasts_s, planned, sweep_text
from rig.gap.plan.capability import Ability, capability, seen_separation
from rig.gap.plan.design import design
from rig.gap.plan.directions import changed_at, columns, usual_directions
from rig.gap.plan.information import inform, log_odds, needed_separation, separations
from rig.gap.plan.next_experiment import Hypothesis, as_rough, expected_confidence, next_experiment
from rig.gap.plan.planned_records import KnownRig, expect_planned, factors_of, within
from rig.gap.priors import Odds, fitted
from rig.gap.records.usable import usability
from rig.gap.response.causes import Applied
from rig.gap.settings import SESSION_S
from rig.model.parameters import load_model
from rig.model.simulation import simulate
from rig.record import Column

PERIOD_NS = 10_000_000
ROOM = SweepEnvelope(rests_mpa=(0.2,))
FEW = [LIBRARY[name] for name in ("delay", "valve_lag", "valve_gain", "viscous_friction", "backlash", "sensor_lag")]


@pytest.fixture(scope="module")
def rig() -> KnownRig:
    return replace(described_by_call(Asked(CONFIGS / "models" / "simulated.yaml")).rig, levels="fingerprint")


@pytest.fixture(scope="module")
def usual(rig: KnownRig) -> list[InverseProblem]:
    return factors_of(expect_planned(rig, expand(load_sweep(CONFIGS / "sweeps" / "gap.yaml"), PERIOD_NS)), fitted())


def test_planned_records_answer_as_the_reference_expects(usual: list[InverseProblem]) -> None:
    assert [problem.name for problem in usual] == [PRESSURES, ANGLE]
    assert all(not problem.forward.factor.gap.any() for problem in usual)


@pytest.mark.parametrize("factor", [0, 1])
def test_information_of_all_records_is_the_likelihood_s_own(usual: list[InverseProblem], factor: int) -> None:
    problem = usual[factor]
    found = usual_directions(FEW, problem, 0.05)
    known = inform(problem, columns(found))
    apart = separations(known.of(range(len(known.seconds))))
    likelihood = problem.forward.factor.healthy
    for k, one in enumerate(found):
        assert apart[k, k] ** 2 == pytest.approx(likelihood.chi_square(one.moved), rel=1e-6)
    first, other = found[0].moved, found[-1].moved
    sizes = np.linspace(-3.0, 3.0, 2001)
    refitted = min(likelihood.chi_square(first - size * other) for size in sizes)
    assert apart[0, -1] ** 2 == pytest.approx(refitted, rel=1e-2, abs=1e-3)


def test_a_record_beside_others_tells_what_they_tell_together(usual: list[InverseProblem]) -> None:
    known = inform(usual[1], columns(usual_directions(FEW, usual[1], 0.05)))
    np.testing.assert_array_equal(known.beside([2, 0]).of([5]), known.of([2, 0, 5]))


@pytest.mark.parametrize("factor", [0, 1])
def test_information_where_laws_are_rough_is_the_likelihood_s_own(usual: list[InverseProblem], factor: int) -> None:
    """A law is off by another share in each record and by one lateness in all, as a diagnosis judges it."""
    problem, rho = usual[factor], 0.3
    moved = usual_directions(FEW, problem, 0.05)[0].moved
    forward = problem.forward
    rough = with_law(forward.factor.healthy, forward.factor.lines, moved, rho, forward.prior)
    known = inform(as_rough(problem, rho * moved[:, None]), moved[:, None], rho * moved[:, None])
    assert known.of(range(len(known.seconds)))[0, 0] == pytest.approx(rough.chi_square(moved), rel=1e-6)
    assert rough.chi_square(moved) < 0.5 * forward.factor.healthy.chi_square(moved)


def test_records_beside_a_whole_session_tell_less_than_alone(usual: list[InverseProblem]) -> None:
    """Of so many records the likelihood counts no more independent lines than of a session (`Parts.factor`)."""
    moved = columns(usual_directions(FEW, usual[1], 0.05))
    known = inform(usual[1], moved)
    alone, beside = (np.diag(one.of([0])) for one in (known, replace(known, beside_s=SESSION_S)))
    share = SESSION_S / (SESSION_S + known.seconds[0])
    assert np.all(beside < alone)
    assert np.all(beside >= share * alone), "patterns take less of weaker lines"


def test_more_records_never_tell_less(usual: list[InverseProblem]) -> None:
    known = inform(usual[1], columns(usual_directions(FEW, usual[1], 0.05)))
    few, more = (np.linalg.eigvalsh(known.of(range(count))) for count in (3, 6))
    assert np.all(more >= few - 1e-9)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.1, 30.0), st.floats(0.0, 2.5))
def test_the_needed_separation_gives_the_odds(nats: float, quantile: float) -> None:
    prior = fitted().prior
    needed = needed_separation(nats, prior, quantile)
    assert log_odds(needed, prior) >= nats - 1e-6
    assert needed_separation(1.5 * nats, prior, quantile) > needed


def test_more_choices_need_more() -> None:
    many, few, fewer = (seen_separation(fitted().prior, Odds(), *count) for count in ((20, 30), (1, 30), (1, 5)))
    assert many > few > fewer - 1e-9


def having(problem: InverseProblem, ability: Ability, size: float) -> InverseProblem:
    """The factor on a day like any other, with an effect of that size in it."""
    law = next(law for law in LIBRARY[ability.effect].laws if problem.shows(law))
    change = changed_at(law, law.shapes[0], size, problem)
    assert change is not None
    factor = replace(problem.forward.factor, gap=change + usual_day(problem))
    forward = replace(problem.forward, factor=factor)
    return replace(problem, forward=forward, on_few=lambda: forward)


def usual_day(problem: InverseProblem) -> Column:
    """A residual as the reference's own Gaussian draws it."""
    random, lines, healthy = np.random.default_rng(5), problem.forward.factor.lines, problem.forward.factor.healthy
    drawn = np.sqrt(healthy.variance) * random.standard_normal(len(healthy.variance))
    drawn += healthy.patterns @ random.standard_normal(healthy.patterns.shape[1])
    parts, start = [], 0
    for rows, count in zip(lines.rows, lines.counts, strict=True):
        parts.append(idct(np.concatenate([drawn[start : start + count], np.zeros(rows - count)]), norm="ortho"))
        start += count
    return np.concatenate(parts)


@pytest.mark.parametrize("name", ["viscous_friction", "valve_gain"])
def test_the_diagnosis_sees_what_it_is_said_to_see_and_not_half_of_it(
    rig: KnownRig, usual: list[InverseProblem], name: str
) -> None:
    plans = expand(load_sweep(CONFIGS / "sweeps" / "gap.yaml"), PERIOD_NS)
    ability = next(one for one in capability(expect_planned(rig, plans), FEW, fitted()).abilities if one.effect == name)
    assert ability.detectable is not None
    problem = next(one for one in usual if one.name == ability.factor)
    assert judge(FEW, having(problem, ability, ability.detectable)).found
    assert not judge(FEW, having(problem, ability, 0.4 * ability.detectable)).found


def test_what_looks_alike_is_said_and_named_later_than_seen(rig: KnownRig) -> None:
    plans = expand(load_sweep(CONFIGS / "sweeps" / "gap.yaml"), PERIOD_NS)
    found = capability(expect_planned(rig, plans), FEW, fitted())
    assert ("delay", "valve_lag") in found.confusable
    seen = dict(zip(found.names, np.diag(found.separation), strict=True))
    apart = found.separation[found.names.index("delay"), found.names.index("viscous_friction")]
    assert apart == seen["delay"], "what is not seen is not told from what shows elsewhere"
    delay = next(one for one in found.abilities if one.effect == "delay")
    assert delay.rival == "valve_lag"
    assert delay.nameable is None or delay.nameable > (delay.detectable or 0.0)


@settings(max_examples=15, deadline=None)
@given(st.floats(0.0, 0.15), st.floats(0.25, 0.5), st.floats(0.05, 3.0))
def test_candidates_stay_inside_the_envelope(low: float, high: float, slew: float) -> None:
    pool = candidates(SweepEnvelope((low, high), slew), (5.0,), PERIOD_NS)
    assert pool
    for plan in planned(pool, PERIOD_NS):
        dp = np.asarray(plan.dp_mpa)
        assert plan.p0_mpa - 0.5 * np.abs(dp).max() >= low - 1e-6
        assert plan.p0_mpa + 0.5 * np.abs(dp).max() <= high + 1e-6
        assert 0.5 * np.abs(np.diff(dp)).max() <= slew * PERIOD_NS * 1e-9 + 1e-6


@pytest.mark.parametrize("slew", [0.5, 2.0])
def test_candidates_stay_inside_the_envelope_at_the_period_of_the_loop_too(slew: float) -> None:
    for swing in (0.2, 0.4):
        envelope = SweepEnvelope(slew_mpa_s=slew, swing_mpa=swing, rests_mpa=(0.2, 0.2503))
        pool = candidates(envelope, (5.0,), PERIOD_NS)
        assert len(pool) > 10
        for period_ns in (5_000_000, 1_000_000):
            for plan in planned(pool, period_ns):
                check(plan, envelope, period_ns)


def test_no_record_is_planned_that_a_diagnosis_would_leave_out(rig: KnownRig) -> None:
    pool = candidates(SweepEnvelope(rests_mpa=(0.15, 0.2, 0.3)), (10.0, 40.0), PERIOD_NS)
    pairs = expect_planned(rig, planned(pool, PERIOD_NS)).pairs
    assert len(pairs) == len(pool) > 10
    assert {usability(pair.raw) for pair in pairs} == {(True, "")}


def test_a_design_tells_more_than_its_first_record_and_keeps_the_time(rig: KnownRig, tmp_path: Path) -> None:
    pool = candidates(SweepEnvelope(rests_mpa=(0.2,)), (10.0,), PERIOD_NS)
    short, whole = (design([rig], pool, seconds, FEW, fitted()) for seconds in (20.0, 60.0))
    assert sum(lasts_s(entry) for entry in whole.entries) <= 60.0
    assert whole.power.score > short.power.score > 0.0
    (tmp_path / "made.yaml").write_text(sweep_text("made", whole.entries, "why"))
    again = expand(load_sweep(tmp_path / "made.yaml"), PERIOD_NS)
    assert [list(plan.dp_mpa) for plan in again] == [list(plan.dp_mpa) for plan in planned(whole.entries, PERIOD_NS)]


def test_a_design_leaves_time_over_that_no_record_would_make_it_tell_more_in(rig: KnownRig) -> None:
    pool = candidates(SweepEnvelope(rests_mpa=(0.2,)), (10.0,), PERIOD_NS)
    some, all_day = (design([rig], pool, seconds, FEW, fitted()) for seconds in (120.0, 7200.0))
    assert all_day.power.score >= some.power.score
    assert all_day.seconds < sum(map(lasts_s, pool))


def test_a_sweep_keeps_rest_pressures_apart(tmp_path: Path) -> None:
    entries = candidates(SweepEnvelope(rests_mpa=(0.2, 0.3)), (5.0,), PERIOD_NS)
    chosen = [entries[0], entries[-1]]
    (tmp_path / "made.yaml").write_text(sweep_text("made", chosen))
    again = expand(load_sweep(tmp_path / "made.yaml"), PERIOD_NS)
    assert [plan.p0_mpa for plan in again] == [0.2, 0.3]


def late(stage: str, seconds: float, probability: float, factor: str = PRESSURES) -> Hypothesis:
    name = "delay_s" if stage == "delay" else "tau_s"
    return Hypothesis(factor, Applied(stage, {name: seconds}), probability, {name: 0.1 * seconds})


def test_a_number_moves_within_its_law_and_takes_along_what_is_tied_to_it() -> None:
    """A limit of the flow moved in filling alone, and beyond what its stage takes."""
    law = next(law for law in LIBRARY["valve_slew"].laws if law.tied)
    numbers = {"fill_mpa_s": 0.5, "exhaust_mpa_s": 0.5, "integral_s": 0.0}
    scales = {law.scale: 1.0}
    slow = Hypothesis(PRESSURES, Applied(law.stage, numbers), 0.5, {"fill_mpa_s": 0.1}, law=law)
    moved, deviations = slow.moved("fill_mpa_s", scales)
    assert moved.numbers["fill_mpa_s"] == moved.numbers["exhaust_mpa_s"] == pytest.approx(0.6)
    assert deviations == pytest.approx(1.0)
    low, high = law.range_of("fill_mpa_s", scales)
    unsure = replace(slow, spread={"fill_mpa_s": 10.0 * high})
    moved, deviations = unsure.moved("fill_mpa_s", scales)
    assert moved.numbers["exhaust_mpa_s"] == pytest.approx(low)
    assert -1.0 < deviations < 0.0
    assert replace(slow, spread={"fill_mpa_s": 0.0}).moved("fill_mpa_s", scales)[1] == 0.0


def test_effects_that_share_a_stage_keep_their_names(rig: KnownRig) -> None:
    rivals = [late("delay", 0.02, 0.5), replace(late("valve_lag", 0.02, 0.5), effect="supply_droop")]
    found = next_experiment(rivals, rig, SweepEnvelope(rests_mpa=(0.2,)), fitted())
    assert found is not None
    assert set(found.separates) == {"delay", "supply_droop"}


def test_a_delay_and_a_lag_are_parted_by_something_fast(rig: KnownRig) -> None:
    rivals = [late("delay", 0.02, 0.5), late("valve_lag", 0.02, 0.5)]
    found = next_experiment(rivals, rig, SweepEnvelope(rests_mpa=(0.2,)), fitted())
    assert found is not None
    assert set(found.separates) == {"delay", "valve_lag"}
    assert 0.0 < found.nats <= found.entropy == pytest.approx(np.log(2.0))
    assert found.confidence > 0.5
    assert max(entry.signal.highest_hz for entry in found.entries) >= 1.5
    assert found.to_json()["needs_reference"] is False


def test_what_is_not_among_the_rivals_stays_as_likely_as_it_was(rig: KnownRig) -> None:
    """Something unknown of 0.3 was left out of the promise, which was 0.99."""
    rivals = [late("delay", 0.02, 0.35), late("valve_lag", 0.02, 0.35)]
    found = next_experiment(rivals, rig, ROOM, fitted())
    assert found is not None
    assert found.confidence == pytest.approx(0.7**2 + 0.3**2, abs=0.02)


def test_rough_laws_and_a_long_session_promise_less(rig: KnownRig) -> None:
    rivals = [late("delay", 0.002, 0.5), late("valve_lag", 0.002, 0.5)]
    rough = [replace(one, roughness=0.5) for one in rivals]
    promised = [
        found.nats
        for some, lasted_s in ((rivals, 0.0), (rivals, SESSION_S), (rough, 0.0))
        if (found := next_experiment(some, rig, ROOM, fitted(), lasted_s=lasted_s)) is not None
    ]
    assert promised[0] > max(promised[1:])


@pytest.mark.parametrize("seconds", [0.001, 0.0015, 0.002])
def test_the_confidence_that_is_promised_is_that_of_the_mean_record(rig: KnownRig, seconds: float) -> None:
    rivals = [late("delay", seconds, 0.5), late("valve_lag", seconds, 0.5)]
    found = next_experiment(rivals, rig, SweepEnvelope(rests_mpa=(0.2,)), fitted())
    assert found is not None
    drawn = np.random.default_rng(1).standard_normal(200_000)
    posterior = 1.0 / (1.0 + np.exp(-0.5 * found.weakest**2 - found.weakest * drawn))
    assert found.confidence == pytest.approx(float(np.mean(posterior)), abs=0.01)


def test_of_several_hypotheses_the_promised_confidence_is_what_a_draw_of_records_gives() -> None:
    random = np.random.default_rng(2)
    places, chances = 1.5 * random.standard_normal((5, 3)), random.dirichlet(np.ones(5))
    far = np.sum((places[:, None] - places[None]) ** 2, axis=-1)
    truths = random.choice(5, size=40_000, p=chances)
    records = places[truths] + random.standard_normal((40_000, 3))
    weights = np.exp(-0.5 * np.sum((records[:, None] - places[None]) ** 2, axis=-1)) * chances
    held = np.mean(weights[np.arange(40_000), truths] / weights.sum(axis=1))
    assert expected_confidence(chances, far) == pytest.approx(held, abs=0.015)


def test_a_long_record_that_tells_enough_is_not_passed_over_for_a_short_one_that_does_not(rig: KnownRig) -> None:
    found = next_experiment([late("delay", 0.003, 0.97), late("valve_lag", 0.003, 0.03)], rig, ROOM, fitted())
    assert found is not None
    assert found.nats >= 0.05


def test_an_experiment_keeps_the_joint_where_it_may_be(rig: KnownRig) -> None:
    rivals, limits = [late("delay", 0.08, 0.5), late("valve_lag", 0.08, 0.5)], (-20.0, 20.0)
    moved: list[float] = []
    for envelope in (SweepEnvelope(rests_mpa=(0.2,)), SweepEnvelope(rests_mpa=(0.2,), angle_deg=limits)):
        found = next_experiment(rivals, rig, envelope, fitted())
        assert found is not None
        moved.append(max(np.abs(base).max() for base in expect_planned(rig, planned(found.entries, PERIOD_NS)).base))
    assert moved[1] <= limits[1] < moved[0]
    assert next_experiment(rivals, rig, SweepEnvelope(rests_mpa=(0.2,), angle_deg=(-0.1, 0.1)), fitted()) is None


def test_where_the_simulator_moves_further_than_is_expected_it_counts(rig: KnownRig) -> None:
    pool = candidates(SweepEnvelope(rests_mpa=(0.15,)), (10.0,), PERIOD_NS)
    expected, simulator = (
        expect_planned(rig, planned(pool, PERIOD_NS)),
        load_model(CONFIGS / "models" / "simulated.yaml"),
    )
    alone, both = (within(expected, (-60.0, 60.0), known) for known in (None, simulator))
    reach = {k: float(np.abs(simulate(simulator, expected.pairs[k].raw).angle_deg).max()) for k in alone}
    assert set(both) == {k for k in alone if reach[k] <= 54.0} < set(alone)
    assert max(reach.values()) > 60.0
    assert within(expected, (-np.inf, np.inf), simulator) == list(range(len(pool)))


@pytest.mark.parametrize(
    "rivals",
    [
        [],
        [late("delay", 0.02, 1.0)],
        [late("delay", 0.02, 0.995), late("valve_lag", 0.02, 0.005)],
        [late("delay", 0.02, 0.5), late("delay", 0.02, 0.5)],
        [late("delay", 0.02, 0.5), late("sensor_lag", 0.02, 0.5, ANGLE)],
        [late("delay", 0.02, 0.5), replace(late("valve_lag", 0.02, 0.5), given="delay")],
    ],
    ids=["nothing", "one", "settled", "the same twice", "one on each factor", "a first and a second cause"],
)
def test_where_nothing_is_open_no_experiment_is_recommended(rig: KnownRig, rivals: list[Hypothesis]) -> None:
    assert next_experiment(rivals, rig, SweepEnvelope(rests_mpa=(0.2,)), fitted()) is None
