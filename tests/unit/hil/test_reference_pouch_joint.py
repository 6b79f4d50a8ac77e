"""The rolls of the ninth family of physics plants and what they carry, each against its own law."""

import math

import numpy as np
import pytest

from hil.reference.pouch.bank import VALVE_STATES
from hil.reference.pouch.disturbance import HEALTHY
from hil.reference.pouch.integrate import rest
from hil.reference.pouch.mechanics import ANGLE, COSINE, SINE, SPEED, STATES, pouch_length, step_joint, turn_to
from hil.reference.pouch.physics import Physics
from hil.reference.pouch.rolling import (
    BREAKS,
    CORD_ARM_M,
    CORD_M,
    centre_torque,
    cord_torque,
    cork_torque,
    drawn_in,
    guide_drag,
    half_of,
    inertias,
    load_torque,
    moment_arm,
    squeeze_drag,
)

RIG = HEALTHY.rig


def mirrored(point, angle, roll_m):
    """The place of a link's eyelet: the base's, mirrored at the tangent of both rolls."""
    normal = np.array([math.sin(0.5 * angle), math.cos(0.5 * angle)])
    return np.array(point) + 2.0 * (roll_m - float(np.dot(point, normal))) * normal


@pytest.mark.parametrize("angle", [-0.6, -0.1, 0.0, 0.3, 0.7])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_tendon_is_as_long_as_from_an_eyelet_to_its_mirror_image(angle, way):
    roll_m, off_m, below_m = 0.03, 0.0245, 0.004
    eyelet = (way * off_m, -below_m)

    def long(at: float) -> float:
        return float(np.linalg.norm(mirrored(eyelet, at, roll_m) - np.array(eyelet)))

    shorter = drawn_in(half_of(angle), way, off_m, below_m)
    assert shorter == pytest.approx(long(0.0) - long(angle), abs=1e-12)
    slope = (long(angle - 1e-6) - long(angle + 1e-6)) / 2e-6
    assert moment_arm(half_of(angle), way, off_m, below_m) == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("angle", [-0.6, 0.0, 0.5])
def test_the_inertia_is_that_of_a_link_that_rolls(angle):
    """By the way of its centre: round the base's roll by half of the angle, about its own roll by the whole."""
    physics = Physics()

    def centre(at: float):
        r, c = 2.0 * physics.roll_m, physics.link_m
        return np.array([r * math.sin(0.5 * at) + c * math.sin(at), r * math.cos(0.5 * at) + c * math.cos(at)])

    moved = (centre(angle + 1e-6) - centre(angle - 1e-6)) / 2e-6
    wanted = physics.inertia_kgm2 + physics.link_kg * float(np.dot(moved, moved))
    assert inertias(half_of(angle), physics, RIG)[0] == pytest.approx(wanted, rel=1e-6)
    ends = [inertias(half_of(angle + off), physics, RIG)[0] for off in (-1e-5, 1e-5)]
    assert inertias(half_of(angle), physics, RIG)[1] == pytest.approx(0.5 * (ends[1] - ends[0]) / 2e-5, abs=1e-9)


def test_a_mass_far_out_is_as_large_as_said_at_angle_zero_and_less_beside():
    physics, rig = Physics(), RIG._replace(outer_kgm2=0.02)
    more = [inertias(half_of(at), physics, rig)[0] - inertias(half_of(at), physics, RIG)[0] for at in (0.0, 0.8)]
    assert more[0] == pytest.approx(0.02)
    assert 0.9 * more[0] < more[1] < more[0]


def test_rolls_keep_their_energy():
    """Cords alone: what moves and what they hold is together as before."""
    physics = Physics(width_m=1e-6, ends=0.0, film_n_m=1e-3, crease_nm=0.0, crease_nm_mpa=0.0, bearing_nm=0.0,
                      drag_nm_s=0.0)  # fmt: skip
    state = rest(0.2, 0.2, physics, RIG)
    state[SPEED] = 3.0
    before = 0.5 * inertias(half_of(0.0), physics, RIG)[0] * 9.0
    turned = np.linspace(0.0, 1.0, 20_001)
    held = -np.concatenate([[0.0], np.cumsum([cord_torque(half_of(float(at)), physics) for at in turned[1:]])]) * 5e-5
    energies, angles = [], []
    for _ in range(20_000):
        step_joint(-1.0, 0.0, state, physics, RIG, 5e-5)
        moving = 0.5 * inertias(half_of(state[ANGLE]), physics, RIG)[0] * state[SPEED] ** 2
        energies.append(moving + float(np.interp(abs(state[ANGLE]), turned, held)))
        angles.append(state[ANGLE])
    assert max(angles) > 0.3 > -0.3 > min(angles)
    assert np.array(energies) == pytest.approx(before, rel=0.01)


