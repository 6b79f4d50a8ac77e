"""Exact where exactness is free: a delay, a clock that runs off, a filter of the regulators, a gain, an offset and a
sensor's lag act on the measured healthy day itself.

Put onto another day of two plant families and of a real joint they come back, but for what that day differs in itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from hil.reference.cases import Purpose, bench_of, draw_sheet
from rig.blind_check.source import records_of
from rig.gap.hypotheses.fit import Fit, fit_effect
from rig.gap.hypotheses.inverse_problems import angle_problem, pressure_problem
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.priors import fitted
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect
from rig.gap.reference.expected import Expected
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.response.causes import Applied, ready
from rig.gap.response.lateness import IN_TIME, Lateness, delayed, displaced
from rig.gap.response.propagate import Course, late, pressures_with
from rig.log.reader import read
from rig.model.compiled.stages import compiled
from rig.model.effect_stages import EFFECT_STAGES
from rig.record import Column, Record

RECORDS = 3
EXACT = 0.03
"""What a size may be off, as a share."""


@lru_cache
def days(family: str) -> tuple[list[Record], list[Record]]:
    """Two healthy days of one unit."""
    bench = bench_of(draw_sheet(Purpose.DEVELOPMENT, 909, 10, family)[0])
    first, second = (records_of(day)[:RECORDS] for day in bench.baselines[:2])
    return first, second


def wrist(shared: Path) -> tuple[list[Record], list[Record]]:
    """The real joint, and the same with its sensors' noise once more."""
    table = np.genfromtxt(shared / "real" / "porcaro_wrist" / "exp3_sweep_20260211.csv", delimiter=",", names=True)
    rows = table[(table["is_repeat_of_previous_packet"] == 0) & (table["t_s"] > 0.5)]
    first, second = rows["u_cmd_DF_MPa"], rows["u_cmd_F_MPa"]
    record = Record(
        "sweep", rows["t_s"] - rows["t_s"][0], first - second, rows["y_wrist_angle_deg"] - 36.0,
        rows["y_meas_DF_MPa"], rows["y_meas_F_MPa"], first, second,
    )  # fmt: skip
    noise = 0.05 * np.random.default_rng(1).standard_normal(len(record))
    return [replace(record, angle_deg=record.angle_deg + noise)], [record]


def later(record: Record, delay_s: float | Column) -> Record:
    """All that was measured, later; (n,) by so much at each row."""

    def shifted(column: Column | None) -> Column:
        return CubicSpline(record.t_s, column)(np.clip(record.t_s - delay_s, record.t_s[0], record.t_s[-1]))

    return replace(
        record, p1_mpa=shifted(record.p1_mpa), p2_mpa=shifted(record.p2_mpa), angle_deg=shifted(record.angle_deg)
    )


def running_off(record: Record, drift: float, begun_s: float = 0.0) -> Record:
    """All that was measured, on a rig whose clock is fast by a share since so long before the record."""
    return later(record, -drift * (begun_s + record.t_s - record.t_s[0]))


def slower(record: Record, tau_s: float, step_s: float = 5e-4) -> Record:
    """The angle behind a first-order low pass in continuous time."""
    t = np.arange(record.t_s[0], record.t_s[-1], step_s)
    angle, keep = CubicSpline(record.t_s, record.angle_deg)(t), np.exp(-step_s / tau_s)
    behind_it = lfilter([1.0 - keep], [1.0, -keep], angle - angle[0]) + angle[0]
    return replace(record, angle_deg=np.interp(record.t_s, t, behind_it))


def filtered(record: Record, tau_s: float, poles: int) -> Record:
    """Both pressures behind equal poles whose time constants sum to tau, in continuous time."""
    t = np.arange(record.t_s[0], record.t_s[-1] + 5e-4, 5e-4)
    keep = np.exp(-5e-4 * poles / tau_s)

    def low_pass(column: Column | None) -> Column:
        out = CubicSpline(record.t_s, column)(t)
        for _ in range(poles):
            out = lfilter([1.0 - keep], [1.0, -keep], out - out[0]) + out[0]
        return np.interp(record.t_s, t, out)

    return replace(record, p1_mpa=low_pass(record.p1_mpa), p2_mpa=low_pass(record.p2_mpa))


