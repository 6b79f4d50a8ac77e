"""What happens to set-points and readings of the ninth family of physics plants, and what its effects do."""

import numpy as np
import pytest

from hil.reference.excitations import Excitation
from hil.reference.families import disturbance, family, run, unit
from hil.reference.pouch.disturbance import HEALTHY, ReadingLaw, TimingLaw
from hil.reference.pouch.physics import Physics
from hil.reference.pouch.sensing import (
    CODE_DEG,
    SWINGS_MPA,
    added,
    askew,
    coded,
    detector,
    diffused,
    drawn_by_lamp,
    greased,
    interrupted,
    monitor_reading,
    ranged,
    shimmer,
    slowly,
)
from hil.reference.pouch.timing import WRITE_S, arrivals_s, chances, heard, lost, set_anew_s, set_points, stamped

PERIOD_S = 0.005
SHORT = Excitation("sine", 0.5, 0.2, seconds=6.0)
T = np.arange(4000) * PERIOD_S


def test_waits_keep_the_order_go_on_and_are_in_the_mean_as_said():
    arrival = arrivals_s(4000, PERIOD_S, TimingLaw(delay_s=0.03, delay_goes_on_s=0.1), np.random.default_rng(4))
    waits = arrival - T
    assert np.all(np.diff(arrival) >= -1e-12)
    assert np.mean(waits) == pytest.approx(0.03 + WRITE_S)
    assert np.std(waits) > 2e-3
    assert np.corrcoef(waits[:-4], waits[4:])[0, 1] > 0.7, "a long one goes on for a while"
    assert arrivals_s(9, PERIOD_S, TimingLaw(), np.random.default_rng(1)) == pytest.approx(T[:9] + WRITE_S)


def test_regulators_hear_in_turns():
    first, second = (heard(40, PERIOD_S, 0.05, turn) for turn in (0, 1))
    assert list(first[:12]) == [*range(10), 9, 9]
    assert list(second[:12]) == [0] * 10 + [10, 11]
    assert list(first[20:25]) == [20, 21, 22, 23, 24]
    ramp = 0.2 + 0.001 * T
    law = TimingLaw(turns_s=0.1)
    p1, p2 = set_points(ramp, ramp, 10, PERIOD_S, law, np.random.default_rng(1))
    assert np.mean(np.abs(p1 - p2)) > 2e-5
    assert np.mean(p1) == pytest.approx(np.mean(ramp), abs=3e-4)


def test_a_clock_is_set_anew_and_losses_are_where_much_changes():
    ahead = set_anew_s(T, 3.0, np.random.default_rng(2))
    assert (ahead[0], ahead[-1]) == (0.0, pytest.approx(T[-1]))
    assert np.all(np.diff(ahead) > 0.0)
    rates = np.round(np.diff(ahead) / PERIOD_S, 6)
    assert 3 < len(set(rates)) < 40, "pieces of one rate each"
    shown = stamped(np.array([T]), PERIOD_S, TimingLaw(clock_rate=-0.01, clock_set_s=2.5))[0]
    assert shown[-2] - T[-2] == pytest.approx(-0.01 * T[-1], rel=0.03)
    angle = np.where(T < 10.0, 0.0, 20.0 * np.sin(T))
    chance = chances(angle, 0.3, 0.8)
    assert np.mean(chance) == pytest.approx(0.3, rel=1e-3)
    assert np.mean(chance[2200:]) > 4.0 * np.mean(chance[:1900])
    assert np.mean(chances(angle, 0.85, 0.3)) == pytest.approx(0.85, rel=1e-3)
    moving = np.array([T, T, 20.0 * np.sin(T)])
    read = lost(moving.copy(), TimingLaw(lost_share=0.4, lost_busy=0.6, lost_all=1.0), np.random.default_rng(3))
    assert np.mean(np.diff(read[0]) == 0.0) == pytest.approx(0.4, abs=0.03)
    alone = lost(moving.copy(), TimingLaw(lost_share=0.4), np.random.default_rng(3))
    assert np.array_equal(alone[0], T)


