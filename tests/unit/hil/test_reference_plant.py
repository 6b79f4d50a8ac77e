"""The physics plant: what it must do because it is physics, and that cases are drawn as promised."""

import math

import numpy as np
import pytest

from hil.reference.cases import CLEAR_RANGE, Purpose, bench_of, draw_sheet, realise, record_day
from hil.reference.disturbance import HEALTHY, Disturbance, RigLaw
from hil.reference.excitations import Excitation, paper_set
from hil.reference.mechanics import muscle_force
from hil.reference.other_laws import FOREIGN, OTHER_LAWS, merged
from hil.reference.plant import make_plant, run, simulate
from hil.reference.pneumatics import flow_function
from rig.errors import RigError
from rig.gap.effects import LIBRARY

SINE = Excitation("sine", 0.5, 0.2)


@pytest.fixture(scope="module")
def plant():
    return make_plant(3)


def test_paper_sine_turns_the_joint_about_forty_degrees_with_a_loop(plant):
    columns = run(SINE, plant, plant.still())
    angle, dp = columns["angle_deg"], columns["p1_mpa"] - columns["p2_mpa"]
    assert 30.0 < angle.max() < 50.0
    assert -50.0 < angle.min() < -30.0
    rising = (np.gradient(dp) > 0) & (np.abs(dp) < 0.02)
    falling = (np.gradient(dp) < 0) & (np.abs(dp) < 0.02)
    assert np.mean(angle[falling]) - np.mean(angle[rising]) > 2.0, "the angle lags behind the pressure: hysteresis"


def test_stiffness_rises_with_the_mean_pressure(plant):
    spans = [np.ptp(run(SINE._replace(p0_mpa=p0), plant, plant.still())["angle_deg"]) for p0 in (0.15, 0.2, 0.3)]
    assert spans[0] > spans[1] > spans[2]


def test_pressures_follow_the_set_points_late_and_settle_on_them(plant):
    half = np.where(np.arange(1200) < 200, 0.0, 0.05)
    columns = simulate(0.2 + half, 0.2 - half, 0.005, plant, plant.still())
    assert columns["p1_mpa"][210] < 0.24, "50 ms after the step it has not arrived"
    assert np.mean(columns["p1_mpa"][-200:]) == pytest.approx(0.25, abs=0.002)
    assert np.mean(columns["p2_mpa"][-200:]) == pytest.approx(0.15, abs=0.002)


def test_flow_is_choked_below_the_critical_ratio_and_stops_at_equal_pressures():
    assert flow_function(0.1) == flow_function(0.3) == 1.0
    assert flow_function(1.0) == flow_function(1.2) == 0.0
    assert flow_function(0.65) == pytest.approx(math.sqrt(0.75))


def test_muscle_pulls_in_proportion_to_pressure_and_never_pushes():
    assert muscle_force(0.2, 0.1, 0.436, 0.0125) == pytest.approx(2 * muscle_force(0.1, 0.1, 0.436, 0.0125))
    assert muscle_force(0.2, 0.6, 0.436, 0.0125) == 0.0


def test_same_arguments_same_record_and_another_day_another(plant):
    day = plant.session(5)
    first, again, other = run(SINE, plant, day), run(SINE, plant, day), run(SINE, plant, plant.session(6))
    assert all(np.array_equal(first[name], again[name]) for name in first)
    assert not np.array_equal(first["angle_deg"], other["angle_deg"])


def test_days_differ_more_with_more_drift(plant):
    spread = [
        np.std([run(SINE, plant, plant.session(k, drift))["angle_deg"] for k in range(4)], axis=0).mean()
        for drift in (0.004, 0.02)
    ]
    assert 0.03 < spread[0] < spread[1] < 2.0


def test_halving_the_internal_step_changes_little(plant, monkeypatch):
    coarse = run(SINE, plant, plant.still())["angle_deg"]
    monkeypatch.setattr("hil.reference.plant.STEP_S", 0.00025)
    fine = run(SINE, plant, plant.still())["angle_deg"]
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 0.15


def test_a_disturbance_that_throws_the_joint_is_named(plant):
    with pytest.raises(RigError, match="left"):
        run(SINE, plant, plant.still(), Disturbance(rig=RigLaw(push_nm=500.0, push_hz=0.5)))