def louder(record: Record, gain: float) -> Record:
    assert record.angle_deg is not None
    return replace(record, angle_deg=(1.0 + gain) * record.angle_deg)


def expected(first: Sequence[Record], second: Sequence[Record], pressures: bool) -> Expected:
    return expect(ReferenceKind.SESSION, False, None, pair_up(second, [first], 0.2, pressures=pressures))


def found(effect: str, said: Expected) -> tuple[float, float]:
    """The size at which an effect is likeliest, and its standard deviation."""
    fit = fitted_to(effect, said)
    return float(fit.sizes[0]), float(fit.spread[0])


def fitted_to(effect: str, said: Expected) -> Fit:
    ahead = said.driven and LIBRARY[effect].upstream
    problem = (pressure_problem if ahead else angle_problem)(said, fitted())
    fit = fit_effect(LIBRARY[effect], problem.forward, problem.shows, problem.screening)
    assert fit is not None
    return fit


def sizes(
    effect: str,
    both: tuple[list[Record], list[Record]],
    put: Callable[[Record, float], Record],
    values: Sequence[float],
    pressures: bool,
) -> tuple[Column, float]:
    """What comes back of each size that is put onto the second day, and how unsure it is."""
    first, second = both
    back = [found(effect, expected(first, [put(one, size) for one in second], pressures)) for size in values]
    return np.array([size for size, _ in back]), max(spread for _, spread in back)


@pytest.mark.parametrize("pressures", [True, False])
@pytest.mark.parametrize("family", ["mckibben", "fluidic"])
@pytest.mark.parametrize(
    ("effect", "put", "values"),
    [("delay", later, (0.005, 0.03)), ("sensor_lag", slower, (0.01, 0.04)), ("sensor_gain", louder, (-0.06, 0.06))],
)
def test_what_is_put_onto_another_day_comes_back(
    family: str, effect: str, put: Callable[[Record, float], Record], values: tuple[float, float], pressures: bool
) -> None:
    back, spread = sizes(effect, days(family), put, values, pressures)
    assert back[1] - back[0] == pytest.approx(values[1] - values[0], rel=EXACT)
    assert back == pytest.approx(np.array(values), abs=4.0 * spread)  # the day itself is a little late or louder


@pytest.mark.parametrize("pressures", [True, False])
@pytest.mark.parametrize("drift", [-0.006, 0.006])
def test_a_clock_that_runs_off_put_onto_another_day_comes_back_and_leaves_nothing(
    drift: float, pressures: bool
) -> None:
    first, second = days("mckibben")
    said = expected(first, [running_off(record, drift) for record in second], pressures)
    fit = fitted_to("clock_drift", said)
    assert fit.sizes[0] == pytest.approx(drift, rel=EXACT)
    as_it_was = fitted_to("clock_drift", expected(first, second, pressures)).forward.factor
    left = fit.forward.factor.gap - fit.change
    most, before = (np.quantile(np.abs(one - one.mean()), 0.95) for one in (left, as_it_was.gap))
    assert most < 1.2 * before  # but for the last rows, in which a fast clock is ahead of the record
    assert np.std(left) < 0.2 * np.std(fit.forward.factor.gap)


@pytest.mark.parametrize("drift", [-0.0002, 0.0002])
def test_a_clock_that_runs_off_through_a_whole_session_comes_back(drift: float) -> None:
    """40 ms at the end of it, each record nearly as late from its start to its end."""
    first, second = days("mckibben")
    began = [90.0 * k for k in range(RECORDS)]
    facts = [{"started_ns": round(1e18 + 1e9 * at)} for at in began]
    off = [
        replace(running_off(one, drift, at), facts=dict(one.facts) | each)
        for one, at, each in zip(second, began, facts, strict=True)
    ]
    fit = fitted_to("clock_drift", expected(first, off, pressures=True))
    assert fit.law.whole_session
    assert fit.sizes[0] == pytest.approx(drift, rel=0.1)  # what the day itself is late grows as if it were the clock's
    assert np.std(fit.forward.factor.gap - fit.change) < 0.2 * np.std(fit.forward.factor.gap)


