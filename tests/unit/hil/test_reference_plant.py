"""The physics plants: what they must do because they are physics, whatever their family, and that cases are drawn as
promised."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from hil.reference.bellows.mechanics import (
    BREAK_AWAY,
    bulge,
    half_angle,
    pouch_force,
    pouch_volume,
    sliding,
)
from hil.reference.bellows.physics import Physics as BellowsPhysics
from hil.reference.bellows.pneumatics import conductance
from hil.reference.bundle.mechanics import ANGLE as BUNDLE_ANGLE
from hil.reference.bundle.mechanics import LATE_RAD, place, rubbed
from hil.reference.bundle.mechanics import STATES as BUNDLE_STATES
from hil.reference.bundle.mechanics import TAKEN as BUNDLE_TAKEN
from hil.reference.bundle.mechanics import dry_torque as bundle_dry_torque
from hil.reference.bundle.physics import Physics as BundlePhysics
from hil.reference.bundle.pneumatics import CHOKED_DROP, seat_flow
from hil.reference.bundle.sensing import mean_weights
from hil.reference.bundle.strands import bundle_force, cavity, invariant, strand_force
from hil.reference.cases import (
    CLEAR_RANGE,
    Purpose,
    bench_of,
    draw_sheet,
    made_to_order,
    realise,
    realise_in_range,
    record_day,
)
from hil.reference.excitations import Excitation, paper_set
from hil.reference.families import JUDGE, NAMES, disturbance, family, run, unit
from hil.reference.fluidic.mechanics import muscle_force as fluidic_force
from hil.reference.fluidic.physics import Physics as FluidicPhysics
from hil.reference.fluidic.pneumatics import nozzle
from hil.reference.mckibben.mechanics import muscle_force
from hil.reference.mckibben.pneumatics import flow_function
from hil.reference.pleated.mechanics import AGE, SLIDE_RAD_S, STATES, dry_torque
from hil.reference.pleated.mechanics import muscle_force as pleated_force
from hil.reference.pleated.physics import Physics as PleatedPhysics
from hil.reference.pleated.pneumatics import parabola
from rig.app.gap.levels import known_families
from rig.errors import ConfigError, RigError
from rig.gap.hypotheses.library import LIBRARY

SINE = Excitation("sine", 0.5, 0.2)
EFFECTS = [(name, effect) for name in NAMES for effect in sorted(family(name).laws)]


@pytest.fixture(scope="module", params=NAMES)
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def plant(name):
    return unit(name, 3)


def test_a_play_is_counted_as_the_library_counts_it_half_of_the_whole(name, plant):
    known = LIBRARY["backlash"].laws[0]
    assert family(name).laws["backlash"].library_parameter == known.free[0] == "width_deg"
    healthy, loose = (
        run(SINE, plant, plant.still(), made)["angle_deg"] for made in (None, disturbance(name, {"backlash": 2.0}))
    )
    half = len(healthy) // 2
    assert 0.5 * (np.ptp(healthy[half:]) - np.ptp(loose[half:])) == pytest.approx(2.0, rel=0.2)


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
    columns = plant.simulate(0.2 + half, 0.2 - half, 0.005, plant.still())
    assert columns["p1_mpa"][210] < 0.245, "50 ms after the step it has not arrived"
    assert np.mean(columns["p1_mpa"][-200:]) == pytest.approx(0.25, abs=0.002)
    assert np.mean(columns["p2_mpa"][-200:]) == pytest.approx(0.15, abs=0.002)


@pytest.mark.parametrize(
    ("flow", "choked"),
    [(flow_function, 0.3), (nozzle, 0.528), (parabola, 0.5), (conductance, 0.36), (seat_flow, 1.0 - CHOKED_DROP)],
)
def test_flow_is_choked_below_the_critical_ratio_and_stops_at_equal_pressures(flow, choked):
    assert flow(0.1) == flow(choked) == 1.0
    assert flow(1.0) == flow(1.2) == 0.0
    assert flow(choked + 1e-3) == pytest.approx(1.0, abs=1e-3)
    assert 0.0 < flow(0.9) < flow(0.7) < 1.0


def test_orifices_are_those_of_the_books():
    assert flow_function(0.65) == pytest.approx(math.sqrt(0.75))
    assert nozzle(0.8) == pytest.approx(math.sqrt(0.8 ** (2 / 1.4) - 0.8 ** (2.4 / 1.4)) / 0.2588, rel=1e-3)
    expansion = 1.0 - 0.2 / (3.0 * CHOKED_DROP)
    by_standard = expansion * math.sqrt(0.2) / (2.0 / 3.0 * math.sqrt(CHOKED_DROP))
    assert seat_flow(0.8) == pytest.approx(by_standard), "IEC 60534-2-1, against its choked flow"


def test_muscle_pulls_in_proportion_to_pressure_and_never_pushes():
    assert muscle_force(0.2, 0.1, 0.436, 0.0125) == pytest.approx(2 * muscle_force(0.1, 0.1, 0.436, 0.0125))
    assert muscle_force(0.2, 0.6, 0.436, 0.0125) == 0.0
    physics = FluidicPhysics()
    assert (
        fluidic_force(0.2, 0.1, 0.0, physics)
        > fluidic_force(0.1, 0.1, 0.0, physics)
        > fluidic_force(0.1, 0.2, 0.0, physics)
    )
    assert fluidic_force(0.2, 0.6, 0.0, physics) == 0.0
    pleats = PleatedPhysics()
    assert pleated_force(0.2, 0.1, 0.0, pleats) == pytest.approx(2.0 * pleated_force(0.1, 0.1, 0.0, pleats))
    assert pleated_force(0.2, 0.21, 0.0, pleats) == pytest.approx(0.2 * pleats.strength_n_mpa)
    assert pleated_force(0.2, 0.5, 0.0, pleats) == 0.0


@pytest.mark.parametrize("contraction", [0.01, 0.08, 0.15, 0.25, 0.34])
def test_force_of_a_pouch_is_what_its_volume_gives_for_its_length(contraction):
    """Virtual work: force times length given up is pressure times volume won."""
    physics = BellowsPhysics(fold_n=0.0, stretch_per_mpa=0.0)
    t, at_zero = half_angle(contraction), bulge(half_angle(physics.contraction))
    assert 1.0 - math.sin(t) / t == pytest.approx(contraction, rel=1e-4)
    cubic_m_per_unit = 0.5 * physics.length_m * physics.pouch_n_mpa * at_zero / (1.0 - physics.dead_share)
    step = 1e-4
    high, low = (pouch_volume(half_angle(contraction + off), at_zero, physics)[0] for off in (step, -step))
    slope = pouch_volume(t, at_zero, physics)[1]
    assert (high - low) / (2.0 * step) == pytest.approx(slope, rel=2e-3)
    by_work = 0.2 * slope * cubic_m_per_unit / physics.length_m
    assert pouch_force(0.2, contraction, physics) == pytest.approx(by_work, rel=1e-6)


def test_folds_of_a_pouch_push_back_ever_more_and_a_muscle_never_pushes():
    physics = BellowsPhysics()
    free = physics._replace(fold_n=0.0)
    lost = [pouch_force(0.2, c, free) - pouch_force(0.2, c, physics) for c in (0.1, 0.2, 0.3)]
    assert 0.0 < lost[0] < lost[1] < lost[2]
    assert lost[2] - lost[1] > lost[1] - lost[0]
    assert pouch_force(0.2, 0.5, physics) == pouch_force(0.0, 0.15, physics) == 0.0


@pytest.mark.parametrize("contraction", [0.02, 0.08, 0.16, 0.19])
def test_force_of_a_strand_is_the_work_of_its_air_less_the_energy_of_its_bladder(contraction):
    """Virtual work, with the energies differentiated here: pressure times volume, and Gent's rubber."""
    physics, step, pressure_mpa = BundlePhysics(), 1e-5, 0.2
    stretches = 1.0 - contraction + step, 1.0 - contraction - step

    def energy(stretch: float) -> float:
        used = (invariant(stretch, physics)[0] - 3.0) / physics.rubber_limit
        rubber = -0.5 * physics.rubber_mpa * physics.rubber_limit * math.log(1.0 - used) * physics.wall
        return rubber - pressure_mpa * cavity(stretch, physics)[0]

    longer, shorter = (energy(stretch) for stretch in stretches)
    by_work = physics.area_n_mpa * (longer - shorter) / (2.0 * step)
    assert strand_force(pressure_mpa, contraction, physics) == pytest.approx(by_work, rel=1e-5)


