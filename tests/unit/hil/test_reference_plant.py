"""The physics plants: what they must do because they are physics, whatever their family."""

from dataclasses import replace

import numpy as np
import pytest

from hil.reference.excitations import Excitation
from hil.reference.families import disturbance, family, run, unit
from hil.reference.names import NAMES
from rig.errors import RigError
from rig.gap.hypotheses.library import LIBRARY

SINE = Excitation("sine", 0.5, 0.2)
EFFECTS = [(name, effect) for name in NAMES for effect in sorted(family(name).laws)]


def test_a_play_is_counted_as_the_library_counts_it_half_of_the_whole(build, plant):
    known = LIBRARY["backlash"].laws[0]
    assert family(build).laws["backlash"].library_parameter == known.free[0] == "width_deg"
    healthy, loose = (
        run(SINE, plant, plant.still(), made)["angle_deg"] for made in (None, disturbance(build, {"backlash": 2.0}))
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


def test_sisters_differ_more_than_days_and_are_of_one_build(build, plant):
    angles = [
        run(SINE, sister, sister.still())["angle_deg"] for sister in (plant, *(unit(build, seed) for seed in (4, 5)))
    ]
    days = [run(SINE, plant, plant.session(k))["angle_deg"] for k in range(3)]
    assert 2.0 * np.std(days, axis=0).mean() < np.std(angles, axis=0).mean() < 5.0


def test_halving_the_internal_step_changes_little(plant):
    coarse = run(SINE, plant, plant.still())["angle_deg"]
    finer = replace(plant, build=replace(plant.build, step_s=0.5 * plant.build.step_s))
    fine = run(SINE, finer, finer.still())["angle_deg"]
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 0.15


def test_a_disturbance_that_throws_the_joint_is_named(build, plant):
    wild = {
        "mckibben": {"foreign_push": 500.0},
        "fluidic": {"gravity_load": -4000.0},
        "pleated": {"gravity_load": -900.0},
        "bellows": {"gravity_load": -900.0},
        "bundle": {"gravity_load": -900.0},
        "sleeve": {"gravity_load": -900.0},
        "airbeam": {"gravity_load": -900.0},
        "diaphragm": {"gravity_load": -900.0},
        "pouch": {"gravity_load": -900.0},
    }[build]
    with pytest.raises(RigError, match="left"):
        run(SINE, plant, plant.still(), disturbance(build, wild))
