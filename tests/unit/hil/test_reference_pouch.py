"""Pouches, film and creases of the ninth family of physics plants, each against its own law or the literature's."""

import math

import numpy as np
import pytest

from hil.reference.pouch.bank import AIR, ANCHOR, PEELED, VALVE_STATES
from hil.reference.pouch.disturbance import HEALTHY
from hil.reference.pouch.film import (
    CREASE_STATES,
    LEAST_RAD,
    STRAIN_SHARES,
    STRAIN_TIMES,
    STRAINS,
    crease_force,
    crease_on,
    gained,
    opened,
    pull,
    strain,
    strain_on,
    volume,
    zigzag,
)
from hil.reference.pouch.integrate import rest, step
from hil.reference.pouch.mechanics import (
    ANGLE,
    SPEED,
    film_length,
    muscle_air,
    muscle_force,
    open_pouches,
    pouch_length,
    step_anchor,
    step_film,
    sun,
)
from hil.reference.pouch.physics import Physics

RIG, STEP_S = HEALTHY.rig, 5e-4
STIFF = 1e12
"""Force per width and strain (N/m) of a film that does not stretch."""


def shape(length_m, p_mpa, physics, film_n_m=None):
    film_n_m = film_n_m or physics.film_n_m
    return opened(0.8, length_m, p_mpa, physics.pouch_m, film_n_m, 40, physics), film_n_m


def force(length_m, p_mpa, physics, film_n_m=None):
    (opening, half), film_n_m = shape(length_m, p_mpa, physics, film_n_m)
    return pull(opening, half, length_m, p_mpa, physics.pouch_m, film_n_m, physics)


def held(length_m, p_mpa, physics):
    (opening, half), _ = shape(length_m, p_mpa, physics)
    return volume(opening, half, length_m, physics)


@pytest.mark.parametrize("contraction", [0.03, 0.1, 0.2])
def test_a_pouch_of_stiff_film_without_ends_is_that_of_the_literature(contraction):
    """Niiyama and others (2015): contraction 1 - sin(t) / t, pull l w p cos(t) / t, volume l^2 w / 2 (t - sin t cos t)
    / t^2."""
    physics, p = Physics(ends=0.0), 0.2
    length = physics.pouch_m * (1.0 - contraction)
    (opening, half), _ = shape(length, p, physics, STIFF)
    t = next(x for x in np.linspace(0.01, 1.4, 139_001) if math.sin(x) / x < 1.0 - contraction)
    assert opening == pytest.approx(t, abs=2e-5)
    area = physics.pouch_m * physics.width_m
    assert force(length, p, physics, STIFF) == pytest.approx(1e6 * p * area * math.cos(t) / t, rel=2e-3)
    by_arcs = 0.5 * physics.pouch_m * area * (t - math.sin(t) * math.cos(t)) / t**2
    assert volume(opening, half, length, physics) == pytest.approx(by_arcs, rel=1e-4)


@pytest.mark.parametrize("share", [0.85, 0.92, 0.98])
def test_a_film_that_stretches_is_taut_by_pressure_and_radius(share):
    """Without ends the tension is pressure times radius (Laplace), in closed form: length sin(t) / (t - p l / 2 S)."""
    physics, p = Physics(ends=0.0), 0.25
    length = physics.pouch_m * share
    (opening, half), _ = shape(length, p, physics)
    tension = physics.film_n_m * strain(opening, half, length, physics.pouch_m)
    assert tension == pytest.approx(1e6 * p * length / (2.0 * math.sin(opening)), rel=1e-6)
    slack = 1e6 * p * physics.pouch_m / (2.0 * physics.film_n_m)
    assert length == pytest.approx(physics.pouch_m * math.sin(opening) / (opening - slack), rel=1e-9)
    wanted = 1e6 * p * physics.width_m * physics.pouch_m * math.cos(opening) / (opening - slack)
    assert force(length, p, physics) == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("share", [0.84, 0.9, 0.97])
@pytest.mark.parametrize("p", [0.08, 0.3])
def test_pull_and_volume_come_from_one_energy(share, p):
    """Maxwell's relation: what the pull gains per pressure is what the volume gives per length."""
    physics = Physics()
    length, off, little = physics.pouch_m * share, 1e-6, 1e-4
    by_pressure = (force(length, p + little, physics) - force(length, p - little, physics)) / (2e6 * little)
    by_length = (held(length + off, p, physics) - held(length - off, p, physics)) / (2.0 * off)
    assert by_pressure == pytest.approx(-by_length, rel=1e-4)


def test_a_pouch_goes_round_a_closed_way_without_work():
    """The work on the joint and on the air together is nothing, over a loop of length and pressure."""
    physics, turn = Physics(), np.linspace(0.0, 2.0 * math.pi, 1201)
    lengths, pressures = physics.pouch_m * (0.9 + 0.06 * np.cos(turn)), 0.2 + 0.1 * np.sin(turn)
    pulls = np.array([force(float(x), float(p), physics) for x, p in zip(lengths, pressures, strict=True)])
    volumes = np.array([held(float(x), float(p), physics) for x, p in zip(lengths, pressures, strict=True)])
    by_pull = -np.trapezoid(pulls, lengths)
    assert abs(by_pull) > 0.02
    assert by_pull == pytest.approx(1e6 * np.trapezoid(pressures, volumes), rel=1e-3)