def test_a_thin_strand_without_thickness_and_rubber_is_the_ideal_braid():
    physics = BundlePhysics(yarn=0.0, wall=0.0, jam_n=0.0)
    radius_m = math.sqrt(physics.area_n_mpa * 1e-6 / math.pi)
    ideal = muscle_force(0.2, 0.12, physics.braid_rad, radius_m)
    assert strand_force(0.2, 0.12, physics) == pytest.approx(ideal, rel=1e-9)


def test_strands_pull_one_after_another_jam_and_never_push():
    physics = BundlePhysics()
    even = physics._replace(uneven=0.0)
    assert bundle_force(0.2, 0.16, 0.0, even) == pytest.approx(strand_force(0.2, 0.16, even))
    ends = [c for c in np.linspace(0.1, 0.4, 301) if bundle_force(0.05, c, 0.0, even) == 0.0]
    assert bundle_force(0.05, ends[0], 0.0, physics) > 0.0, "where even strands have ended the shortest still pull"
    assert bundle_force(0.2, 0.6, 0.0, physics) == bundle_force(0.0, 0.16, 0.0, physics) == 0.0
    whole, short = bundle_force(0.2, 0.16, 0.0, physics), bundle_force(0.2, 0.16, 0.2, physics)
    assert short < 0.8 * whole, "the shortest are torn first, and they carry the most"
    free = physics._replace(jam_n=0.0)
    lost = [strand_force(0.2, c, free) - strand_force(0.2, c, physics) for c in (0.19, 0.22, 0.24)]
    assert lost[0] == 0.0 < lost[1] < lost[2]


