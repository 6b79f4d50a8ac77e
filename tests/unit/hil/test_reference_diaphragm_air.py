"""Flows, air and regulators of the eighth family of physics plants, each against its own law."""

import math

import numpy as np
import pytest

from hil.reference.diaphragm.disturbance import HEALTHY
from hil.reference.diaphragm.integrate import rest, step
from hil.reference.diaphragm.mechanics import (
    STATES,
)
from hil.reference.diaphragm.physics import ATMOSPHERE_MPA, Physics
from hil.reference.diaphragm.pneumatics import (
    SUPPLY,
    filled,
    poppet,
    step_air,
    step_supply,
    tube_flow,
)
from hil.reference.diaphragm.regulator import (
    AIR,
    CYCLE_S,
    DOME,
    FEED,
    MASS,
    OUTLET,
    PULSE,
    RANGE_MPA,
    SAVED,
    SENSED,
    STEM,
    VENT,
    amplified,
    balanced,
    ellipse,
    in_series,
    lift,
    spanned,
    step_control,
    step_dome,
    step_program,
    step_solenoids,
)

RIG, STEP_S = HEALTHY.rig, 5e-4


def test_flow_is_choked_an_ellipse_and_laminar_near_equal_pressures():
    assert ellipse(0.3, 0.35) == 1.0
    assert ellipse(1.0, 0.35) == ellipse(1.4, 0.35) == 0.0
    assert ellipse(0.7, 0.35) == pytest.approx(math.sqrt(1.0 - (0.35 / 0.65) ** 2))
    assert ellipse(0.995, 0.35) == pytest.approx(5.0 * ellipse(0.999, 0.35)), "laminar"
    flows = [ellipse(float(ratio), 0.4) for ratio in np.linspace(0.41, 1.0, 80)]
    assert np.all(np.diff(flows) < 0.0)


def test_restrictions_behind_one_another_let_less_through_than_either_and_choke_later():
    assert in_series(1.0, 1.0) == pytest.approx(2.0 ** (-1.0 / 3.0))
    assert in_series(0.1, 5.0) == pytest.approx(0.1, rel=1e-4)
    assert in_series(0.0, 1.0) == 0.0
    physics = Physics()
    lifts = [poppet(float(x), 0.0, 0.1, physics) for x in np.linspace(0.0, 1.0, 30)]
    assert lifts[0] == 0.0
    assert np.all(np.diff(lifts) > 0.0)
    assert poppet(1.0, 0.0, 0.4, physics) < lifts[-1], "two restrictions choke later"
    assert poppet(0.05, 0.0, 0.4, physics) == pytest.approx(poppet(0.05, 0.0, 0.1, physics)), "one curtain alone"
    cloths = [poppet(1.0, size, 0.2, physics) for size in (0.0, 0.05, 1.0, 10.0, 60.0)]
    assert np.all(np.diff(cloths) < 0.0)
    assert cloths[-1] == pytest.approx(1.3 / 60.0, rel=0.01)


def test_a_tube_takes_of_the_square_of_the_pressure():
    physics = Physics()
    flow = tube_flow(0.32, 0.30, physics)
    assert physics.laminar_mpa2_s * flow + physics.turbulent_mpa2_s * flow**2 == pytest.approx(0.32**2 - 0.30**2)
    assert tube_flow(0.30, 0.32, physics) == -flow
    assert tube_flow(0.3, 0.3, physics) == 0.0


@pytest.mark.parametrize(("walls_s", "power"), [(1e9, 1.4), (1e-6, 1.0)])
def test_air_is_compressed_without_heat_when_quick_and_without_warming_when_slow(walls_s, power):
    physics, state = Physics(walls_s=walls_s), np.zeros(STATES)
    filled(0.2, 1.0, 0, state)
    for air in np.linspace(1.0, 0.8, 2001)[1:]:
        step_air(0.0, air, 0, state, physics, STEP_S)
    assert state[AIR] * 0.8**power == pytest.approx(0.2 + ATMOSPHERE_MPA, rel=1e-4)
    assert state[MASS] == 0.2 + ATMOSPHERE_MPA


def test_a_program_leaves_small_errors_alone_saves_up_short_pulses_and_gives_long_ones():
    physics, state = Physics(), np.zeros(STATES)
    balanced(0.2, 0, state)
    step_program(0.2 + 0.9 * physics.numb_mpa, 0, state, physics, RIG)
    assert state[PULSE] == state[SAVED] == 0.0
    given = []
    for _ in range(400):
        step_program(0.203, 0, state, physics, RIG)
        given.append(state[PULSE])
    assert min(pulse for pulse in given if pulse > 0.0) >= physics.shortest_s
    assert 0.0 in given, "it waits until a pulse is due"
    assert np.sum(given) == pytest.approx(400 * CYCLE_S * physics.duty_per_mpa * 0.003, rel=0.02)
    step_program(0.5, 0, state, physics, RIG)
    assert state[PULSE] == CYCLE_S
    step_program(0.0, 0, state, physics, RIG)
    assert state[PULSE] == -CYCLE_S


@pytest.mark.parametrize("dt_s", [5e-4, 2e-4])
def test_a_pulse_opens_a_solenoid_for_as_long_whatever_the_step(dt_s):
    physics, state, opened = Physics(), np.zeros(STATES), 0.0
    state[PULSE] = 0.0013
    for _ in range(round(0.02 / dt_s)):
        step_solenoids(0, state, physics, dt_s)
        opened += dt_s * state[FEED]
    assert opened == pytest.approx(0.0013, rel=1e-3)
    assert state[VENT] == pytest.approx(0.0)