def test_every_effect_of_the_library_has_another_law_and_the_foreign_ones_are_of_every_stage():
    assert set(OTHER_LAWS) == set(LIBRARY)
    assert not set(FOREIGN) & set(LIBRARY)
    assert len(FOREIGN) >= 6
    assert {entry.stage for entry in FOREIGN.values()} == {"timing", "valve", "muscle", "joint", "sensor"}


@pytest.mark.parametrize("effect", sorted(OTHER_LAWS | FOREIGN))
def test_effect_acts_and_grows_with_its_size(plant, effect):
    entry = (OTHER_LAWS | FOREIGN)[effect]
    day = plant.still()
    short = (Excitation("mixed", 0.5, 0.1, seconds=8.0), Excitation("sine", 0.8, 0.2, seconds=8.0))
    healthy = record_day(plant, day, short)

    def change(share: float) -> float:
        size = math.exp(math.log(entry.low) + share * (math.log(entry.high) - math.log(entry.low)))
        records = record_day(plant, day, short, entry.law(size, np.random.default_rng(4)))
        return math.sqrt(sum(np.mean((records[name]["angle_deg"] - healthy[name]["angle_deg"]) ** 2) for name in healthy))

    small, large = (change(0.9), change(0.1)) if entry.falling else (change(0.1), change(0.9))
    assert large > 0.2
    assert large > 2 * small


def test_signed_effects_go_both_ways(plant):
    entry, day = OTHER_LAWS["muscle_mismatch"], plant.still()
    means = [np.mean(run(SINE, plant, day, entry.law(size, np.random.default_rng(1)))["angle_deg"]) for size in (-0.1, 0.0, 0.1)]
    assert means[0] < means[1] < means[2]


def test_two_effects_at_once_keep_each_others_parameters():
    both = merged([Disturbance(rig=RigLaw(lugre_nm=1.0)), Disturbance(rig=RigLaw(pilot_s=0.1))])
    assert (both.rig.lugre_nm, both.rig.pilot_s) == (1.0, 0.1)
    assert merged([]) == HEALTHY


def test_sheet_has_the_promised_kinds_and_is_repeatable():
    sheet = draw_sheet(Purpose.SCORING, 9, 400)
    kinds = [case.kind for case in sheet]
    assert (kinds.count("none"), kinds.count("foreign"), kinds.count("pair"), kinds.count("single")) == (120, 60, 60, 160)
    assert sheet == draw_sheet(Purpose.SCORING, 9, 400)
    drawn = {case.effects[0] for case in sheet if case.kind == "single"}
    assert drawn == set(OTHER_LAWS)
    assert {sign for case in sheet for sign in case.signs} == {-1, 1}


def test_development_and_scoring_never_share_a_case_or_a_unit():
    for seed in range(5):
        development, scoring = (draw_sheet(purpose, seed, 60) for purpose in Purpose)
        assert [case.wanted_ratios for case in development] != [case.wanted_ratios for case in scoring]
    first, second = (bench_of(draw_sheet(purpose, 0, 10)[0]) for purpose in Purpose)
    assert first.plant != second.plant


def test_sizes_give_the_wanted_gap():
    case = next(case for case in draw_sheet(Purpose.DEVELOPMENT, 2, 40) if case.effects == ("sensor_lag",) or case.kind == "pair")
    made = realise(case, bench_of(case))
    for effect, wanted in zip(case.effects, case.wanted_ratios, strict=True):
        assert made.effects[effect]["ratio"] == pytest.approx(wanted, rel=0.3)
    again = realise(case, bench_of(case), {effect: fact["size"] for effect, fact in made.effects.items()})
    name = next(iter(made.records))
    assert np.array_equal(made.records[name]["angle_deg"], again.records[name]["angle_deg"])
    assert min(case.wanted_ratios) >= CLEAR_RANGE[0] or case.kind == "single"


def test_paper_set_stays_inside_the_regulators_range():
    for excitation in paper_set():
        half = 0.5 * excitation.dp_mpa()
        assert (excitation.p0_mpa - np.abs(half)).min() >= 0.005
        assert (excitation.p0_mpa + np.abs(half)).max() <= 0.5