def test_friction_of_yarns_closes_its_loops_and_forgets_them():
    state = np.zeros(BUNDLE_STATES)
    path = [*np.linspace(0.0, 6.0, 61), *np.linspace(6.0, -6.0, 121)]
    before = [rubbed(float(x), state) for x in path]
    assert before[60] == pytest.approx(6.0 / 7.0), "the hyperbola"
    assert before[-1] == pytest.approx(-before[60]), "Masing: the way back is twice as wide"
    inner = [rubbed(float(x), state) for x in (*np.linspace(-6.0, 1.0, 71), *np.linspace(1.0, -2.0, 31), 1.0)]
    assert inner[-1] == pytest.approx(inner[70]), "a small loop closes where it began"
    top = [rubbed(float(x), state) for x in np.linspace(1.0, 6.0, 51)]
    assert top[-1] == pytest.approx(before[60]), "and leaves no trace on the large one"


def test_a_tight_bearing_holds_more_when_it_sets_out_than_later():
    state = np.zeros(BUNDLE_STATES)
    first = [-bundle_dry_torque(1.0, 1e-5, state) for _ in range(4000)]
    assert max(first) > 1.05
    later = [-bundle_dry_torque(1.0, LATE_RAD, state) for _ in range(20)]
    assert later[-1] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("angle", [-0.6, -0.1, 0.0, 0.4])
def test_a_pulley_off_its_centre_pulls_by_the_belt_that_it_takes_up(angle):
    wrong = disturbance("bundle", {"pulley_off_centre": 0.2}).rig
    taken, step = [], 1e-5
    state = np.zeros(BUNDLE_STATES)
    for off in (-step, step, 0.0):
        state[BUNDLE_ANGLE] = angle + off
        place(state, BundlePhysics(), wrong)
        taken.append(state[BUNDLE_TAKEN : BUNDLE_TAKEN + 2].copy())
    slope = (taken[1] - taken[0]) / (2.0 * step)
    arms = state[BUNDLE_TAKEN + 2 : BUNDLE_TAKEN + 4]
    assert slope == pytest.approx([arms[0], -arms[1]], rel=1e-6)


@pytest.mark.parametrize("window_s", [0.0005, 0.004, 0.013, 0.05])
def test_a_mean_over_a_window_is_late_by_half_of_it(window_s):
    weights = mean_weights(window_s, 0.005)
    assert weights.sum() == pytest.approx(1.0)
    assert 0.005 * float(np.sum(weights * np.arange(len(weights)))) == pytest.approx(0.5 * window_s)


def test_elasto_plastic_friction_is_a_spring_below_break_away():
    steady = 0.004
    assert sliding(0.99 * BREAK_AWAY * steady, 1.0, steady) == 0.0
    assert sliding(steady, 1.0, steady) == 1.0
    assert sliding(steady, -1.0, steady) == 0.0, "on the way back it is a spring again"
    assert 0.0 < sliding(0.8 * steady, 1.0, steady) < sliding(0.9 * steady, 1.0, steady) < 1.0


