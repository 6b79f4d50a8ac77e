"""What happens to set-points and readings of the eighth family of physics plants, and what its effects do."""

import numpy as np
import pytest

from hil.reference.diaphragm.disturbance import HEALTHY, ReadingLaw, TimingLaw
from hil.reference.diaphragm.physics import Physics
from hil.reference.diaphragm.sensing import (
    CODE_DEG,
    SECOND_LATER_S,
    added,
    coded,
    excited,
    followed,
    grain,
    kinked,
    leaning,
    lifted_off,
    monitor_reading,
    motor_hum,
    picked_up,
    track,
)
from hil.reference.diaphragm.timing import WRITE_S, aged_s, arrivals_s, extrapolated, losses, stamped
from hil.reference.excitations import Excitation
from hil.reference.families import disturbance, family, run, unit

PERIOD_S = 0.005
SHORT = Excitation("sine", 0.5, 0.2, seconds=6.0)
T = np.arange(4000) * PERIOD_S


def test_a_queue_keeps_the_order_and_waits_in_the_mean_as_said():
    arrival = arrivals_s(4000, PERIOD_S, TimingLaw(delay_s=0.03, delay_shape=0.7), np.random.default_rng(4))
    assert np.all(np.diff(arrival) >= -1e-12)
    assert np.mean(arrival - T) == pytest.approx(0.03 + WRITE_S)
    assert np.std(arrival - T) > 2e-3
    assert arrivals_s(9, PERIOD_S, TimingLaw(), np.random.default_rng(1)) == pytest.approx(T[:9] + WRITE_S)


def test_a_gateway_goes_on_as_set_points_last_went():
    ramp = 0.1 + 0.01 * T
    assert extrapolated(ramp, PERIOD_S, 0.2)[100:] == pytest.approx(ramp[100:], abs=1e-9)
    corner = np.minimum(ramp, 0.2)
    assert extrapolated(corner, PERIOD_S, 0.3).max() > 0.2005, "beyond a corner"
    assert extrapolated(np.where(T < 1.0, 0.0, 0.5), PERIOD_S, 0.3).max() <= 0.55


def test_a_crystal_ages_ever_more_slowly_and_losses_cluster():
    ahead = aged_s(T, 2.0)
    assert (ahead[0], ahead[-1]) == (0.0, pytest.approx(T[-1]))
    assert np.all(np.diff(ahead) > 0.0)
    assert ahead[2000] < T[2000]
    shown = stamped(np.array([T]), PERIOD_S, TimingLaw(clock_rate=-0.01, clock_ages_s=2.0))[0]
    assert shown[3000] - T[3000] == pytest.approx(-0.01 * ahead[3000], rel=0.02)
    gone = losses(40_000, 0.3, 0.5, np.random.default_rng(5))
    assert np.mean(gone) == pytest.approx(0.3, abs=0.03)
    assert np.mean(gone[1:][gone[:-1] > 0.5]) > 0.4, "one loss seldom comes alone"


@pytest.mark.parametrize("lean_s", [4.0, 12.0])
def test_a_weak_spring_leans_a_coupling_on_one_flank(lean_s):
    angle = 10.0 * np.sin(np.arange(8000) * 0.0157)
    place = leaning(angle, 1.0, np.exp(-PERIOD_S / lean_s))
    assert np.abs(angle - place).max() <= 1.0 + 1e-12
    assert np.ptp(place) == pytest.approx(18.0, abs=0.4)
    assert leaning(np.zeros(20_000), 1.0, np.exp(-PERIOD_S / lean_s))[-1] == pytest.approx(1.0, abs=0.01)


def test_static_lines_are_zero_at_zero_and_as_large_as_said():
    physics = Physics(track_1_deg=0.3, track_1_rad=1.0, track_2_deg=0.1, track_2_rad=2.0)
    assert track(np.array([0.0]), physics) == pytest.approx([0.0])
    assert np.abs(track(T, physics) - T).max() < 0.8
    for at in (-12.0, 0.0, 7.0):
        shape = kinked(np.array([-40.0, -1e-4, 0.0, 1e-4, 40.0]), at)
        assert np.abs(shape[[0, -1]]).max() == pytest.approx(1.0)
        assert shape[1:4] == pytest.approx(0.0, abs=1e-6)


