"""Flows, air and regulators of the ninth family of physics plants, each against its own law."""

import math

import numpy as np
import pytest

from hil.reference.pouch.bank import (
    AIR,
    BEFORE,
    BEHIND,
    BUDGET,
    CODE,
    CODES,
    CYCLE_S,
    FEED,
    HEAT,
    LAGGED,
    LEFT,
    MASS,
    OUTLET,
    RANGE_MPA,
    SENSED,
    VENT,
    ZONE,
    balanced,
    by_sensor,
    filtered,
    folded,
    protected,
    stays_shut,
    step_program,
    step_valves,
    wandered,
)
from hil.reference.pouch.disturbance import HEALTHY
from hil.reference.pouch.integrate import rest, step
from hil.reference.pouch.mechanics import STATES, muscle_air, turn_to
from hil.reference.pouch.physics import ATMOSPHERE_MPA, Physics
from hil.reference.pouch.pneumatics import (
    CRITICAL,
    PIPE_MPA,
    RECEIVER,
    REFERENCE_MPA,
    SUPPLY,
    filled,
    slit_flow,
    step_air,
    step_pipes,
    step_regulator,
    step_supply,
    tube_flow,
    valve_flow,
)

RIG, STEP_S = HEALTHY.rig, 5e-4


def test_a_valve_is_choked_then_falls_by_iso_6358_and_shuts_at_its_cracking_pressure():
    assert valve_flow(0.6, 0.1) == valve_flow(0.6, 0.6 * CRITICAL) == 1.0
    flows = [valve_flow(0.5, float(p)) for p in np.linspace(0.12, 0.5, 80)]
    assert np.all(np.diff(flows) <= 0.0)
    assert flows[-1] == 0.0
    assert valve_flow(0.5, 0.4979) < 0.03
    assert valve_flow(0.5, 0.4985) == valve_flow(0.5, 0.6) == 0.0, "below the cracking pressure"
    off = (0.4 / 0.5 - CRITICAL) / (1.0 - 0.002 / 0.5 - CRITICAL)
    assert valve_flow(0.5, 0.4) == pytest.approx((1.0 - off**2) ** 0.48)


def test_a_tube_takes_by_the_power_seven_quarters_and_is_laminar_near_nothing():
    physics = Physics()
    flow = tube_flow(0.32, 0.30, physics)
    assert physics.tube_mpa * flow**1.75 == pytest.approx(0.02)
    assert tube_flow(0.30, 0.32, physics) == -flow
    assert tube_flow(0.3001, 0.3, physics) == pytest.approx(0.5 * tube_flow(0.3002, 0.3, physics))
    assert tube_flow(0.3, 0.3, physics) == 0.0


@pytest.mark.parametrize(("walls_s", "power"), [(1e9, 1.4), (1e-6, 1.0)])
def test_air_is_compressed_without_heat_when_quick_and_without_warming_when_slow(walls_s, power):
    physics, state = Physics(walls_s=walls_s), np.zeros(STATES)
    filled(0.2, 1.0, 0, state, physics, RIG)
    for room in np.linspace(1.0, 0.8, 2001)[1:]:
        step_air(0.0, 0.0, room, 0, state, physics, STEP_S)
    assert state[AIR] * 0.8**power == pytest.approx(0.2 + ATMOSPHERE_MPA, rel=1e-4)
    assert state[MASS] == pytest.approx(0.2 + ATMOSPHERE_MPA)


def test_air_that_is_let_into_a_vessel_brings_its_enthalpy_and_that_which_leaves_takes_its_own():
    """Without heat to the film: dp V = kappa times what comes in; what is left expands without heat."""
    physics, state = Physics(walls_s=1e12), np.zeros(STATES)
    filled(0.1, 1.0, 0, state, physics, RIG)
    for _ in range(2000):
        step_air(0.1, 0.0, 1.0, 0, state, physics, STEP_S)
    assert state[MASS] == pytest.approx(0.2013 + 0.1)
    assert state[HEAT] == pytest.approx(0.2013 + 1.4 * 0.1, rel=1e-6)
    mass, pressure = state[MASS], state[AIR]
    for _ in range(4000):
        step_air(0.0, 0.05, 1.0, 0, state, physics, STEP_S)
    assert state[AIR] / pressure == pytest.approx((state[MASS] / mass) ** 1.4, rel=1e-3)


