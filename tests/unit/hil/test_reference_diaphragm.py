"""The parts of the eighth family of physics plants, each against its own law."""

import math

import numpy as np
import pytest

from hil.reference.diaphragm.bearing import (
    BRISTLE_RAD,
    FIRMER,
    bearing_torque,
    damper_drag,
    slot_torque,
    stack_torque,
)
from hil.reference.diaphragm.cylinder import (
    POT_FIRST_S,
    POT_RATIO,
    POTS,
    ROLLS,
    RUBBER_STATES,
    area,
    push,
    rig_stiffness,
    roll_force,
    roll_on,
    rubber_force,
    volume,
)
from hil.reference.diaphragm.disturbance import HEALTHY
from hil.reference.diaphragm.integrate import rest, step
from hil.reference.diaphragm.mechanics import (
    ANGLE,
    BALL,
    SPEED,
    STATES,
    ball_torque,
    behind_force,
    inertias,
    load_torque,
    moment_arm,
    step_joint,
    stroke,
    taken_by_heat,
)
from hil.reference.diaphragm.physics import ATMOSPHERE_MPA, Physics
from hil.reference.diaphragm.pneumatics import (
    REFERENCE_MPA,
    SUPPLY,
    filled,
    pinhole,
    poppet,
    step_air,
    step_supply,
    tube_flow,
)
from hil.reference.diaphragm.regulator import (
    AIR,
    BEHIND,
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
    VALVE_STATES,
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


@pytest.mark.parametrize("stroke_m", [-0.02, 0.0, 0.007, 0.02])
@pytest.mark.parametrize("wide", [0.0, 0.05])
def test_a_cylinder_pushes_by_the_work_of_its_air(stroke_m, wide):
    """Virtual work: the push is what the volume, integrated over the pressure, gains per stroke."""
    physics, p, off = Physics(), 0.25, 1e-5
    there = 0.25 * math.pi * physics.diameter_m**2 * physics.middle_m / (1.0 - physics.dead_share)
    pressures = np.linspace(0.0, p, 401)

    def work(at: float) -> float:
        air = [there * volume(float(x), at, wide, physics) for x in pressures]
        return float(np.trapezoid(air, pressures))

    by_work = 1e6 * (work(stroke_m + off) - work(stroke_m - off)) / (2.0 * off)
    assert push(p, stroke_m, wide, physics) == pytest.approx(by_work, rel=1e-4)


def test_a_bore_that_tapers_takes_the_push_with_the_stroke_and_a_wider_diaphragm_gives_more():
    physics = Physics()
    strokes = np.linspace(-0.025, 0.025, 11)
    pushes = [push(0.2, float(x), 0.0, physics) for x in strokes]
    assert np.all(np.diff(pushes) < 0.0)
    assert pushes[5] == pytest.approx(0.2e6 * math.pi * 0.02**2 * 1.01)
    assert area(0.01, 0.0, Physics(taper=1e-9)) == pytest.approx(math.pi * 0.02**2)
    assert push(0.2, 0.0, 0.1, physics) == pytest.approx(1.21 * pushes[5])
    assert push(-0.1, 0.0, 0.0, physics) == 0.0
    assert push(0.4, 0.0, 0.0, physics) > 2.0 * pushes[5], "its convolution widens"


def rolled(path, physics, state=None, p=0.2):
    state = np.zeros(ROLLS) if state is None else state
    rows = []
    for way in np.diff(path):
        roll_on(float(way), 0, state, physics)
        rows.append(roll_force(p, 0, state, physics))
    return np.array(rows)


def test_a_diaphragm_resists_by_its_path_alone_up_to_its_level():
    physics = Physics()
    level = physics.lobe_n + 0.2 * physics.lobe_n_mpa
    coarse, fine = (rolled(np.linspace(0.0, 0.03, n + 1), physics) for n in (10, 1000))
    assert coarse[-1] == pytest.approx(fine[-1], rel=1e-9), "no step and no speed counts"
    assert fine[-1] == pytest.approx(-level, rel=0.01)
    assert np.all(np.diff(fine) < 0.0)
    assert rolled([0.0, 0.03], physics, p=0.4)[0] < 1.3 * fine[-1], "more under pressure"
    assert rolled([0.0, -0.03], physics)[0] == pytest.approx(-fine[-1])


def test_rolling_to_and_fro_only_takes_work():
    physics, random = Physics(), np.random.default_rng(3)
    path = np.concatenate([[0.0], np.cumsum(np.repeat(random.choice((-1.0, 1.0), 80), 25) * 1e-4), [0.0]])
    taken = -np.cumsum(rolled(path, physics) * np.diff(path))
    assert taken[-1] > 0.0
    loop = np.concatenate([np.linspace(0.0, 0.01, 201), np.linspace(0.01, -0.01, 401), np.linspace(-0.01, 0.0, 201)])
    state = np.zeros(ROLLS)
    rolled(loop, physics, state)
    assert -np.sum(rolled(loop, physics, state) * np.diff(loop)) > 0.02, "no closed loop gives any back"


def test_rubber_relaxes_by_the_power_of_time():
    physics, state = Physics(), np.zeros(RUBBER_STATES)
    times = np.arange(1, 60_001) * 1e-3
    forces = [-rubber_force(0.0, 0.01, 0, state, physics, 1e-3) for _ in times]
    wanted = 0.01 * physics.rubber * rig_stiffness(physics) * times**-physics.rubber_order
    assert POT_FIRST_S * POT_RATIO ** (POTS - 1) > 200.0
    within = times > 3.0 * POT_FIRST_S
    assert np.array(forces)[within] == pytest.approx(wanted[within], rel=0.06)
    assert rubber_force(physics.rubber, 0.01, 0, np.zeros(RUBBER_STATES), physics, 1e-3) == pytest.approx(
        -2.0 * forces[0]
    )


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


def test_a_pinhole_is_covered_until_the_lobe_has_rolled_by():
    state = np.zeros(STATES)
    state[AIR] = REFERENCE_MPA
    rig = RIG._replace(leak_1=0.5, leak_at_m=0.004)
    flows = [pinhole(at, 0, state, rig) for at in (-0.02, 0.004, 0.02)]
    assert flows[0] < 0.3 * flows[1] < 0.3 * flows[2]
    assert pinhole(0.02, 1, state, rig) == 0.0


def test_a_scotch_yoke_goes_by_the_tangent():
    physics = Physics()
    for angle in (-0.6, 0.0, 0.4):
        slope = (stroke(angle + 1e-5, physics) - stroke(angle - 1e-5, physics)) / 2e-5
        assert moment_arm(angle, physics) == pytest.approx(slope, rel=1e-6)
        inertia = [inertias(angle + off, physics, RIG)[0] for off in (-1e-5, 1e-5)]
        assert inertias(angle, physics, RIG)[1] == pytest.approx(0.5 * (inertia[1] - inertia[0]) / 2e-5, rel=1e-5)
    assert stroke(0.0, physics) == 0.0
    sledge = inertias(0.0, physics, RIG._replace(sledge_kgm2=0.01))[0] - inertias(0.0, physics, RIG)[0]
    assert sledge == pytest.approx(0.01), "as the joint has it at angle zero"


def test_a_yoke_keeps_its_energy():
    quiet = Physics(spring_nm_rad=0.0, rubber=0.0, slot=0.0, bearing_nm=0.0, drag_nm_s=0.0, lobe_n=0.0, lobe_n_mpa=0.0)
    state = np.zeros(STATES)
    for valve in range(2):
        state[valve * VALVE_STATES + AIR] = ATMOSPHERE_MPA
    state[SPEED] = 1.0
    before = 0.5 * inertias(0.0, quiet, RIG)[0]
    for _ in range(7000):
        step_joint(0.0, 0.0, state, quiet, RIG, 1e-4)
    assert 0.5 < state[ANGLE] < 0.75
    assert state[SPEED] < 0.97, "slower where the yoke goes faster"
    assert 0.5 * inertias(state[ANGLE], quiet, RIG)[0] * state[SPEED] ** 2 == pytest.approx(before, rel=2e-3)


def slid(speeds, level=1.0, dt_s=1e-4):
    state = np.zeros(2)
    return np.array([-bearing_torque(level, 0.005, 0, state, float(v), dt_s) for v in speeds])


def test_a_bearing_sticks_slides_at_its_level_and_holds_firmer_after_a_dwell():
    assert slid(np.full(5000, 0.5))[-1] == pytest.approx(1.0, rel=1e-3)
    assert slid(np.full(5000, -0.5), 3.0)[-1] == pytest.approx(-3.0, rel=1e-3)
    creeping = slid(np.full(50_000, 0.002))
    assert 1.05 < creeping.max() < 1.0 + FIRMER, "it holds firmer as it hardly moves"
    assert slid(np.full(20_000, 0.05)).max() < 1.01
    sticks = slid(np.full(100, 1e-3))
    assert sticks[-1] == pytest.approx(1e-5 / BRISTLE_RAD, abs=0.02), "a spring before"
    assert slid([0.3], 0.0)[0] == 0.0


def test_friction_of_slot_bearing_and_stack_only_takes_work():
    speeds = 0.8 * np.sin(np.arange(20_000) * 1e-3)
    assert np.sum(slid(speeds) * speeds) > 0.0
    for angle in (-0.5, 0.5):
        for speed in (-1.0, 1.0):
            assert slot_torque(3.0, angle, speed, 0.06) * speed < 0.0
            assert slot_torque(-3.0, angle, speed, 0.06) == slot_torque(3.0, angle, speed, 0.06)
    assert slot_torque(3.0, 0.0, 1.0, 0.06) == 0.0
    stop = RIG._replace(stop_high_rad=0.4, stop_low_rad=-0.4)
    assert stack_torque(0.3, 1.0, stop) == 0.0
    into, back = (stack_torque(0.48, speed, stop) for speed in (1.0, -1.0))
    assert into < back < 0.0, "less comes back; it only pushes"
    assert stack_torque(-0.48, -1.0, stop) == -into
    assert stack_torque(0.5, 0.0, stop) < 3.0 * stack_torque(0.45, 0.0, stop), "stiff once discs lie flat"
    damper = RIG._replace(damper_nm_s=1.0)
    assert damper_drag(1.0, damper) > 1.3
    assert damper_drag(-1.0, damper) < 0.7
    assert damper_drag(1.0, RIG) == 0.0


def test_a_chain_pulls_the_more_the_higher_its_arm_and_heat_takes_force():
    load = RIG._replace(load_nm=1.0)
    assert load_torque(0.0, load) == load_torque(0.7, RIG) == 0.0
    assert load_torque(1.0, load) < -math.sin(1.0)
    heat = RIG._replace(heat=0.2, heat_s=5.0)
    taken = [taken_by_heat(t, 0.0, heat) for t in (0.0, 5.0, 20.0, 300.0)]
    assert taken[0] == taken_by_heat(100.0, 1.0, RIG) == 0.0
    assert np.all(np.diff(taken) > 0.0)
    assert taken[-1] == pytest.approx(0.2, rel=0.01)


def test_a_ball_rolls_to_the_lower_end_and_stays_on_a_slight_slope():
    rig = RIG._replace(ball_nm=0.5)
    state = np.zeros(STATES)
    state[ANGLE] = 0.01
    for _ in range(4000):
        ball_torque(state, rig, STEP_S)
    assert state[BALL] == 0.0
    state[ANGLE] = 0.2
    torque = [ball_torque(state, rig, STEP_S) for _ in range(4000)]
    assert state[BALL] == pytest.approx(-1.0, abs=1e-3)
    assert torque[-1] == pytest.approx(0.5 * math.cos(0.2), rel=0.01), "which turns the joint further"
    assert ball_torque(state, RIG, STEP_S) == 0.0


def test_air_behind_a_piston_is_a_spring_at_once_and_nothing_after_a_while():
    physics, rig, state = Physics(), RIG._replace(vent_s=0.2, vent_cylinder=1.0), np.zeros(STATES)
    filled(0.2, 1.0, 1, state)
    quick = behind_force(1, 0.01, state, physics, rig, STEP_S)
    assert quick == pytest.approx(-1e6 * area(0.0, 0.0, physics) * ATMOSPHERE_MPA / 3.0, rel=0.02)
    for _ in range(20_000):
        slow = behind_force(1, 0.01, state, physics, rig, STEP_S)
    assert slow == pytest.approx(0.0, abs=0.01)
    assert behind_force(0, 0.01, state, physics, rig, STEP_S) == 0.0
    assert state[VALVE_STATES + BEHIND] < ATMOSPHERE_MPA
