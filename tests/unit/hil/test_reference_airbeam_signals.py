"""What happens to set-points and readings of the seventh family of physics plants, each against its own law."""

import numpy as np
import pytest

from hil.reference.airbeam.disturbance import HEALTHY, ReadingLaw, TimingLaw
from hil.reference.airbeam.physics import Physics, draw_session
from hil.reference.airbeam.sensing import (
    CODE_DEG,
    by_rod,
    coded,
    echoed,
    generator_hum,
    line,
    monitor_reading,
    rung,
    shaken,
    slid_deg,
    through_cable,
    tracked,
    windings,
)
from hil.reference.airbeam.timing import arrivals_s, backed_off, interpolated, outages, stamped
from hil.reference.excitations import Excitation
from hil.reference.families import run, unit

PERIOD_S = 0.005


def test_tracking_is_not_late_at_a_steady_speed_but_overshoots():
    ramp = np.concatenate([np.zeros(200), np.arange(800) * 0.3])
    read = tracked(ramp, 42.0, 0.75, PERIOD_S)
    assert read[-1] == pytest.approx(ramp[-1], abs=1e-6)
    step = tracked(np.where(np.arange(400) < 50, 0.0, 1.0), 5.0, 0.35, PERIOD_S)
    assert 1.1 < step.max() < 1.8
    assert step[-1] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("lag_s", [0.002, 0.03, 0.2])
def test_a_long_cable_is_late_by_what_is_said(lag_s):
    ramp = np.arange(8000) * PERIOD_S
    late = ramp[-1] - through_cable(ramp, lag_s, PERIOD_S)[-1]
    assert late == pytest.approx(lag_s, abs=0.6 * PERIOD_S)
    step = through_cable(np.where(np.arange(2000) < 1, 0.0, 1.0), lag_s, PERIOD_S)
    assert step[-1] == pytest.approx(1.0, abs=1e-3)


def test_windings_that_are_not_alike_bend_the_line_and_keep_zero():
    angle = np.array([-40.0, -1e-3, 0.0, 1e-3, 40.0])
    read = windings(angle, 0.1, 0.0)
    assert read[2] == 0.0
    assert read[3] / 1e-3 == pytest.approx(1.1, rel=1e-6)
    assert 40.0 < read[4] < 44.0 * 0.98, "less of it further out"
    assert np.abs(by_rod(np.array([-40.0, 40.0]), 0.3)).max() == 1.0
    assert by_rod(np.array([0.0]), 0.3)[0] == 0.0
    assert abs(by_rod(np.array([0.5]), 0.3)[0]) < 1e-3, "level at zero"
    physics = Physics(once_deg=0.3, once_rad=1.0, twice_deg=0.1, twice_rad=2.0)
    assert line(np.array([0.0, 360.0]), physics) == pytest.approx([0.0, 360.0])


def test_a_shaken_shaft_stays_between_its_flanks():
    angle = 10.0 * np.sin(np.arange(8000) * 0.01)
    place = shaken(angle, 1.0, 0.005 * np.random.default_rng(1).standard_normal(8000))
    off = angle - place
    assert np.abs(off).max() <= 1.0 + 1e-12
    assert np.mean(np.abs(off) > 0.99) > 0.5, "it lies at a flank most of the time"
    assert np.ptp(place) == pytest.approx(np.ptp(angle) - 2.0, abs=0.2)


def test_two_converters_take_turns_and_do_not_agree():
    read = coded(np.full(1000, 3.1), ReadingLaw(step_deg=1.0, step_apart=0.3))
    assert set(read) == {3.0}
    read = coded(np.full(1000, 3.4), ReadingLaw(step_deg=1.0, step_apart=0.3))
    assert set(read) == {3.0, 4.0}
    fine = coded(np.linspace(-1.0, 1.0, 50), ReadingLaw())
    assert np.abs(fine - np.linspace(-1.0, 1.0, 50)).max() <= 0.5 * CODE_DEG + 1e-12


def test_sizes_of_what_is_added_to_the_angle_are_those_that_are_said():
    t, random = np.arange(40_000) * PERIOD_S, np.random.default_rng(2)
    assert np.std(rung(random.standard_normal(40_000), 0.55, 0.7)) == pytest.approx(1.0, rel=0.05)
    hum = generator_hum(t, ReadingLaw(hum_deg=0.5), random)
    assert np.sqrt(np.mean(hum**2)) == pytest.approx(0.5, rel=0.05)
    slid = slid_deg(t, ReadingLaw(drift_deg_min=6.0, drift_from=0.25))
    assert slid[0] == slid[9000] == 0.0
    assert slid[-1] == pytest.approx(6.0 * t[-1] / 60.0)
    old = echoed(np.arange(1000.0), 0.1, 0.5, PERIOD_S)
    assert old[500] == pytest.approx(0.9 * 500 + 0.1 * 400)


