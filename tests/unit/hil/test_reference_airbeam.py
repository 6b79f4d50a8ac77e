"""The parts of the seventh family of physics plants, each against its own law."""

import itertools
import math

import numpy as np
import pytest

from hil.reference.airbeam.beams import (
    CREASE_STATES,
    beam_torque,
    beam_volume,
    cylinder,
    fold_on,
    held,
    hoof_slope,
    hoofs,
    shake_out,
    turned,
)
from hil.reference.airbeam.disturbance import HEALTHY
from hil.reference.airbeam.line import (
    INTO_BEAM,
    LINE_STATES,
    TO_BEAM,
    TO_VALVE,
    admittance,
    arriving,
    impedance_s,
    send,
    still,
)
from hil.reference.airbeam.mechanics import (
    ANGLE,
    BRISTLE,
    CREEP_RAD,
    CREEPERS,
    CREPT,
    FIRMER,
    RESTED,
    SPEED,
    STATES,
    beams_stiffness,
    bearing_torque,
    block_torque,
    catch_torque,
    creep_torque,
    hung,
    load_torque,
    oil_drag,
    step_joint,
)
from hil.reference.airbeam.physics import ATMOSPHERE_MPA, Physics
from hil.reference.airbeam.pneumatics import CRITICAL, filled, metered, slot, step_air, step_felt
from hil.reference.airbeam.regulator import (
    AIR,
    BUS_S,
    COMMAND,
    DATA_MPA_S,
    FABRIC,
    INTEGRAL,
    MASS,
    MEAN_EVERY,
    SENSED,
    SPOOL,
    TRACK_S,
    VALVE_STATES,
    balanced,
    by_sensor,
    program_mean,
    step_coil,
    step_program,
)

RIG = HEALTHY.rig


@pytest.mark.parametrize("fold", [0.2, 0.6, 1.2, 2.0])
def test_a_beam_unfolds_by_the_work_of_its_air(fold):
    """Virtual work: the torque is what the volume, integrated over the pressure, gains per fold given up."""
    physics, p, step = Physics(), 0.25, 1e-4
    there = (cylinder(physics) - hoofs(physics.fold_rad, 0.0, physics)) / (1.0 - physics.dead_share)

    def work(at: float) -> float:
        pressures = np.linspace(0.0, p, 401)
        return float(np.trapezoid([there * beam_volume(float(x), at, 0.0, physics)[0] for x in pressures], pressures))

    by_work = 1e6 * (work(fold - step) - work(fold + step)) / (2.0 * step)
    assert beam_torque(p, fold, 0.0, physics) == pytest.approx(by_work, rel=1e-4)
    high, low = (beam_volume(p, fold + off, 0.0, physics)[0] for off in (step, -step))
    assert beam_volume(p, fold, 0.0, physics)[1] == pytest.approx((high - low) / (2.0 * step), rel=1e-5)


def test_what_a_folded_beam_is_short_of_is_two_hoofs_of_a_cylinder():
    physics, fold = Physics(round_rad=1e-6), 1.1
    x = np.linspace(-physics.radius_m, physics.radius_m, 200_001)
    width = 2.0 * np.sqrt(np.maximum(0.0, physics.radius_m**2 - x**2))
    hoof = np.trapezoid((physics.pivot_m + x) * math.tan(0.5 * fold) * width, x)
    assert hoofs(fold, 0.0, physics) == pytest.approx(2.0 * hoof, rel=1e-5)
    assert hoofs(fold, 0.1, physics) == pytest.approx(2.2 * hoof, rel=1e-5)