def test_cords_are_rubber_and_pull_to_the_middle_until_one_is_slack():
    physics = Physics()
    assert cord_torque(half_of(0.0), physics) == pytest.approx(0.0, abs=1e-12)
    torques = [cord_torque(half_of(float(at)), physics) for at in np.linspace(-0.9, 0.9, 31)]
    assert np.all(np.diff(torques) < 0.0)
    assert torques[0] == pytest.approx(-torques[-1])
    stretch = physics.cord_stretch
    by_rubber = 4.0 * 0.5 * CORD_ARM_M**2 / CORD_M * physics.cord_n * (1.0 + 2.0 / stretch**3)
    assert -(cord_torque(half_of(1e-5), physics)) / 1e-5 == pytest.approx(by_rubber, rel=1e-3), "neo-Hookean"
    slack = Physics(cord_stretch=1.05)
    assert cord_torque(half_of(0.6), slack) < 0.0


def rubbed(speeds, level=1.0, dt_s=5e-4):
    state = np.zeros(1)
    return np.array([guide_drag(level, float(v), 0, state, dt_s) * v for v in speeds])


def test_guides_rub_by_their_level_more_at_rest_and_know_the_speed_late():
    assert rubbed(np.full(2000, 0.5))[-1] == pytest.approx(1.0, rel=1e-3)
    assert rubbed(np.full(2000, -0.5), 3.0)[-1] == pytest.approx(-3.0, rel=1e-3)
    assert rubbed(np.full(2000, 0.012))[-1] == pytest.approx(1.0 + BREAKS * math.exp(-0.24), rel=0.01)
    sudden = rubbed(np.full(400, 0.5))
    assert sudden[0] > 1.3, "the film does not know of the speed yet"
    assert np.all(np.diff(sudden) <= 1e-12)
    assert rubbed(np.full(10, 1e-4))[-1] < 0.04, "it creeps and does not stick"
    assert rubbed([0.3], 0.0)[0] == 0.0
    speeds = 0.8 * np.sin(np.arange(20_000) * 1e-3)
    assert np.min(rubbed(speeds) * speeds) >= 0.0, "it only takes work"


def test_a_stuck_joint_creeps_and_one_that_is_pushed_beyond_moves():
    physics = Physics()
    heavy = RIG._replace(dry_nm=2.0, load_nm=1.0, load_rad=1.5)
    away = []
    for rig in (heavy, heavy._replace(load_nm=5.0)):
        state = rest(0.2, 0.2, physics, rig)
        for _ in range(2000):
            step_joint(-1.0, 0.0, state, physics, rig, 5e-4)
        away.append(abs(state[ANGLE]))
    assert away[0] < 0.01 < 0.05 < away[1]


def test_grease_drags_more_off_the_middle_and_a_weight_has_two_terms():
    grease = RIG._replace(squeeze_nm_s=1.0)
    assert squeeze_drag(0.0, grease) == 1.0
    assert squeeze_drag(-0.6, grease) == squeeze_drag(0.6, grease) > 1.8
    assert squeeze_drag(0.3, RIG) == 0.0
    load = RIG._replace(load_nm=2.0)
    assert load_torque(0.0, load) == load_torque(0.7, RIG) == 0.0
    assert load_torque(math.pi, load) == pytest.approx(-2.0 * 0.35), "half of the angle is left"
    assert load_torque(0.4, load) == -load_torque(-0.4, load) < 0.0


def test_cork_only_pushes_is_ever_stiffer_and_lets_go():
    stop, state = RIG._replace(stop_high_rad=0.4, stop_low_rad=-0.4), np.zeros(1)
    assert cork_torque(0.39, 0, state, stop, 1e-3) == 0.0
    at_once = [cork_torque(angle, 0, np.zeros(1), stop, 1e-3) for angle in (0.42, 0.45, 0.5)]
    assert 0.0 > at_once[0] > at_once[1] > at_once[2]
    assert at_once[2] / 0.1 < 1.5 * at_once[0] / 0.02
    pushed = [cork_torque(-0.45, 0, state, stop, 1e-3) for _ in range(2000)]
    assert pushed[0] > pushed[-1] > 0.0, "it gives"
    assert pushed[-1] == pytest.approx(2.0 * (math.e - 1.0), rel=1e-3)
    assert cork_torque(0.4, 0, state, stop, 1e-3) == 0.0
    assert cork_torque(-0.401, 0, state, stop, 1e-3) == 0.0, "it does not pull"


def test_a_spring_over_the_centre_pushes_away_from_it_as_far_as_said():
    rig = RIG._replace(centre_nm=0.8)
    torques = np.array([centre_torque(float(at), rig) for at in np.linspace(-1.0, 1.0, 2001)])
    assert torques[1000] == 0.0
    assert torques.max() == pytest.approx(0.8, rel=1e-3)
    assert np.all(torques[1001:] >= 0.0)
    assert torques == pytest.approx(-torques[::-1])
    assert torques[-1] == 0.0, "it has sprung out"


def test_both_rows_share_out_the_length_as_the_joint_turns():
    physics, state = Physics(apart_m=0.0), np.zeros(STATES)
    for angle in (0.0, 0.5):
        turn_to(angle, state)
        assert (state[SINE], state[COSINE]) == half_of(angle)
        first, second = (pouch_length(muscle, state, physics, RIG) for muscle in range(2))
        shorter = drawn_in(half_of(angle), 1.0, physics.arm_m, physics.eyelet_m)
        built = physics.pouch_m * (1.0 - physics.short)
        assert first == pytest.approx(built - shorter / physics.pouches)
        assert (second > built) == (angle > 0.0)
    assert VALVE_STATES < STATES