def test_an_effect_that_acts_on_both_factors_is_no_likelier_for_that() -> None:
    """Of a leak's three laws two act ahead of the monitors: the pressures alone gave them what all three have."""
    problem = pressure_problem(expected(*days("mckibben"), pressures=True), fitted())
    judged, alone = (
        fit_effect(LIBRARY["leak"], problem.forward, problem.shows, problem.screening, identifiable)
        for identifiable in (problem.identifiable, problem.shows)
    )
    assert judged is not None
    assert alone is not None
    assert judged.log_evidence == pytest.approx(alone.log_evidence - np.log(3.0 / 2.0))


@pytest.mark.parametrize("begun", [False, True])
def test_what_goes_on_through_a_session_is_tried_where_records_say_when_they_began(begun: bool) -> None:
    first, second = days("mckibben")
    dated = [
        replace(one, facts=dict(one.facts) | {"started_ns": 10**18 + k * 60_000_000_000})
        for k, one in enumerate(second)
    ]
    problem = pressure_problem(expected(first, dated if begun else second, pressures=True), fitted())
    shown = [law for law in LIBRARY["clock_drift"].laws if problem.shows(law)]
    assert any(law.whole_session for law in shown) is begun


@pytest.mark.parametrize(("low", "high"), [(-0.9, 0.9), (-0.8, 0.55), (-0.5, 0.85)])
def test_two_stops_are_found_where_each_is(low: float, high: float) -> None:
    """Shares of how far the joint goes."""
    first, second = days("mckibben")
    reach = max(float(np.max(np.abs(np.asarray(record.angle_deg)))) for record in second)
    stopped = [replace(one, angle_deg=np.clip(np.asarray(one.angle_deg), low * reach, high * reach)) for one in second]
    fit = fitted_to("end_stop", expected(first, stopped, pressures=True))
    assert [fit.applied.numbers["low_deg"], fit.applied.numbers["high_deg"]] == pytest.approx(
        [low * reach, high * reach], abs=0.03 * reach
    )


@pytest.mark.parametrize("delay_s", [0.005, 0.01, 0.02, 0.03])
def test_a_delay_put_onto_a_day_that_is_no_later_itself_is_exact(delay_s: float) -> None:
    back, _ = sizes("delay", days("mckibben"), later, (delay_s,), True)
    assert back[0] == pytest.approx(delay_s, rel=EXACT)


@pytest.mark.parametrize("delay_s", [0.005, 0.01, 0.02, 0.03])
def test_a_delay_put_onto_a_real_joint_is_exact_and_leaves_nothing_behind_the_monitors(
    shared: Path, delay_s: float
) -> None:
    first, second = wrist(shared)
    said = expected(first, [later(record, delay_s) for record in second], pressures=True)
    assert found("delay", said)[0] == pytest.approx(delay_s, rel=EXACT)
    left = np.concatenate([t.pair.case.angle_deg - b for t, b in zip(said.contexts, said.base, strict=True)])
    in_time = []
    for context in said.contexts:
        case, usual = context.pair.case, context.reference.angle_deg - context.propagated
        in_time.append(case.angle_deg - usual - said.response.angle(case.p1_mpa, case.p2_mpa, context.pair.dt_s))
    assert np.std(left) < 0.5 * np.std(np.concatenate(in_time))


@pytest.mark.parametrize("poles", [1, 2, 3])
@pytest.mark.parametrize("family", ["mckibben", "fluidic"])
def test_regulators_behind_a_filter_are_slow_by_as_much_and_not_late(family: str, poles: int) -> None:
    first, second = days(family)
    said = expected(first, [filtered(record, 0.05, poles) for record in second], pressures=True)
    lag, delay = fitted_to("valve_lag", said), fitted_to("delay", said)
    assert lag.sizes[0] == pytest.approx(0.05, rel=EXACT)
    assert lag.log_evidence > delay.log_evidence
    moved = expected(first, [later(record, 0.05) for record in second], pressures=True)
    assert fitted_to("valve_lag", moved).log_evidence < fitted_to("delay", moved).log_evidence