def test_a_beam_on_its_hinge_that_has_just_kinked_holds_the_moment_of_collapse():
    physics = Physics(stretch_per_mpa=1e-6, round_rad=1e-4, pivot_m=0.018)
    assert beam_torque(0.2, 0.01, 0.0, physics) == pytest.approx(1e6 * math.pi * 0.2 * 0.018**3, rel=1e-3)
    real = Physics()
    assert beam_torque(0.2, 0.0, 0.0, real) == beam_torque(-0.1, 1.0, 0.0, real) == 0.0
    torques = [beam_torque(0.2, fold, 0.0, real) for fold in np.linspace(0.1, 2.2, 22)]
    assert np.all(np.diff(torques) > 0.0)
    assert beam_torque(0.4, 1.0, 0.0, real) > 2.0 * beam_torque(0.2, 1.0, 0.0, real), "its fabric stretches"
    assert hoof_slope(-0.5, 0.0, real) == -hoof_slope(0.5, 0.0, real)


def folded(path, state, physics, beam=0):
    rows = []
    for before, now in itertools.pairwise(path):
        fold_on(float(before), float(now), 0, state, physics)
        rows.append(held(float(now), beam, 0, state, physics))
    return np.array(rows)


@pytest.mark.parametrize("beam", [0, 1])
def test_a_crease_resists_on_both_ways_closes_its_loops_and_forgets_them(beam):
    physics, state = Physics(), np.zeros(CREASE_STATES)
    shake_out(0.0, 0, state, physics)
    middle = physics.crease_at_rad * (1.0 - 2.0 * beam)
    assert held(0.0, beam, 0, state, physics) == pytest.approx(-held(0.0, 1 - beam, 0, state, physics), abs=0.01)
    up, down = np.linspace(-3.0, 3.0, 601), np.linspace(3.0, -3.0, 601)
    folded(np.linspace(0.0, -3.0, 301), state, physics)
    rising, falling = (folded(path, state, physics, beam) for path in (up, down))
    share = np.array([turned(float(x), middle, physics) for x in up[1:]])
    assert rising == pytest.approx(share * (1.0 - share), abs=2e-3)
    assert falling[::-1][1:] == pytest.approx(-rising[:-1], abs=2e-3)
    inner = folded(
        [*np.linspace(-3.0, 0.4, 341), *np.linspace(0.4, 0.1, 31), *np.linspace(0.1, 0.4, 31)], state, physics
    )
    assert inner[-1] == pytest.approx(inner[339]), "a small loop closes where it began"
    again = folded([*np.linspace(0.4, 3.0, 261)], state, physics, beam)
    assert again[-1] == pytest.approx(rising[-1], abs=1e-9), "and leaves no trace on the large one"


def test_a_crease_only_takes_work():
    physics, state, random = Physics(), np.zeros(CREASE_STATES), np.random.default_rng(3)
    shake_out(0.0, 0, state, physics)
    path = np.cumsum(np.concatenate([np.full(40, 0.01) * way for way in random.choice((-1.0, 1.0), 60)]))
    path = np.concatenate([[0.0], 0.6 * np.sin(path), [0.0]])
    torque = folded(path, state, physics)
    done = np.cumsum(torque * np.diff(path))
    assert done[-1] > 0.02
    loop = np.concatenate([np.linspace(0.0, 0.2, 101), np.linspace(0.2, -0.2, 201), np.linspace(-0.2, 0.0, 101)])
    folded(loop, state, physics)
    closed = folded(loop, state, physics)
    assert float(np.sum(closed * np.diff(loop))) > 0.0, "no closed loop gives any back"


def test_more_turning_points_than_are_kept_forget_the_smallest_loop():
    physics, state = Physics(), np.zeros(CREASE_STATES)
    shake_out(0.0, 0, state, physics)
    ends = [0.5 * 0.9**k * (-1) ** k for k in range(60)]
    rows = folded([0.0, *ends], state, physics)
    assert np.all(np.isfinite(rows))
    assert np.all(np.abs(rows) <= 0.26)