def test_heat_goes_the_quicker_the_more_is_blown_in():
    cooled = []
    for blown in (0.0, 0.5):
        physics, state = Physics(walls_s=0.2), np.zeros(STATES)
        filled(0.2, 1.0, 0, state, physics, RIG)
        state[HEAT] *= 1.1
        step_air(blown, blown, 1.0, 0, state, physics, 1e-6)
        cooled.append(1.1 * state[MASS] - state[HEAT])
    assert cooled[0] == pytest.approx(0.3013 * 0.1 * 1e-6 / 0.2, rel=1e-3)
    assert cooled[1] > 2.0 * cooled[0]


@pytest.mark.parametrize("into", [0.2, 0.08])
def test_no_air_is_lost_between_bank_outlet_and_muscle(into):
    physics, state = Physics(), np.zeros(STATES)
    state[SUPPLY] = physics.main_mpa
    filled(0.2, 1.0, 0, state, physics, RIG)
    begun = state[MASS] + physics.outlet_share * state[OUTLET]
    fed = 0.0
    for _ in range(3000):
        fed += STEP_S * step_regulator(0.2 + into, 0.0, 1.0, 0.0, 0, state, physics, RIG, STEP_S)
    assert fed > 0.05
    assert state[MASS] + physics.outlet_share * state[OUTLET] - begun == pytest.approx(fed, rel=1e-9)


def test_a_channel_in_a_weld_leaks_by_the_cube_of_the_tension_and_the_squares_of_pressure():
    assert slit_flow(0.5, 3000.0, REFERENCE_MPA) == pytest.approx(0.5)
    assert slit_flow(0.5, 1500.0, REFERENCE_MPA) == pytest.approx(0.5 / 8.0)
    assert slit_flow(0.5, 3000.0, ATMOSPHERE_MPA) == 0.0
    assert slit_flow(0.5, 1e6, REFERENCE_MPA) == pytest.approx(0.5 * 27.0), "it gapes no further"


def test_a_program_gives_the_nearest_code_and_carries_what_is_left_over():
    physics, state = Physics(), np.zeros(STATES)
    balanced(0.2, 0, state, physics, RIG)
    step_program(0.9 * physics.zone_mpa, physics.main_mpa, 0, state, physics, RIG)
    assert state[CODE] == state[LEFT] == 0.0
    given = []
    for _ in range(900):
        step_program(0.0031, physics.main_mpa, 0, state, physics, RIG)
        given.append(state[CODE])
    assert set(given) <= {0.0, 1.0}
    assert np.mean(given) == pytest.approx(CODES * physics.gain_per_s * 0.0031 / physics.feed_mpa_s, rel=0.01)
    step_program(0.5, physics.main_mpa, 0, state, physics, RIG)
    assert state[CODE] == CODES
    step_program(-0.5, physics.main_mpa, 0, state, physics, RIG)
    assert state[CODE] == -CODES


def test_valves_open_and_shut_in_their_times():
    physics, state = Physics(), np.zeros(STATES)
    state[CODE] = 0.5 * CODES
    for _ in range(200):
        step_valves(0, state, physics, 1e-4)
    assert state[FEED] == pytest.approx(0.5)
    assert state[VENT] == 0.0
    state[CODE] = -float(CODES)
    for _ in range(12):
        step_valves(0, state, physics, 1e-4)
    assert state[FEED] < 0.2
    assert state[VENT] == pytest.approx(1.0 - math.exp(-1.0), abs=0.03)
    for _ in range(200):
        step_valves(0, state, physics, 1e-4)
    assert state[FEED] == 0.0, "shut is shut"


def test_a_wide_zone_narrows_as_long_as_the_bank_stays_shut():
    physics, state, rig = Physics(), np.zeros(STATES), RIG._replace(zone_mpa=0.04)
    balanced(0.2, 0, state, physics, rig)
    assert state[ZONE] == 0.02
    shut = 0
    while stays_shut(0.012, 0, state, physics, rig):
        shut += 1
    assert 0.5 < shut * CYCLE_S < 1.5
    assert not stays_shut(0.008, 0, state, physics, rig), "it goes on until the error is small"
    assert stays_shut(0.004, 0, state, physics, rig)
    assert stays_shut(0.015, 0, state, physics, rig), "and is wide again"
    assert not stays_shut(0.015, 0, np.zeros(STATES), physics, RIG)


def test_protection_lets_bursts_go_and_holds_the_rate_for_long():
    physics, state, rig = Physics(), np.zeros(STATES), RIG._replace(budget_mpa_s=0.2, budget_mpa=0.01)
    balanced(0.2, 0, state, physics, rig)
    let = [protected(float(CODES), 0, state, physics, rig) for _ in range(2000)]
    assert let[0] == CODES
    long = np.sum(let) * CYCLE_S * physics.feed_mpa_s / CODES
    assert long == pytest.approx(0.01 + 2000 * CYCLE_S * 0.2, rel=0.01)
    assert protected(-5.0, 0, state, physics, RIG) == -5.0
    assert 0.0 <= state[BUDGET] <= 0.01