@pytest.mark.parametrize("free", [1e-9, 1e-4, 0.1, 5.0])
def test_rate_and_state_friction_solves_its_own_equation(free):
    """The joint's speed after the step and the torque that the law has at that speed belong together."""
    level, inertia, dt_s = 2.0, 0.01, 5e-4
    state = np.zeros(STATES)
    state[AGE] = 1.0  # at rest for the time that it takes to slide the critical length at the reference speed
    torque = dry_torque(free, level, inertia, state, dt_s)
    speed = free - dt_s / inertia * torque
    by_law = 0.04 * level * math.asinh(max(speed, 0.0) / (2.0 * SLIDE_RAD_S) * math.exp(25.0))
    assert 0.0 <= torque <= inertia * free / dt_s
    assert by_law == pytest.approx(torque, rel=1e-3, abs=1e-6 + inertia * 1e-9 / dt_s)


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


def test_sisters_differ_more_than_days_and_are_of_one_build(name, plant):
    angles = [
        run(SINE, sister, sister.still())["angle_deg"] for sister in (plant, *(unit(name, seed) for seed in (4, 5)))
    ]
    days = [run(SINE, plant, plant.session(k))["angle_deg"] for k in range(3)]
    assert 2.0 * np.std(days, axis=0).mean() < np.std(angles, axis=0).mean() < 5.0


def test_halving_the_internal_step_changes_little(plant):
    coarse = run(SINE, plant, plant.still())["angle_deg"]
    finer = replace(plant, build=replace(plant.build, step_s=0.5 * plant.build.step_s))
    fine = run(SINE, finer, finer.still())["angle_deg"]
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 0.15


def test_a_disturbance_that_throws_the_joint_is_named(name, plant):
    wild = {
        "mckibben": {"foreign_push": 500.0},
        "fluidic": {"gravity_load": -4000.0},
        "pleated": {"gravity_load": -900.0},
        "bellows": {"gravity_load": -900.0},
        "bundle": {"gravity_load": -900.0},
    }[name]
    with pytest.raises(RigError, match="left"):
        run(SINE, plant, plant.still(), disturbance(name, wild))


def test_families_and_effects_that_are_not_there_are_named():
    with pytest.raises(
        RigError, match=r"plant family 'piston': expected one of mckibben, fluidic, pleated, bellows, bundle"
    ):
        unit("piston", 1)
    with pytest.raises(RigError, match=r"effect 'gremlins': family fluidic has backlash, "):
        disturbance("fluidic", {"gremlins": 1.0})


def test_every_effect_of_the_library_has_another_law_and_the_foreign_ones_are_of_every_stage(name):
    chosen = family(name)
    assert set(chosen.effects) >= set(LIBRARY)
    assert not set(chosen.foreign) & set(LIBRARY)
    assert len(chosen.foreign) >= 6
    assert {entry.stage for entry in chosen.foreign.values()} == {"timing", "valve", "muscle", "joint", "sensor"}


def test_families_share_no_foreign_effect_and_place_the_known_ones_alike():
    for first, second in itertools.combinations((family(name) for name in NAMES), 2):
        assert not set(first.foreign) & set(second.foreign)
        assert {effect: law.stage for effect, law in first.effects.items()} == {
            effect: law.stage for effect, law in second.effects.items()
        }


@pytest.mark.parametrize(("name", "effect"), EFFECTS)
def test_effect_acts_and_grows_with_its_size(name, effect):
    plant, entry = unit(name, 3), family(name).laws[effect]
    day = plant.still()
    short = (Excitation("mixed", 0.5, 0.1, seconds=8.0), Excitation("sine", 0.8, 0.2, seconds=8.0))
    healthy = record_day(plant, day, short)

    def change(share: float) -> float:
        size = math.exp(math.log(entry.low) + share * (math.log(entry.high) - math.log(entry.low)))
        records = record_day(plant, day, short, entry.law(size, np.random.default_rng(4)))
        return math.sqrt(
            sum(np.mean((records[name]["angle_deg"] - healthy[name]["angle_deg"]) ** 2) for name in healthy)
        )

    small, large = (change(0.9), change(0.1)) if entry.falling else (change(0.1), change(0.9))
    assert large > 0.2
    assert large > 2 * small


def test_signed_effects_go_both_ways(name, plant):
    day = plant.still()
    means = [
        np.mean(run(SINE, plant, day, disturbance(name, {"muscle_mismatch": size}))["angle_deg"])
        for size in (-0.1, 1e-9, 0.1)
    ]
    assert means[0] < means[1] < means[2]


def test_two_effects_at_once_keep_each_others_parameters():
    both = disturbance("mckibben", {"coulomb_friction": 1.0, "valve_lag": 0.1})
    assert (both.rig.lugre_nm, both.rig.pilot_s) == (1.0, 0.1)
    assert disturbance("fluidic", {}) == family("fluidic").healthy