@given(delay_s=st.floats(-0.12, 0.12), hz=st.floats(0.2, 1.5), share=st.floats(0.2, 1.0))
def test_a_column_at_another_time_is_found_at_that_time(delay_s: float, hz: float, share: float) -> None:
    t = 0.005 * np.arange(2000)

    def course(at: Column) -> Column:
        return np.sin(2 * np.pi * hz * at) + share * np.sin(2 * np.pi * 0.37 * hz * at + 0.5)

    whole_s = 0.005 * len(t)
    late = displaced(course(t - delay_s), course(t), 0.005)
    assert [late.start_s, late.start_s + late.growth * whole_s] == pytest.approx([delay_s, delay_s], abs=6e-3)
    assert displaced(2.0 + course(t), course(t), 0.005).rms_s(whole_s) == pytest.approx(0.0, abs=5e-2)


@given(start_s=st.floats(-0.05, 0.05), growth=st.floats(-0.006, 0.006), hz=st.floats(0.3, 1.2))
def test_a_column_that_runs_off_is_found_at_its_pace(start_s: float, growth: float, hz: float) -> None:
    t = 0.005 * np.arange(4000)
    late = displaced(np.sin(2 * np.pi * hz * (t - start_s - growth * t)), np.sin(2 * np.pi * hz * t), 0.005)
    assert late.start_s == pytest.approx(start_s, abs=4e-3)
    assert late.growth == pytest.approx(growth, abs=4e-4)


@given(start_s=st.floats(-0.1, 0.1), growth=st.floats(-0.01, 0.01))
def test_a_column_is_delayed_by_what_its_lateness_says(start_s: float, growth: float) -> None:
    t = 0.005 * np.arange(1000)
    late = Lateness(start_s, growth)
    moved = delayed(np.sin(2 * np.pi * 0.8 * t), late, 0.005)
    inside = np.abs(t - 2.5) < 2.2
    assert moved[inside] == pytest.approx(np.sin(2 * np.pi * 0.8 * (t - start_s - growth * t))[inside], abs=1e-5)
    each = start_s + growth * t
    assert late.rms_s(5.0) == pytest.approx(np.sqrt(np.mean(each**2)), rel=1e-2)
    assert late + late.times(-1.0) == IN_TIME


def test_the_practice_days_give_a_delay_back(shared: Path) -> None:
    first, second = (read(shared / "practice" / "unit_b" / f"baseline_{k}")[:RECORDS] for k in (1, 2))
    back, spread = sizes("delay", (first, second), later, (0.02,), True)
    assert back[0] == pytest.approx(0.02, rel=EXACT, abs=spread)


@pytest.mark.parametrize("stage", [name for name, known in EFFECT_STAGES.items() if known.exact])
def test_an_exact_stage_does_not_depend_on_the_nominal_rig(stage: str) -> None:
    said = expected(*days("mckibben"), pressures=True)
    size = EFFECT_STAGES[stage].size
    causes = ready([Applied(stage, {size: 0.02})], said.response)
    other = replace(said.response, regulators=((0.01, 0.3, 0.2), (0.0, 0.1, 0.2)))
    for context in said.contexts:
        own, strange = (pressures_with(causes, Course((context,)), response) for response in (said.response, other))
        assert own[0] == pytest.approx(strange[0], abs=1e-12)
        assert own[1] == pytest.approx(strange[1], abs=1e-12)


def test_a_late_track_is_the_track_some_rows_before() -> None:
    said = expected(*days("mckibben"), pressures=True)
    context = said.contexts[0]
    moved = late(ready([Applied("delay", {"delay_s": 3 * context.pair.dt_s})], said.response), context)
    assert moved.reference.angle_deg[3:] == pytest.approx(context.reference.angle_deg[:-3])
    assert moved.regulated[1][3:] == pytest.approx(context.regulated[1][:-3])
    assert late((), context) is context


@pytest.mark.parametrize("poles", [1.0, 4.0, 8.0])
@pytest.mark.parametrize("dt_s", [0.001, 0.005, 0.01, 0.02])
def test_a_sensor_lags_by_its_time_constants_at_every_sample_time(dt_s: float, poles: float) -> None:
    stage, tau = EFFECT_STAGES["sensor_lag"], 0.03
    ramp = 10.0 * np.arange(0.0, 1.0, dt_s)
    angle, nothing = ramp.copy(), np.zeros_like(ramp)
    compiled(stage.stage)(nothing, nothing, angle, np.zeros(stage.state_size), np.array([tau, poles]), dt_s)
    assert ramp[-1] - angle[-1] == pytest.approx(10.0 * tau, rel=1e-6)