def test_what_a_set_point_passes_and_what_a_sensor_says():
    state = np.zeros(STATES)
    small = [filtered(0.01, 0, state, RIG._replace(lag_s=0.1), STEP_S) for _ in range(200)]
    assert small[-1] == pytest.approx(0.01 * (1.0 - math.exp(-1.0)), rel=1e-3)
    large = np.zeros(STATES)
    for _ in range(200):
        filtered(0.2, 0, large, RIG._replace(lag_s=0.1), STEP_S)
    assert large[LAGGED] / 0.2 > 0.8, "a diode hurries it"
    assert filtered(0.3, 0, state, RIG, STEP_S) == 0.3
    fold = RIG._replace(fold_mpa=0.3)
    assert folded(0.29, fold) == 0.29
    assert folded(0.35, fold) < folded(0.3, fold) == 0.3
    physics, wrong = Physics(), RIG._replace(gain_1=0.1, gain_bend=0.2, offset_2_mpa=0.01)
    state[SENSED] = 0.5 * RANGE_MPA
    assert by_sensor(0.0, 0, state, physics, wrong) == pytest.approx(0.5 * RANGE_MPA / 1.1)
    assert by_sensor(0.0, 1, state, physics, wrong) == pytest.approx(-0.01)
    wander = RIG._replace(wander_mpa=0.01, wander_s=1.0)
    zeros = [wandered(t, 0, wander) for t in np.linspace(0.0, 2000.0, 40_001)]
    assert np.std(zeros) == pytest.approx(0.01, rel=0.05)
    assert wandered(1.0, 0, RIG) == 0.0


@pytest.mark.parametrize("to", [0.25, 0.15, 0.3])
def test_a_regulator_answers_as_fast_and_as_true_as_such_a_one_does(to):
    """40 to 110 ms to 63 %, within 2 kPa, hardly any overshoot."""
    physics = Physics()
    state = rest(0.2, 0.2, physics, RIG)
    way = []
    for i in range(3000):
        step(to if i >= 200 else 0.2, 0.2, -1.0, 0.0, state, physics, RIG, STEP_S)
        way.append(state[OUTLET] - ATMOSPHERE_MPA)
    share = (np.array(way) - 0.2) / (to - 0.2)
    assert 0.04 < STEP_S * (int(np.argmax(share > 0.632)) - 200) < 0.11
    assert way[-1] == pytest.approx(to, abs=0.002)
    assert share.max() < 1.1


def test_a_long_pipe_takes_by_the_square_of_the_flow():
    state, rig = np.zeros(STATES), RIG._replace(pipe_in=3.0, pipe_out=2.0)
    state[BEFORE], state[BEHIND] = 0.66, ATMOSPHERE_MPA
    for _ in range(4000):
        step_pipes(0.8, 0.6, 0, state, rig, 0.66, STEP_S)
    assert 0.66 - state[BEFORE] == pytest.approx(3.0 * PIPE_MPA * 0.8**2, rel=1e-3)
    assert state[BEHIND] - ATMOSPHERE_MPA == pytest.approx(2.0 * PIPE_MPA * 0.6**2, rel=1e-3)
    for _ in range(20_000):
        step_pipes(0.0, 0.0, 0, state, rig, 0.66, STEP_S)
    assert state[BEFORE] == pytest.approx(0.66, abs=1e-4)
    assert state[BEHIND] == pytest.approx(ATMOSPHERE_MPA, abs=1e-4)


def test_hose_and_receiver_take_of_the_main_quickly_and_slowly():
    physics, state, rig = Physics(), np.zeros(STATES), RIG._replace(sag_mpa=0.1)
    state[SUPPLY] = state[RECEIVER] = physics.main_mpa
    way = []
    for _ in range(40_000):
        step_supply(0.5, state, physics, rig, STEP_S)
        way.append(physics.main_mpa - state[SUPPLY])
    assert way[-1] == pytest.approx(0.5 * 0.1, rel=1e-2)
    assert 0.35 < way[200] / way[-1] < 0.6, "the hose at once, the receiver after a while"
    step_supply(0.5, state, physics, RIG, STEP_S)
    assert physics.main_mpa - state[SUPPLY] == way[-1]


def test_a_muscle_that_shortens_takes_more_air():
    physics = Physics()
    state = rest(0.2, 0.2, physics, RIG)
    turn_to(0.4, state)
    assert muscle_air(0, rest(0.25, 0.2, physics, RIG), physics, RIG) > muscle_air(0, state, physics, RIG) > 0.5