def test_newtons_slope_is_that_of_the_gain_and_every_opening_is_found():
    physics, length, off = Physics(), 0.0225, 1e-6
    for opening in (0.3, 0.8, 1.2):
        gains = [
            gained(at, math.tan(0.5 * at), length, 2e5, physics.pouch_m, physics.film_n_m, physics)
            for at in (opening - off, opening, opening + off)
        ]
        assert gains[1][1] == pytest.approx((gains[2][0] - gains[0][0]) / (2.0 * off), rel=1e-5)
    for begun in (LEAST_RAD, 0.3, 0.9, 1.4):
        for p in (0.0, 0.02, 0.4):
            opening, half = opened(begun, length, p, physics.pouch_m, physics.film_n_m, 60, physics)
            assert half == pytest.approx(math.tan(0.5 * opening), rel=1e-9)
            gain, _ = gained(opening, half, length, 1e6 * max(1e-4, p), physics.pouch_m, physics.film_n_m, physics)
            assert gain == pytest.approx(0.0, abs=1e-5)


def test_softer_film_and_ends_that_draw_in_take_of_the_pull_and_a_pouch_beyond_its_film_is_a_spring():
    physics, length = Physics(), 0.0225
    assert force(length, 0.2, physics, 0.5 * physics.film_n_m) < force(length, 0.2, physics), "its film is longer"
    assert force(length, 0.2, Physics(ends=0.6)) < force(length, 0.2, Physics(ends=0.3))
    pulls = [force(float(x), 0.2, physics) for x in physics.pouch_m * np.linspace(0.8, 1.03, 40)]
    assert np.all(np.diff(pulls) > 0.0)
    taut = physics.pouch_m * 1.03
    assert force(taut, 0.001, physics) == pytest.approx(2.0 * physics.width_m * physics.film_n_m * 0.03, rel=0.1)


def test_delayed_strain_is_kohlrauschs():
    """A stress that stays: the delayed strain comes by 1 - exp(-(t / T)^0.5)."""
    physics, state = Physics(), np.zeros(STRAINS)
    assert sum(STRAIN_SHARES) == pytest.approx(1.0, abs=0.12)
    assert STRAIN_TIMES[-1] > 16.0
    times, dt_s = np.arange(1, 24_001) * 2e-3, 2e-3
    shown = np.array([strain_on(0.01, 0.0, 0, state, physics, dt_s) for _ in times])
    wanted = 0.01 * physics.delayed * (1.0 - np.exp(-np.sqrt(times / physics.delayed_s)))
    late = times > 0.3
    assert np.abs(shown - wanted)[late].max() < 0.08 * 0.01 * physics.delayed
    assert strain_on(0.01, 3.0 * physics.delayed, 0, np.zeros(STRAINS), physics, 1e9) == pytest.approx(
        4.0 * 0.01 * physics.delayed * sum(STRAIN_SHARES)
    )


def bent(angles, physics):
    state = np.zeros(CREASE_STATES)
    return np.array([crease_on(float(angle), 0, state, physics) for angle in angles])


def test_a_crease_is_elastic_and_then_gives_hardening_to_its_limit():
    physics = Physics()
    assert bent([0.7 * physics.crease_rad], physics) == pytest.approx([0.7])
    assert bent([0.9 * physics.crease_rad, 0.0], physics)[-1] == 0.0, "elastic: nothing stays"
    coarse, fine = (bent(np.linspace(0.0, 0.4, n + 1)[1:], physics) for n in (40, 20_000))
    assert coarse[-1] == pytest.approx(fine[-1], abs=2e-2), "no step counts"
    assert fine[-1] == pytest.approx(1.0 + physics.crease_more, rel=0.01)
    assert np.all(np.diff(fine) > -1e-12)
    plastic = np.linspace(0.0, 0.06, 6001)[1:]
    path = plastic - physics.crease_rad * bent(plastic, physics)
    hardened = 1.0 + physics.crease_more * (1.0 - np.exp(-path / physics.crease_fades_rad))
    given = path > 1e-4
    assert bent(plastic, physics)[given] == pytest.approx(hardened[given], rel=2e-3), "Armstrong and Frederick"