@pytest.mark.parametrize("drag", [0.05, 0.35])
def test_grease_takes_a_pin_along_in_its_clearance(drag):
    angle = 10.0 * np.sin(np.arange(8000) * 0.0157)
    place = greased(angle, 1.0, drag)
    assert np.abs(angle - place).max() <= 1.0 + 1e-12
    assert np.ptp(place[2000:]) == pytest.approx(18.0, abs=0.05)
    little = greased(10.0 + 0.2 * np.sin(np.arange(2000) * 0.02), 1.0, drag)
    assert np.ptp(little) == pytest.approx(0.4 * drag, rel=0.01)


def test_static_lines_are_zero_at_zero_and_as_large_as_said():
    physics = Physics(bow_deg=0.3, tilt_deg=-0.2)
    assert detector(np.array([0.0]), physics) == pytest.approx([0.0])
    assert detector(np.array([-40.0, 40.0]), physics) == pytest.approx([-40.2, 39.8])
    for tilt in (-0.5, 0.0, 0.4):
        shape = askew(np.array([-40.0, -1e-3, 0.0, 1e-3, 40.0]), tilt)
        assert np.abs(shape[[0, -1]]).max() == pytest.approx(1.0)
        assert shape[1:4] == pytest.approx(0.0, abs=1e-6)
    far = ranged(np.array([0.0, 14.0, 16.0, 14.0, 12.9, 14.0, -16.0]), 0.1, 15.0)
    assert far == pytest.approx([0.0, 14.0, 17.6, 15.4, 12.9, 14.0, -17.6]), "it goes back a little nearer"


@pytest.mark.parametrize("tail", [0.2, 0.5])
def test_diffusing_carriers_are_late_in_the_mean_as_said(tail):
    ramp = diffused(T, 0.08, tail, PERIOD_S)
    assert T[-1] - ramp[-1] == pytest.approx(0.08, abs=0.5 * PERIOD_S)
    step = diffused(np.where(T < 0.1, 0.0, 1.0), 0.08, tail, PERIOD_S)
    assert step[-1] == pytest.approx(1.0)
    half = PERIOD_S * (np.argmax(step > 0.5) - 20)
    assert half < 0.04, "most are quick"
    assert step[20 + round(0.16 / PERIOD_S)] < 0.99, "the tail is long"


def test_sizes_of_what_is_added_to_the_angle_are_those_that_are_said():
    random, moving = np.random.default_rng(2), 20.0 * np.sin(np.arange(40_000) * 0.003)
    t = np.arange(40_000) * PERIOD_S
    air = shimmer(200_000, 0.5, PERIOD_S, random)
    assert np.std(air) == pytest.approx(0.5, rel=0.1)
    lines = np.abs(np.fft.rfft(air)) ** 2
    assert np.mean(lines[200:400]) > 20.0 * np.mean(lines[-40_000:]), "louder where it is slow"
    noise = added(moving, ReadingLaw(noise_deg=1.0, noise_shimmer=0.4), PERIOD_S, random)
    assert np.std(noise) == pytest.approx(1.0, rel=0.1)
    lamp = ReadingLaw(hum_deg=0.5, hum_at_deg=60.0)
    assert np.std(drawn_by_lamp(np.zeros(40_000), t, lamp, random)) == pytest.approx(0.5, rel=0.02)
    near = np.std(drawn_by_lamp(np.full(40_000, 30.0), t, lamp, random))
    assert near == pytest.approx(0.25, rel=0.02), "less near the lamp"
    drift = added(moving, ReadingLaw(drift_deg_min=6.0), PERIOD_S, random)
    assert drift[-1] == pytest.approx(6.0 * t[-1] / 60.0)
    assert drift[4000] < 0.4 * 0.1 * drift[-1] < 0.1 * drift[-1]
    assert slowly(t)[20_000] == pytest.approx(0.5 * t[-1], rel=1e-3)
    assert np.all(added(moving, ReadingLaw(offset_deg=2.0), PERIOD_S, random) == 2.0)