def held_open(rig, feed, dome, n=100):
    physics, state = Physics(), np.zeros(STATES)
    state[FEED], state[VENT], state[DOME] = feed, 1.0 - feed, dome
    for _ in range(n):
        step_dome(physics.main_mpa, 0, state, physics, rig, STEP_S)
    return state[DOME]


def test_a_dome_fills_and_empties_at_its_rates_and_gives_way_at_its_limit():
    physics = Physics()
    assert held_open(RIG, 1.0, 0.12, 40) == pytest.approx(0.12 + 40 * STEP_S * physics.pilot_mpa_s)
    jets = [held_open(RIG._replace(jet_mpa_s=jet), 1.0, 0.12, 40) for jet in (1.5, 0.3, 0.05)]
    assert np.all(np.diff(jets) < 0.0)
    assert jets[-1] == pytest.approx(0.12 + 40 * STEP_S * 0.05, abs=1e-4)
    limited = held_open(RIG._replace(dome_limit_mpa=0.3), 1.0, 0.35, 4000)
    assert limited - ATMOSPHERE_MPA == pytest.approx(0.3, abs=0.006)
    assert held_open(RIG, 0.0, 0.3, 4000) == pytest.approx(ATMOSPHERE_MPA, abs=1e-3)
    weeping = held_open(RIG._replace(weep_1_mpa_s=0.1), 0.0, 0.3, 10)
    assert weeping > held_open(RIG, 0.0, 0.3, 10)


def test_a_stem_sticks_and_a_poppet_is_lifted_by_the_excess():
    physics, state = Physics(ring_mpa=0.002), np.zeros(STATES)
    balanced(0.2, 0, state)
    state[DOME] += 0.0019
    step_dome(0.65, 0, state, physics, RIG, STEP_S)
    assert state[STEM] == 0.2
    state[DOME] += 0.01
    step_dome(0.65, 0, state, physics, RIG, STEP_S)
    assert state[STEM] == pytest.approx(0.2 + 0.0099)
    assert lift(0, state, physics) == pytest.approx((0.0099 - physics.seat_mpa) / physics.lift_mpa)
    state[STEM] = 0.2 - 0.9 * physics.seat_mpa
    assert lift(0, state, physics) == 0.0
    state[STEM] = 0.0
    assert lift(0, state, physics) == -1.0


def test_what_a_set_point_passes_ahead_of_the_comparator():
    state = np.zeros(STATES)
    ramp = [amplified(k * STEP_S, 0, state, RIG._replace(amplifier_s=0.05), STEP_S) for k in range(4000)]
    assert 3999 * STEP_S - ramp[-1] == pytest.approx(0.05, abs=STEP_S)
    assert amplified(0.3, 0, state, RIG, STEP_S) == 0.3
    wrong = RIG._replace(gain_1=0.1, gain_bend=0.2, offset_2_mpa=0.01)
    assert spanned(0.5 * RANGE_MPA, 0, wrong) == pytest.approx(0.25 * 1.12)
    assert spanned(0.3, 1, wrong) == pytest.approx(0.31)


def test_a_tap_that_faces_the_flow_reads_more_while_the_cylinder_fills():
    physics, seen = Physics(sensor_s=1e-6), []
    for into in (1.0, -1.0):
        state = np.zeros(STATES)
        balanced(0.2, 0, state)
        state[OUTLET + 1] = into
        step_control(0.2, 0.65, 0, state, physics, RIG._replace(pitot_mpa=0.05), STEP_S)
        seen.append(state[SENSED])
    assert seen == pytest.approx([0.25, 0.15], abs=1e-4)


@pytest.mark.parametrize("to", [0.25, 0.15, 0.3])
def test_a_regulator_answers_as_fast_and_as_true_as_its_data_sheet_says(to):
    """Response 40 to 100 ms to 63 %, linearity 1 % and sensitivity 0.2 % of 0.5 MPa, hardly any overshoot."""
    physics = Physics()
    state = rest(0.2, 0.2, physics, RIG)
    way = []
    for i in range(3000):
        step(to if i >= 200 else 0.2, 0.2, -1.0, 0.0, state, physics, RIG, STEP_S)
        way.append(state[OUTLET] - ATMOSPHERE_MPA)
    share = (np.array(way) - 0.2) / (to - 0.2)
    assert 0.04 < STEP_S * (int(np.argmax(share > 0.632)) - 200) < 0.1
    assert way[-1] == pytest.approx(to, abs=0.002)
    assert share.max() < 1.1


def test_a_dryer_takes_of_the_main_what_flows_and_gives_it_back():
    physics, state = Physics(), np.zeros(STATES)
    state[SUPPLY] = physics.main_mpa
    rig = RIG._replace(dryer_mpa=0.3)
    for _ in range(20_000):
        step_supply(0.5, state, physics, rig, STEP_S)
    assert physics.main_mpa**2 - state[SUPPLY] ** 2 == pytest.approx(0.5 * 2.0 * physics.main_mpa * 0.3, rel=1e-3)
    for _ in range(20_000):
        step_supply(0.0, state, physics, rig, STEP_S)
    assert state[SUPPLY] == pytest.approx(physics.main_mpa, rel=1e-4)