def test_a_wave_arrives_when_sound_does_and_as_high_as_the_impedance_says():
    physics, state, step_s = Physics(), np.zeros(LINE_STATES), 1e-4
    still(0.3, 0, state)
    assert impedance_s(physics) == pytest.approx(physics.line_s / physics.line_share)
    seen = []
    for _ in range(120):
        seen.append(arriving(TO_BEAM, 0, state, physics, step_s))
        send(1.0, 0.0, 0, state, physics, step_s)
    begun = int(np.argmax(np.array(seen) > 0.3 + impedance_s(physics)))
    assert begun * step_s == pytest.approx(physics.line_s, abs=1.5 * step_s)
    assert seen[begun + 2] == pytest.approx(0.3 + 2.0 * impedance_s(physics))


@pytest.mark.parametrize("step_s", [5e-4, 2.3e-4])
def test_a_line_holds_what_flows_into_it_and_resists_by_blasius(step_s):
    physics, state = Physics(), np.zeros(LINE_STATES)
    still(0.3, 0, state)
    for _ in range(round(0.1 / step_s)):
        send(0.5, 0.0, 0, state, physics, step_s)
    waves = [arriving(way, 0, state, physics, step_s) for way in (TO_BEAM, TO_VALVE)]
    assert np.mean(waves) == pytest.approx(0.3 + 0.5 * 0.1 / physics.line_share, rel=0.05)
    lost = [1.0 / admittance(flow, physics) - impedance_s(physics) for flow in (1.0, 2.0)]
    assert lost[1] / lost[0] == pytest.approx(2.0**0.75, rel=1e-3)
    assert lost[0] == pytest.approx(0.5 * physics.line_drag, rel=1e-3)
    assert state[INTO_BEAM] == 0.0


def test_a_port_is_choked_laminar_near_equal_pressures_and_narrower_when_hardly_open():
    assert metered(1.0, 1.0) == metered(1.3, 0.5) == 0.0
    assert metered(0.2, 1.0) == pytest.approx(1.0, abs=1e-4)
    assert pytest.approx(metered(CRITICAL, 1.0), abs=1e-4) == metered(0.1, 1.0)
    flows = [metered(float(ratio), 0.5) for ratio in np.linspace(CRITICAL, 1.0, 60)]
    assert np.all(np.diff(flows) < 0.0)
    assert metered(0.99998, 0.3) == pytest.approx(2.0 * metered(0.99999, 0.3), rel=0.01), "laminar"
    assert metered(0.9, 0.001) < 0.2 * metered(0.9, 1.0)
    openings = [slot(float(travel)) for travel in np.linspace(0.0, 1.0, 50)]
    assert (openings[0], openings[-1]) == (0.0, pytest.approx(1.0))
    assert np.all(np.diff(openings) > 0.0)


def test_a_felt_lets_through_by_the_difference_of_the_squares():
    state = np.array([0.1013])
    for _ in range(4000):
        step_felt(0.8, 0, 5.0, 0.1013, 1.0, state, 5e-4)
    assert state[0] ** 2 - 0.1013**2 == pytest.approx(5.0 * 0.02 * 0.8, rel=1e-3)
    state[0] = 0.62
    for _ in range(4000):
        step_felt(0.8, 0, 5.0, 0.62, -1.0, state, 5e-4)
    assert 0.62**2 - state[0] ** 2 == pytest.approx(5.0 * 0.02 * 0.8, rel=1e-3)


@pytest.mark.parametrize(("walls_s", "power"), [(1e9, 1.4), (1e-4, 1.0)])
def test_air_is_compressed_without_heat_when_quick_and_without_warming_when_slow(walls_s, power):
    physics, state = Physics(walls_s=walls_s, stretch_per_mpa=1e-9), np.zeros(STATES)
    state[AIR] = state[MASS] = 0.3
    state[FABRIC] = 1.0
    for volume in np.linspace(1.0, 0.8, 40_001)[1:]:
        step_air(0.0, 0.0, volume, -0.2, state, 0, physics, 1.0 / 40_000)
        if power == 1.0:
            state[FABRIC] = 1.0
    assert state[AIR] * 0.8**power == pytest.approx(0.3, rel=4e-3)
    assert state[MASS] == 0.3