def test_excitation_warms_up_and_wanders():
    random = np.random.default_rng(3)
    warm = excited(T, ReadingLaw(gain=-0.1, gain_warms_s=3.0), PERIOD_S, random)
    assert warm[0] == pytest.approx(0.92)
    assert warm[-1] == pytest.approx(0.9, abs=1e-3)
    long = excited(np.arange(200_000) * PERIOD_S, ReadingLaw(wander=0.05, wander_s=2.0), PERIOD_S, random)
    assert np.std(long) == pytest.approx(0.05, rel=0.15)
    assert np.all(excited(T, ReadingLaw(), PERIOD_S, random) == 1.0)


def test_a_follower_is_slower_one_way():
    up, down = (followed(way * np.where(T < 0.1, 0.0, 1.0), 0.1, 0.3) for way in (1.0, -1.0))
    assert np.argmax(up > 0.5) > np.argmax(down < -0.5)
    assert up[-1] == pytest.approx(1.0)


def test_sizes_of_what_is_added_to_the_angle_are_those_that_are_said():
    random, moving = np.random.default_rng(2), 20.0 * np.sin(np.arange(40_000) * 0.003)
    there = grain(moving, 0.5, np.random.default_rng(1))
    assert np.std(there) == pytest.approx(0.5, rel=0.15)
    assert np.array_equal(there, grain(moving, 0.5, np.random.default_rng(1)))
    noise = added(moving, ReadingLaw(noise_deg=1.0, noise_grain=0.4), PERIOD_S, random)
    assert np.std(noise) == pytest.approx(1.0, rel=0.1)
    t = np.arange(40_000) * PERIOD_S
    assert np.std(motor_hum(t, ReadingLaw(hum_deg=0.5), random)) == pytest.approx(0.5, rel=0.05)
    drift = added(moving, ReadingLaw(drift_deg_min=6.0), PERIOD_S, random)
    assert drift[-1] == pytest.approx(6.0 * t[-1] / 60.0)
    assert drift[10_000] == pytest.approx(0.5 * drift[-1], rel=1e-3)
    ramps = np.array([0.2 + 0.1 * t, 0.2 - 0.1 * t])
    assert picked_up(ramps, 2.0, PERIOD_S) == pytest.approx(0.2 * 1.7)


def test_a_wound_track_has_steps_and_half_steps_and_a_lifted_wiper_goes_to_an_end():
    fine = np.linspace(-5.0, 5.0, 20_001)
    read = coded(fine, ReadingLaw(step_deg=1.0, step_bridge=0.2))
    assert set(np.round(2.0 * read)) == set(range(-10, 11))
    assert np.mean(read % 1.0 == 0.5) == pytest.approx(0.2, abs=0.01)
    assert np.abs(read - fine).max() <= 0.51
    assert np.abs(coded(fine, ReadingLaw()) - fine).max() <= 0.5 * CODE_DEG + 1e-12
    law = ReadingLaw(dropout=0.05, dropout_longest=3.0)
    off = lifted_off(np.zeros(100_000), law, np.random.default_rng(6))
    assert set(off) == {-172.5, 0.0, 172.5}
    assert np.mean(off != 0.0) == pytest.approx(0.05, abs=0.006)


def test_monitors_are_late_by_their_filter_and_the_second_is_later():
    ramp, means = np.linspace(0.0, 20.0, 4000), []
    for later_s in (0.0, SECOND_LATER_S):
        read = monitor_reading(ramp, 0.0, 1.0, later_s, PERIOD_S, np.random.default_rng(3))
        means.append(np.mean((ramp - read)[500:-500]) / (ramp[1] - ramp[0]) * PERIOD_S)
        assert 0.0004 < np.std((ramp - read)[500:]) < 0.0008
    assert means[0] - means[1] == pytest.approx(SECOND_LATER_S, rel=1e-2)
    assert means[0] == pytest.approx(PERIOD_S / np.expm1(PERIOD_S / 0.004), abs=5e-5)


@pytest.fixture(scope="module")
def healthy():
    rig = unit("diaphragm", 3)
    return rig, run(SHORT, rig, rig.still())


@pytest.mark.parametrize("effect", sorted(set(family("diaphragm").laws) - {"valve_slew"}))
def test_an_effect_of_no_size_leaves_the_rig_as_it_was_bit_for_bit(healthy, effect):
    """Limits lie far away instead; a jet, however wide, is one more restriction."""
    rig, record = healthy
    size = {"pressure_ceiling": 9.0, "end_stop": 80.0}.get(effect, 0.0)
    none = family("diaphragm").laws[effect].law(size, np.random.default_rng(0))
    again = run(SHORT, rig, rig.still(), none)
    assert all(np.array_equal(record[name], again[name]) for name in record)