def test_creases_only_take_work_and_their_loop_is_of_the_path_alone():
    physics, random = Physics(), np.random.default_rng(2)
    path = np.concatenate([[0.0], np.cumsum(np.repeat(random.choice((-1.0, 1.0), 60), 40) * 5e-4), [0.0]])
    moments = bent(path, physics)
    taken = np.cumsum(0.5 * (moments[1:] + moments[:-1]) * np.diff(path))
    assert taken[-1] > 0.0
    turn = np.linspace(0.0, 6.0 * math.pi, 6001)
    loop = bent(0.1 * np.sin(turn), physics)
    last = slice(4000, 6001)
    assert np.sum(0.5 * (loop[1:] + loop[:-1])[4000:] * np.diff(0.1 * np.sin(turn))[4000:]) > 0.2
    assert loop[last].max() == pytest.approx(-loop[last].min(), rel=0.01)
    slow = bent(0.1 * np.sin(np.repeat(turn, 2)), physics)[::2]
    assert slow == pytest.approx(loop)


def test_side_seams_fold_to_a_zigzag_whose_bends_take_of_the_pull():
    physics = Physics()
    angle, sine = zigzag(0.9 * physics.pouch_m, physics.pouch_m)
    assert math.cos(angle) == pytest.approx(0.9)
    assert sine == pytest.approx(math.sin(angle))
    off = 1e-7
    per_length = (zigzag(0.9 * physics.pouch_m - off, physics.pouch_m)[0] - angle) / off
    moment = 1.3 * (physics.crease_nm + 0.2 * physics.crease_nm_mpa)
    assert crease_force(1.3, 0.2, sine, physics.pouch_m, physics) == pytest.approx(moment * per_length, rel=1e-4)
    assert zigzag(1.1 * physics.pouch_m, physics.pouch_m)[1] > 0.05


def muscle_at(rig, p=0.2):
    physics = Physics()
    return physics, rest(p, p, physics, rig)


def test_pouches_that_are_welded_shut_leave_more_to_the_others():
    physics, state = muscle_at(RIG)
    shut = RIG._replace(shut_1=0.1)
    _, fewer = muscle_at(shut)
    whole, less = pouch_length(0, state, physics, RIG), pouch_length(0, fewer, physics, shut)
    row = physics.pouches * whole
    assert 0.9 * physics.pouches * less + 0.1 * physics.pouches * physics.pouch_m == pytest.approx(row)
    forces = [muscle_force(-1.0, 0.0, 0, s, physics, r) for s, r in ((state, RIG), (fewer, shut))]
    assert forces[1] < 0.9 * forces[0]
    more = RIG._replace(stiff=0.5)
    _, both = muscle_at(more)
    assert muscle_force(-1.0, 0.0, 1, both, physics, more) == pytest.approx(
        1.5 * muscle_force(-1.0, 0.0, 1, state, physics, RIG), rel=1e-6
    )
    assert muscle_air(1, both, physics, more) == pytest.approx(1.5 * muscle_air(1, state, physics, RIG), rel=1e-6)


def test_sun_softens_film_slowly_fast_and_slowly_and_cold_film_is_stiffer():
    heat = RIG._replace(heat=1.0, heat_s=6.0)
    stiff = np.array([sun(t, 0.0, 0, heat) for t in np.linspace(0.0, 60.0, 121)])
    assert stiff[0] == sun(50.0, 1.0, 0, RIG) == 1.0
    assert np.all(np.diff(stiff) <= 0.0)
    assert stiff[-1] == pytest.approx(0.5, rel=0.01)
    assert np.argmax(-np.diff(stiff)) in range(6, 14), "by the middle"
    assert stiff[-1] < sun(60.0, 0.0, 1, heat) < 1.0
    assert sun(60.0, 0.0, 0, RIG._replace(heat=-0.5)) > 1.5


def test_a_weld_peels_beyond_its_strength_and_an_anchor_gives_late():
    physics, state = muscle_at(RIG)
    peel = RIG._replace(peel_mm_s=1.4, peel_muscle=1.0)
    for tension in (1400.0, 3000.0):
        for _ in range(1000):
            step_film(0, tension, state, physics, peel, 1e-3)
            step_film(1, tension, state, physics, peel, 1e-3)
        assert state[PEELED] == 0.0
        grown = state[VALVE_STATES + PEELED]
        assert grown == pytest.approx(0.0 if tension < 1500.0 else 1.4e-3 / physics.pouches)
    assert film_length(1, state, physics) > film_length(0, state, physics)
    anchor = RIG._replace(give_mm_n=0.01)
    for _ in range(4000):
        step_anchor(0, 200.0, state, anchor, STEP_S)
        step_anchor(1, 200.0, state, anchor, STEP_S)
    assert state[ANCHOR] == pytest.approx(-2e-3, rel=1e-3)
    assert state[VALVE_STATES + ANCHOR] == 0.0


def test_a_rig_at_rest_stays_there_and_its_pouches_are_in_balance():
    physics, state = muscle_at(RIG)
    assert abs(state[SPEED]) == 0.0
    tension = open_pouches(-1.0, 0.0, 0, 1, state, physics, RIG)
    assert 2000.0 < tension < 4500.0
    for _ in range(6000):
        step(0.2, 0.2, -1.0, 0.0, state, physics, RIG, STEP_S)
    assert abs(state[ANGLE]) < 0.02
    assert abs(state[SPEED]) < 1e-3
    assert state[AIR] == pytest.approx(0.3013, abs=0.0015)