def test_both_currents_are_coded_for_themselves_and_the_dark_reads_anything():
    fine = np.linspace(-5.0, 5.0, 20_001)
    read = coded(fine, ReadingLaw(step_deg=1.0, step_apart=0.2))
    assert set(np.diff(np.unique(read))) == {1.0}
    widths = [int(np.sum(read == level)) for level in np.unique(read)[2:-2]]
    assert min(widths) > 200
    assert max(widths) > 2 * min(widths), "wide codes and narrow ones in turns"
    assert np.abs(read - fine).max() <= 1.01
    assert np.abs(coded(fine, ReadingLaw()) - fine).max() <= 0.5 * CODE_DEG + 1e-12
    law = ReadingLaw(dropout=0.05, dropout_run=3.0)
    off = interrupted(np.full(100_000, 99.0), law, np.random.default_rng(6))
    gone = off[off != 99.0]
    assert len(gone) / 1e5 == pytest.approx(0.05, abs=0.006)
    assert np.ptp(gone) > 130.0
    assert len(set(np.round(gone, 3))) > 0.9 * len(gone)


def test_monitors_count_whole_swings_and_lose_none():
    ramp = np.linspace(0.1, 0.3, 4000)
    read = monitor_reading(ramp, 0.0, 1.0, PERIOD_S, np.random.default_rng(3))
    assert np.allclose(read / SWINGS_MPA, np.round(read / SWINGS_MPA), atol=1e-6)
    slope = (ramp[1] - ramp[0]) / PERIOD_S
    assert np.mean(ramp - read) / slope == pytest.approx(0.5 * PERIOD_S, abs=2e-3), "late by half a period"
    assert 0.0003 < np.std(ramp - read) < 0.0008
    off = monitor_reading(np.full(40_000, 0.2), 0.001, 1.01, PERIOD_S, np.random.default_rng(4)) - 0.2
    assert np.mean(off) == pytest.approx(0.003, abs=5e-5)


@pytest.fixture(scope="module")
def healthy():
    rig = unit("pouch", 3)
    return rig, run(SHORT, rig, rig.still())


@pytest.mark.parametrize("effect", sorted(family("pouch").laws))
def test_an_effect_of_no_size_leaves_the_rig_as_it_was_bit_for_bit(healthy, effect):
    """Limits lie far away instead."""
    rig, record = healthy
    size = {"pressure_ceiling": 9.0, "end_stop": 80.0}.get(effect, 0.0)
    none = family("pouch").laws[effect].law(size, np.random.default_rng(0))
    again = run(SHORT, rig, rig.still(), none)
    assert all(np.array_equal(record[name], again[name]) for name in record)


def changed(healthy, column, **sizes):
    rig, record = healthy
    return run(SHORT, rig, rig.still(), disturbance("pouch", sizes))[column][100:] - record[column][100:]


@pytest.mark.parametrize(("effect", "column", "size"), [
    ("valve_gain", "p1_mpa", 0.1), ("co_contraction", "p2_mpa", 0.03), ("muscle_mismatch", "angle_deg", 0.1),
    ("sensor_offset", "angle_deg", 2.0), ("sensor_drift", "angle_deg", 10.0),
])  # fmt: skip
def test_signed_effects_move_what_they_act_on_their_way(healthy, effect, column, size):
    ways = [float(np.mean(changed(healthy, column, **{effect: way * size}))) for way in (1.0, -1.0)]
    assert ways[0] > 0.0 > ways[1]


@pytest.mark.parametrize("effect", [
    "sensor_offset", "sensor_gain", "sensor_nonlinearity", "backlash", "sensor_lag", "mains_hum", "switching_ranges",
    "bending_frame",
])  # fmt: skip
def test_what_is_wrong_with_the_sensor_leaves_the_pressures_as_they_were(healthy, effect):
    size = {"sensor_gain": 0.1, "switching_ranges": 0.1, "bending_frame": 20.0}.get(effect, 1.0)
    assert np.all(changed(healthy, "p1_mpa", **{effect: size}) == 0.0)
    assert (
        np.std(changed(healthy, "angle_deg", **{effect: size}))
        + abs(np.mean(changed(healthy, "angle_deg", **{effect: size})))
        > 0.2
    )


@pytest.mark.parametrize("effect", ["coulomb_friction", "viscous_friction", "end_stop"])
def test_what_holds_the_joint_makes_its_way_shorter(healthy, effect):
    rig, record = healthy
    size = {"coulomb_friction": 1.0, "viscous_friction": 3.0, "end_stop": 20.0}[effect]
    angle = run(SHORT, rig, rig.still(), disturbance("pouch", {effect: size}))["angle_deg"]
    assert np.ptp(angle) < np.ptp(record["angle_deg"]) - 0.3


