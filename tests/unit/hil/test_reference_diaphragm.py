"""Cylinders, joint and bearings of the eighth family of physics plants, each against its own law."""

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
    filled,
    pinhole,
)
from hil.reference.diaphragm.regulator import (
    AIR,
    BEHIND,
    VALVE_STATES,
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