def test_fabric_that_stretches_takes_more_air_for_the_same_pressure():
    taken = []
    for stretch in (1e-9, 0.15):
        physics, state = Physics(stretch_per_mpa=stretch, walls_s=1e-3), np.zeros(STATES)
        filled(0.1, beam_volume(0.1, 1.17, 0.0, physics)[0], 0, state, physics)
        before = state[MASS]
        for _ in range(4000):
            volume = beam_volume(state[AIR] - ATMOSPHERE_MPA, 1.17, 0.0, physics)[0]
            step_air(0.1, 0.0, volume, 0.0, state, 0, physics, 5e-4)
        assert state[MASS] - before == pytest.approx(0.2)
        assert state[AIR] * volume / state[MASS] == pytest.approx(1.0, abs=0.06), "it stays an ideal gas"
        taken.append(state[AIR])
    assert taken[1] < 0.98 * taken[0]


@pytest.mark.parametrize("delay_s", [0.001, 0.013, 0.05, 0.3])
def test_a_mean_of_set_points_is_late_by_what_is_said(delay_s):
    state = np.zeros(2 * VALVE_STATES)
    ramp = [program_mean(k * BUS_S, 0, state, delay_s) for k in range(3 * 176 * MEAN_EVERY)]
    late = np.arange(len(ramp)) * BUS_S - np.array(ramp)
    assert np.mean(late[-200:]) == pytest.approx(delay_s, abs=0.6 * MEAN_EVERY * BUS_S)


def test_an_integral_is_tracked_back_from_what_is_saturated():
    physics, state = Physics(), np.zeros(2 * VALVE_STATES)
    balanced(0.1, 0, state, physics)
    start = state[INTEGRAL]
    for _ in range(2000):
        step_program(0.45, 0, state, physics, RIG)
    asked = physics.gain_per_s * (physics.weight * 0.45 - 0.1) + state[INTEGRAL]
    assert state[COMMAND] == pytest.approx(1.0, abs=0.01)
    assert asked - DATA_MPA_S == pytest.approx(physics.gain_per_s * 0.35 * TRACK_S / physics.integral_s, rel=1e-3)
    state[SENSED] = 0.45
    step_program(0.45, 0, state, physics, RIG)
    step_program(0.45, 0, state, physics, RIG)
    assert state[COMMAND] < 0.9, "it closes at once, although it was saturated for seconds"
    assert state[INTEGRAL] != start


def test_a_spool_goes_where_it_is_told_and_a_sensor_sends_by_exception():
    physics, state = Physics(), np.zeros(2 * VALVE_STATES)
    for command in (0.3, -0.7):
        state[COMMAND] = command
        way = np.array([(step_coil(0, state, physics, 5e-4), state[SPOOL])[1] for _ in range(400)])
        assert way[-1] == pytest.approx(command, abs=1e-3)
        assert np.argmax(np.abs(way - way[-1]) < 0.1) < 40, "within 20 ms"
    numb = RIG._replace(exception_mpa=0.02)
    sent = []
    for p in np.linspace(0.1, 0.2, 1001):
        state[SENSED] = p
        sent.append(by_sensor(0, state, numb))
    assert len(set(sent)) <= 6
    assert np.max(np.abs(np.array(sent[300:]) - np.linspace(0.1, 0.2, 1001)[300:])) <= 0.0201
    assert by_sensor(0, state, RIG) == 0.2
    assert by_sensor(0, state, RIG._replace(offset_1_mpa=0.01, gain_1=0.25)) == pytest.approx(0.2 / 1.25 - 0.01)