def test_sheet_has_the_promised_kinds_and_is_repeatable(name):
    sheet = draw_sheet(Purpose.SCORING, 9, 400, name)
    kinds = [case.kind for case in sheet]
    assert (kinds.count("none"), kinds.count("foreign"), kinds.count("pair"), kinds.count("single")) == (
        120,
        60,
        60,
        160,
    )
    assert sheet == draw_sheet(Purpose.SCORING, 9, 400, name)
    drawn = {case.effects[0] for case in sheet if case.kind == "single"}
    assert drawn == set(family(name).effects)
    assert {sign for case in sheet for sign in case.signs} == {-1, 1}
    assert {case.family for case in sheet} == {name}
    few = draw_sheet(Purpose.SCORING, 9, 40, name, known=("delay", "valve_lag", "backlash"))
    assert {effect for case in few if case.kind != "foreign" for effect in case.effects} == {
        "delay",
        "valve_lag",
        "backlash",
    }


def test_development_and_scoring_never_share_a_case_or_a_unit():
    for seed in range(5):
        sheets = [draw_sheet(purpose, seed, 60, name) for purpose in Purpose for name in NAMES]
        ratios = {tuple(case.wanted_ratios for case in sheet) for sheet in sheets}
        assert len(ratios) == len(sheets)
    first, second = (bench_of(draw_sheet(purpose, 0, 10)[0]) for purpose in Purpose)
    assert first.plant != second.plant


@pytest.mark.parametrize("name", NAMES)
def test_sizes_give_the_wanted_gap(name):
    sheet = draw_sheet(Purpose.DEVELOPMENT, 2, 40, name)
    case = next(case for case in sheet if case.effects == ("sensor_lag",) or case.kind == "pair")
    made = realise(case, bench_of(case))
    for effect, wanted in zip(case.effects, case.wanted_ratios, strict=True):
        assert made.effects[effect]["ratio"] == pytest.approx(wanted, rel=0.3)
    again = realise(case, bench_of(case), {effect: fact["size"] for effect, fact in made.effects.items()})
    name = next(iter(made.records))
    assert np.array_equal(made.records[name]["angle_deg"], again.records[name]["angle_deg"])
    assert min(case.wanted_ratios) >= CLEAR_RANGE[0] or case.kind == "single"


def test_effects_that_only_together_drive_the_joint_out_of_its_range_are_made_smaller():
    sheet = draw_sheet(Purpose.SCORING, 900111, 40, "pleated", tuple(LIBRARY))
    case = next(case for case in sheet if case.effects == ("fill_exhaust_asymmetry", "inertia"))
    with pytest.raises(RigError, match="left"):
        realise(case, bench_of(case))
    made, untouched = realise_in_range(case, bench_of(case))
    assert max(np.abs(columns["angle_deg"]).max() for day in (made.records, untouched) for columns in day.values()) < 75
    for effect, wanted in zip(case.effects, case.wanted_ratios, strict=True):
        assert 0.0 < made.effects[effect]["ratio"] < wanted


def test_a_case_is_made_to_order(name):
    made, bench = made_to_order(name, 7, {"valve_lag": 0.05, "sensor_gain": -0.1}, seed=1)
    assert made.case.effects == ("valve_lag", "sensor_gain")
    assert made.ratio_angle > 2.0
    assert len(made.records) == 7
    assert len(bench.baselines) == 6
    assert {len(columns["t_s"]) for columns in made.records.values()} == {4000}
    healthy, _ = made_to_order(name, 7, {}, seed=1)
    assert healthy.case.kind == "none"
    assert healthy.ratio_angle == 0.0


def test_paper_set_stays_inside_the_regulators_range():
    for excitation in paper_set():
        half = 0.5 * excitation.dp_mpa()
        assert (excitation.p0_mpa - np.abs(half)).min() >= 0.005
        assert (excitation.p0_mpa + np.abs(half)).max() <= 0.5


def test_levels_are_fitted_on_all_families_but_the_judge_and_those_left_out():
    assert known_families(()) == tuple(name for name in NAMES if name != JUDGE)
    assert known_families((), ("pleated",)) == tuple(name for name in NAMES if name not in (JUDGE, "pleated"))
    assert known_families((JUDGE,)) == (JUDGE,), "whoever names it has it"
    with pytest.raises(ConfigError, match=r"--leave-out: unknown plant family 'piston'"):
        known_families((), ("piston",))
    with pytest.raises(ConfigError, match=r"--leave-out: no plant family is left"):
        known_families(("pleated",), ("pleated",))
    with pytest.raises(ConfigError, match=r"unknown plant family 'piston'"):
        known_families(("piston",))