def test_more_rows_on_stronger_cords_leave_less_to_friction(healthy):
    """Half of the loop's width at dp zero, over the way."""
    rig, _ = healthy

    def loop(size: float) -> float:
        wrong = disturbance("pouch", {"stiffness": size}) if size else None
        columns = run(Excitation("sine", 0.2, 0.2), rig, rig.still(), wrong)
        dp, angle = columns["p1_mpa"] - columns["p2_mpa"], columns["angle_deg"]
        rising = np.gradient(columns["dp_cmd_mpa"]) > 0.0
        width = angle[(np.abs(dp) < 0.02) & ~rising].mean() - angle[(np.abs(dp) < 0.02) & rising].mean()
        return float(width / np.ptp(angle))

    assert loop(-0.3) > loop(0.0) > loop(0.6)


@pytest.mark.parametrize(("effect", "sizes"), [
    ("valve_lag", (0.02, 0.06, 0.2)), ("delay", (0.01, 0.04, 0.1)), ("hearing_in_turns", (0.02, 0.08, 0.3)),
])  # fmt: skip
def test_what_makes_pressures_late_makes_them_later_with_its_size(healthy, effect, sizes):
    rig, record = healthy
    command = record["dp_cmd_mpa"]

    def late(columns) -> int:
        dp = columns["p1_mpa"] - columns["p2_mpa"]
        return int(np.argmax([np.dot(command[: 1000 - k], dp[k:1000]) for k in range(80)]))

    lags = [late(run(SHORT, rig, rig.still(), disturbance("pouch", {effect: size}))) for size in sizes]
    assert late(record) < lags[0] + 1 <= lags[1] < lags[2] + 1


def test_limits_and_leaks_show_in_the_pressures(healthy):
    rig, record = healthy
    held = run(SHORT, rig, rig.still(), disturbance("pouch", {"pressure_ceiling": 0.24}))
    assert max(held["p1_mpa"].max(), held["p2_mpa"].max()) < 0.25 < record["p1_mpa"].max()
    slow = run(SHORT, rig, rig.still(), disturbance("pouch", {"valve_slew": 0.1}))
    assert np.ptp(slow["p1_mpa"]) < 0.6 * np.ptp(record["p1_mpa"])
    sagging = run(SHORT, rig, rig.still(), disturbance("pouch", {"supply_droop": 2.0}))
    assert np.max(sagging["p1_mpa"]) < np.max(record["p1_mpa"]) - 0.005
    assert HEALTHY.timing == TimingLaw()


def test_a_film_in_the_sun_and_a_weld_that_peels_let_the_joint_go_its_way_bit_by_bit(healthy):
    rig, record = healthy
    for sizes in ({"thermal_drift": 0.4}, {"peeling_weld": 0.5}):
        wrong = disturbance("pouch", sizes)
        off = run(SHORT, rig, rig.still(), wrong)["angle_deg"] - record["angle_deg"]
        early, late = np.abs(np.mean(off[:200])), np.abs(np.mean(off[-200:]))
        assert late > early + 0.1


def test_a_healthy_unit_is_a_plausible_rig():
    """+-0.1 MPa turn it by some 15 to 18 degrees; half of the loop's width at a slow sine is 3 to 12 % of the way."""
    for seed in range(2):
        rig = unit("pouch", seed)
        small = run(Excitation("sine", 0.3, 0.1), rig, rig.still())["angle_deg"]
        assert 14.0 < 0.5 * np.ptp(small) < 20.0
        slow = run(Excitation("sine", 0.1, 0.2), rig, rig.still())
        near, rising = np.abs(slow["dp_cmd_mpa"]) < 0.02, np.gradient(slow["dp_cmd_mpa"]) > 0.0
        width = slow["angle_deg"][near & ~rising].mean() - slow["angle_deg"][near & rising].mean()
        assert 0.06 < width / (0.5 * np.ptp(slow["angle_deg"])) < 0.24