def changed(healthy, column, **sizes):
    rig, record = healthy
    return run(SHORT, rig, rig.still(), disturbance("diaphragm", sizes))[column][100:] - record[column][100:]


@pytest.mark.parametrize(("effect", "column", "size"), [
    ("valve_gain", "p1_mpa", 0.1), ("co_contraction", "p2_mpa", 0.03), ("muscle_mismatch", "angle_deg", 0.1),
    ("sensor_offset", "angle_deg", 2.0), ("sensor_drift", "angle_deg", 10.0),
])  # fmt: skip
def test_signed_effects_move_what_they_act_on_their_way(healthy, effect, column, size):
    ways = [float(np.mean(changed(healthy, column, **{effect: way * size}))) for way in (1.0, -1.0)]
    assert ways[0] > 0.0 > ways[1]


@pytest.mark.parametrize("effect", ["coulomb_friction", "viscous_friction", "end_stop"])
def test_what_holds_the_joint_makes_its_way_shorter(healthy, effect):
    rig, record = healthy
    size = {"coulomb_friction": 1.0, "viscous_friction": 3.0, "end_stop": 20.0}[effect]
    angle = run(SHORT, rig, rig.still(), disturbance("diaphragm", {effect: size}))["angle_deg"]
    assert np.ptp(angle) < np.ptp(record["angle_deg"]) - 0.3


def test_more_cylinders_on_a_stronger_spring_leave_less_to_friction(healthy):
    rig, record = healthy
    ways = [
        np.ptp(run(SHORT, rig, rig.still(), disturbance("diaphragm", {"stiffness": size}))["angle_deg"])
        for size in (-0.3, 0.3, 0.6)
    ]
    assert ways[0] < np.ptp(record["angle_deg"]) < ways[1] < ways[2]


@pytest.mark.parametrize(("effect", "sizes"), [
    ("valve_lag", (0.02, 0.06, 0.2)), ("delay", (0.01, 0.04, 0.1)), ("pitot_tap", (0.05, 0.2, 1.0)),
])  # fmt: skip
def test_what_makes_pressures_late_makes_them_later_with_its_size(healthy, effect, sizes):
    rig, record = healthy
    command = record["dp_cmd_mpa"]

    def late(columns) -> int:
        dp = columns["p1_mpa"] - columns["p2_mpa"]
        return int(np.argmax([np.dot(command[: 1000 - k], dp[k:1000]) for k in range(80)]))

    lags = [late(run(SHORT, rig, rig.still(), disturbance("diaphragm", {effect: size}))) for size in sizes]
    assert late(record) < lags[0] + 1 <= lags[1] < lags[2] + 1


def test_limits_and_leaks_show_in_the_pressures(healthy):
    rig, record = healthy
    held = run(SHORT, rig, rig.still(), disturbance("diaphragm", {"pressure_ceiling": 0.24}))
    assert max(held["p1_mpa"].max(), held["p2_mpa"].max()) < 0.25 < record["p1_mpa"].max()
    slow = run(SHORT, rig, rig.still(), disturbance("diaphragm", {"valve_slew": 0.1}))
    assert np.ptp(slow["p1_mpa"]) < 0.6 * np.ptp(record["p1_mpa"])
    for size in (0.5, 1.5):
        weeping = disturbance("diaphragm", {"weeping_pilot": size})
        one = "p1_mpa" if weeping.rig.weep_1_mpa_s > 0.0 else "p2_mpa"
        assert np.mean(run(SHORT, rig, rig.still(), weeping)[one] - record[one]) > 0.005 * size
    assert HEALTHY.timing == TimingLaw()


def test_a_healthy_unit_is_a_plausible_rig():
    """+-0.1 MPa turn it by some 15 to 22 degrees; half of the loop's width at a slow sine is 3 to 12 % of the way."""
    for seed in range(2):
        rig = unit("diaphragm", seed)
        small = run(Excitation("sine", 0.3, 0.1), rig, rig.still())["angle_deg"]
        assert 14.0 < 0.5 * np.ptp(small) < 24.0
        slow = run(Excitation("sine", 0.1, 0.2), rig, rig.still())
        near, rising = np.abs(slow["dp_cmd_mpa"]) < 0.02, np.gradient(slow["dp_cmd_mpa"]) > 0.0
        width = slow["angle_deg"][near & ~rising].mean() - slow["angle_deg"][near & rising].mean()
        assert 0.06 < width / (0.5 * np.ptp(slow["angle_deg"])) < 0.24