def test_a_monitor_is_late_by_its_filter_and_half_a_tick_and_its_zero_moves_with_the_days():
    ramp = np.linspace(0.1, 0.3, 4000)
    read = monitor_reading(ramp, 0.0, 1.0, PERIOD_S, np.random.default_rng(3))
    late = np.mean((ramp - read)[500:]) / (ramp[1] - ramp[0])
    assert late * PERIOD_S == pytest.approx(0.0025 + PERIOD_S / np.expm1(PERIOD_S / 0.005), abs=5e-4)
    assert 0.0003 < np.std((ramp - read)[500:]) < 0.0008
    zeros = [draw_session(Physics(), 0.008, np.random.default_rng(k)).monitor_bias_1_mpa for k in range(200)]
    assert 0.0004 < np.std(zeros) < 0.0015


def test_telegrams_that_collide_wait_once_in_the_mean_and_arrive_in_order():
    random = np.random.default_rng(4)
    for collide in (0.1, 0.4):
        waits = backed_off(200_000, collide, random)
        assert waits.mean() == pytest.approx(1.0, rel=0.05)
        assert np.mean(waits == 0.0) == pytest.approx(1.0 - collide, abs=0.01)
    arrival = arrivals_s(4000, PERIOD_S, TimingLaw(delay_s=0.03, delay_collide=0.3), random)
    assert np.all(np.diff(arrival) >= 0.0)
    assert np.mean(arrival - np.arange(4000) * PERIOD_S) == pytest.approx(0.032)
    assert np.std(np.diff(arrival)) > 1e-3


def test_waypoints_clock_and_outages():
    p = 0.2 + 0.05 * np.sin(np.arange(4000) * 0.02)
    drawn = interpolated(p, PERIOD_S, 0.1)
    assert drawn[20 + 40 : -20] == pytest.approx(p[40:-40], abs=2e-3), "one interval late, and straight between"
    assert drawn[0] == p[0]
    t = np.arange(4000) * PERIOD_S
    shown = stamped(np.array([t]), PERIOD_S, TimingLaw(clock_rate=-0.01, clock_oven_s=5.0))[0]
    assert shown[2000] - t[2000] == pytest.approx(-0.1, rel=0.02)
    assert shown[500] - t[500] == pytest.approx(-0.01 * (2.5 + 0.6 * 2.5), rel=0.02), "its oven was on"
    gone = outages(20_000, 0.3, 1.5, np.random.default_rng(5))
    assert np.mean(gone) == pytest.approx(0.3, abs=0.01)
    assert gone[0] == 0.0
    runs = np.diff(np.flatnonzero(np.diff(gone)))[::2]
    assert (runs.min(), runs.max() > 15) == (1, True), "short ones and long ones"


def test_units_and_days_come_from_their_seeds_and_a_day_moves_many_things_a_little():
    sine = Excitation("sine", 0.5, 0.15, seconds=5.0)
    rig, again = unit("airbeam", 11), unit("airbeam", 11)
    assert rig.physics == again.physics
    first, second = (run(sine, one, one.session(4, 0.01)) for one in (rig, again))
    assert all(np.array_equal(first[name], second[name]) for name in first)
    assert unit("airbeam", 12).physics != rig.physics
    moved = draw_session(rig.physics, 0.01, np.random.default_rng(6)).physics
    ratios = np.array([now / was for now, was in zip(moved, rig.physics, strict=True) if was != 0.0])
    assert np.sum(ratios != 1.0) > 15
    assert np.abs(np.log(ratios)).max() < 0.2
    assert HEALTHY.timing == TimingLaw()


def test_a_healthy_unit_is_a_plausible_rig():
    """Half of the loop's width at a slow sine is 3 to 15 % of the amplitude; steps take 30 to 150 ms to 63 %."""
    for seed in range(3):
        rig = unit("airbeam", seed)
        half = np.where(np.arange(1200) < 200, 0.0, 0.05)
        p1 = rig.simulate(0.2 + half, 0.2 - half, PERIOD_S, rig.still())["p1_mpa"]
        assert 0.03 < PERIOD_S * (int(np.argmax(p1 > 0.2 + 0.632 * 0.05)) - 200) < 0.15
        slow = run(Excitation("sine", 0.1, 0.2), rig, rig.still())
        command = slow["dp_cmd_mpa"]
        near = np.abs(command) < 0.02
        rising = np.gradient(command) > 0.0
        width = slow["angle_deg"][near & ~rising].mean() - slow["angle_deg"][near & rising].mean()
        assert 0.06 < width / (0.5 * np.ptp(slow["angle_deg"])) < 0.3