def test_a_bearing_is_a_spring_that_holds_the_firmer_the_longer_it_rested():
    def torn_off(rest_s: float) -> float:
        state, step_s = np.zeros(STATES), 1e-4
        for _ in range(round(rest_s / step_s)):
            bearing_torque(1.0, 0.006, state, step_s)
        state[SPEED] = 0.5
        rows = [-bearing_torque(1.0, 0.0, state, step_s) for _ in range(4000)]
        assert rows[-1] == pytest.approx(1.0, abs=1e-3), "sliding it holds its level"
        assert rows[10] == pytest.approx(0.5 * 11 * step_s / 0.006 * (1.0 + FIRMER * state_after(rest_s, 11)), rel=0.02)
        return max(rows)

    def state_after(rest_s: float, more: int) -> float:
        return 1.0 - math.exp(-(rest_s + more * 1e-4) / 0.12)

    peaks = [torn_off(rest_s) for rest_s in (0.0, 0.05, 0.2, 2.0)]
    assert np.all(np.diff(peaks) > 0.0)
    assert peaks[-1] == pytest.approx(1.0 + FIRMER, rel=0.02)
    state = np.zeros(STATES)
    assert bearing_torque(0.0, 0.006, state, 1e-4) == state[BRISTLE] == state[RESTED] == 0.0


def test_what_creeps_keeps_its_threshold_for_ever():
    physics, state = Physics(), np.zeros(STATES)
    state[ANGLE] = 0.5
    torque = [creep_torque(state, physics, RIG, 0.05) for _ in range(40_000)]
    each = physics.creep * beams_stiffness(physics) / CREEPERS
    assert torque[0] == pytest.approx(-each * CREEPERS * 0.5)
    assert np.all(np.diff(torque) >= 0.0), "it gives way and never back"
    assert torque[-1] == pytest.approx(-each * sum(CREEP_RAD), rel=1e-3)
    assert state[ANGLE] - state[CREPT] == pytest.approx(CREEP_RAD[0])


def test_a_carriage_on_a_crank_keeps_its_energy():
    still_rig = Physics(bush_nm_rad=0.0, creep=0.0, bearing_nm=0.0, drag_nm_s=0.0, crease_nm=0.0, crease_nm_mpa=0.0)
    state, step_s = np.zeros(STATES), 1e-4
    for beam in range(2):
        state[beam * VALVE_STATES + AIR] = ATMOSPHERE_MPA
    hung(state, still_rig)
    state[SPEED] = 1.0

    def energy() -> float:
        inertia = still_rig.inertia_kgm2 + still_rig.carriage_kgm2 * math.cos(state[ANGLE]) ** 2
        return 0.5 * inertia * state[SPEED] ** 2

    before = energy()
    for _ in range(10_000):
        step_joint(0.0, 0.0, state, still_rig, RIG, step_s)
    assert state[ANGLE] > 0.9
    assert state[SPEED] > 1.05, "faster where the carriage hardly moves"
    assert energy() == pytest.approx(before, rel=2e-3)


def test_loads_and_stops_of_the_joint():
    stop = RIG._replace(stop_high_rad=0.4)
    assert block_torque(0.3, 1.0, stop) == block_torque(0.41, -5.0, stop) == 0.0, "it only pushes"
    pushes = [-block_torque(0.4 + over, 0.0, stop) for over in (0.01, 0.02, 0.1)]
    assert pushes[1] > 2.0 * pushes[0]
    assert pushes[2] > 10.0 * pushes[0], "ever stiffer"
    assert block_torque(-0.45, 0.0, RIG._replace(stop_low_rad=-0.4)) > 0.0
    catch = RIG._replace(catch_nm=1.0, catch_rad=0.2)
    pulls = [catch_torque(float(angle), catch) for angle in np.linspace(-1.0, 1.4, 2401)]
    assert max(pulls) == pytest.approx(1.0, rel=1e-3)
    assert catch_torque(0.2, catch) == 0.0
    load = RIG._replace(load_nm=1.0)
    assert load_torque(0.5, load) < -math.sin(0.5), "a leaf that bends lets the weight further out"
    warm = np.zeros(STATES)
    warm[SPEED] = 3.0
    drags = [oil_drag(warm, RIG._replace(oil_nm_s=1.0), 5e-4) for _ in range(20_000)]
    assert (drags[0], oil_drag(warm, RIG, 5e-4)) == (1.0, 0.0)
    assert drags[-1] < 0.6
