"""The parts of the sixth family of physics plants, each against its own law."""

import math

import numpy as np
import pytest

from hil.reference.sleeve.disturbance import HEALTHY, ReadingLaw
from hil.reference.sleeve.mechanics import (
    CENTRES,
    SLIP_RAD,
    SPACING_M,
    SPEED,
    STATES,
    STRIBECK,
    WIDTHS,
    dry_torque,
    flexure_torque,
    sector,
    turned_over,
)
from hil.reference.sleeve.physics import Physics
from hil.reference.sleeve.pneumatics import CRITICAL, filter_flow, ideal, sharp_edge, step_air
from hil.reference.sleeve.regulator import AIR, EDDY, MASS, through_core
from hil.reference.sleeve.sensing import BESSEL, coded, saturated, second_order, with_jumping_play
from hil.reference.sleeve.sleeves import (
    arc_volume,
    flow_rate,
    flowing_force,
    length_slope,
    middle_bulge,
    opened,
    pull_area,
    rubber_force,
)

RADIUS_M, RING_M = 0.01, 0.03


@pytest.mark.parametrize("t", [0.3, 0.7, 0.95, 1.3, 1.9])
def test_pull_of_a_sleeve_is_the_volume_that_it_gains_for_its_length(t):
    step = 1e-5
    gained = arc_volume(t + step, RADIUS_M, RING_M) - arc_volume(t - step, RADIUS_M, RING_M)
    shorter = RING_M * (math.sin(t - step) / (t - step) - math.sin(t + step) / (t + step))
    assert pull_area(t, RADIUS_M, RING_M) == pytest.approx(gained / shorter, rel=1e-6)
    assert length_slope(t) == pytest.approx(shorter / (2.0 * step * RING_M), rel=1e-6)


def test_a_sleeve_is_a_turned_arc():
    t = 0.9
    arc_m = 0.5 * RING_M / t
    x = np.linspace(-arc_m * math.sin(t), arc_m * math.sin(t), 20_001)
    radius = RADIUS_M + np.sqrt(arc_m**2 - x**2) - arc_m * math.cos(t)
    assert arc_volume(t, RADIUS_M, RING_M) == pytest.approx(np.trapezoid(math.pi * radius**2, x), rel=1e-6)
    assert middle_bulge(t, RING_M)[0] == pytest.approx(radius.max() - RADIUS_M, rel=1e-6)
    assert opened(1.0 - math.sin(t) / t, 0.5, 8) == pytest.approx(t)


@pytest.mark.parametrize("t", [0.5, 0.9, 1.3])
def test_rubber_pushes_back_by_the_energy_of_its_hoops(t):
    def energy(half: float) -> float:
        u = np.linspace(-1.0, 1.0, 4001)
        arc_m = 0.5 * RING_M / half
        stretch = 1.0 + arc_m / RADIUS_M * (np.cos(u * half) - math.cos(half))
        return 2.0 * math.pi * RADIUS_M * 55.0 * arc_m * half * np.trapezoid((stretch - 1.0 / stretch) ** 2, u)

    step = 1e-4
    by_energy = (energy(t + step) - energy(t - step)) / (2.0 * step) / (RING_M * length_slope(t))
    assert rubber_force(t, RADIUS_M, RING_M, 55.0) == pytest.approx(by_energy, rel=0.01)


def test_rubber_flows_until_nothing_is_left_and_much_slower_towards_the_end():
    strain = middle_bulge(0.9, RING_M)[0] / RADIUS_M
    assert flowing_force(0.9, strain, RADIUS_M, RING_M, 5.0) == pytest.approx(0.0, abs=1e-12)
    assert flowing_force(1.0, strain, RADIUS_M, RING_M, 5.0) > 0.0 > flowing_force(0.8, strain, RADIUS_M, RING_M, 5.0)
    assert flow_rate(0.1) == pytest.approx(8.0 * flow_rate(0.05)) == -flow_rate(-0.1)


def test_a_sharp_edge_lets_more_through_below_the_critical_ratio_too():
    assert sharp_edge(1.0) == sharp_edge(1.2) == 0.0
    assert 1.001 > sharp_edge(0.0) > 0.999 > sharp_edge(0.3) > sharp_edge(0.5) > sharp_edge(0.9) > 0.0
    assert ideal(CRITICAL) == pytest.approx(0.2588, rel=1e-4), "Saint-Venant and Wantzel's peak at k = 1.4"
    discharge = sharp_edge(0.98) * 0.8414 * 0.2588 / ideal(0.98)
    assert discharge == pytest.approx(0.61, abs=0.01), "of water's 0.6 where hardly anything expands"
    assert sharp_edge(0.99) == pytest.approx(sharp_edge(0.985) * 10.0 / 15.0), "in proportion near equal pressures"


def test_a_sintered_filter_is_darcys_and_forchheimers():
    physics = Physics()
    flow = filter_flow(0.32, 0.30, physics)
    assert physics.darcy * flow + physics.forchheimer * flow**2 == pytest.approx(0.32**2 - 0.30**2)
    assert filter_flow(0.30, 0.32, physics) == -flow
    assert filter_flow(0.3, 0.3, physics) == 0.0


@pytest.mark.parametrize(("walls_s", "power"), [(1e6, 1.4), (1e-3, 1.0)])
def test_air_is_compressed_without_heat_when_quick_and_without_warming_when_slow(walls_s, power):
    physics, state = Physics(walls_s=walls_s), np.zeros(STATES)
    state[AIR] = state[MASS] = 0.3
    for volume in np.linspace(1.0, 0.8, 20_001)[1:]:
        step_air(0.0, 0.0, volume, -0.2, state, 0, physics, 1.0 / 20_000)
    assert state[AIR] * 0.8**power == pytest.approx(0.3, rel=2e-3)
    assert state[MASS] == 0.3


def test_flux_in_a_solid_core_is_late_by_what_is_said():
    state, step_s = np.zeros(STATES), 1e-4
    flux = np.array([through_core(1.0, 0, state, 0.05, step_s) for _ in range(20_000)])
    assert step_s * np.sum(1.0 - flux) == pytest.approx(0.05, rel=0.03)
    assert 0.05 < flux[0] < 0.2, "its skin follows at once"
    assert state[EDDY] == pytest.approx(1.0)


def test_hysteresis_along_the_stroke_rubs_by_its_level_and_remembers():
    state, scale_m = np.zeros(CENTRES * WIDTHS), 0.004
    path_m = np.concatenate([np.linspace(0.0, 0.03, 301), np.linspace(0.03, -0.03, 601), np.linspace(-0.03, 0.03, 601)])
    held = np.array([turned_over(float(x), 0, state, scale_m) for x in path_m])
    falling, rising = held[301:902], held[902:]
    middle = np.abs(path_m[902:]) < SPACING_M
    half_loop = 0.5 * (rising - falling[::-1])
    assert np.mean(half_loop[middle]) == pytest.approx(1.0, abs=0.05)
    assert half_loop[0] == half_loop[-1] == 0.0, "both ways meet where every element has turned over"
    inner = [
        turned_over(float(x), 0, state, scale_m) for x in (*np.linspace(0.03, 0.0, 301), *np.linspace(0.0, 0.004, 41))
    ]
    again = [turned_over(float(x), 0, state, scale_m) for x in np.linspace(0.004, 0.0, 41)]
    assert again[-1] == pytest.approx(inner[300]), "a small loop closes where it began"


def test_a_bushing_is_a_spring_then_slides_and_holds_less_at_speed():
    state = np.zeros(STATES)

    def moved(speed: float, seconds: float) -> float:
        state[SPEED] = speed
        return [-dry_torque(1.0, state, 1e-4) for _ in range(round(seconds / 1e-4))][-1]

    near = 0.5 * SLIP_RAD[0]
    assert moved(0.01, near / 0.01) == pytest.approx(
        sum(share * near / rad for share, rad in zip((0.15, 0.25, 0.3, 0.3), SLIP_RAD, strict=True))
    )
    assert moved(-0.01, near / 0.01) == pytest.approx(0.0, abs=1e-9)
    slow = moved(0.001, 40.0)
    assert slow == pytest.approx(1.0 + STRIBECK, rel=0.01)
    assert moved(3.0, 0.3) == pytest.approx(1.0, rel=0.01)
    back = moved(-0.01, 0.05)
    assert back < moved(-0.01, 0.5) + 1.0, "turned round it is a spring again"


def test_sectors_take_up_what_their_arm_says_and_flexures_give_way_under_load():
    physics, step = Physics(), 1e-6
    for turn in (-0.6, 0.0, 0.7):
        slope = (sector(turn + step, physics)[0] - sector(turn - step, physics)[0]) / (2.0 * step)
        assert sector(turn, physics)[1] == pytest.approx(slope, rel=1e-6)
    free, loaded = (flexure_torque(0.3, load_n, 0.0, physics) for load_n in (0.0, 0.5 * physics.buckle_n))
    assert loaded == pytest.approx(0.5 * free)
    assert free < 0.0, "it pulls back"
    assert flexure_torque(0.3, 0.0, 0.1, physics) < free, "a frame that has grown tightens them"
    assert flexure_torque(0.9, 0.0, 0.0, physics) < 3.0 * free, "ever stiffer"


@pytest.mark.parametrize("lag_s", [0.001, 0.02, 0.2])
def test_bessels_filter_is_late_by_what_is_said(lag_s):
    ramp = np.arange(4000) * 0.005
    for section in BESSEL:
        ramp = second_order(ramp, lag_s, *section, 0.005)
    assert 3999 * 0.005 - ramp[-1] == pytest.approx(lag_s, rel=1e-3)


def test_a_loose_magnet_follows_at_the_edge_of_its_clearance_and_jumps():
    angle = np.concatenate([np.linspace(0.0, 10.0, 1001), np.linspace(10.0, 0.0, 1001)])
    place = with_jumping_play(angle, 1.0, 0.1)
    assert set(np.round(np.unique(np.diff(place[:1000])), 2)) >= {0.0, 0.1}
    assert 0.89 < np.abs(angle - place)[500:1000].min() < np.abs(angle - place).max() < 1.02


def test_coarse_codes_of_the_field_are_wider_when_it_is_turned():
    read = np.unique(np.round(coded(np.linspace(-60.0, 60.0, 24_001), ReadingLaw(step_deg=2.0)), 9))
    assert np.diff(read)[len(read) // 2] == pytest.approx(2.0, rel=0.01)
    assert np.diff(read)[-2] > 2.5
    assert saturated(np.array([0.0, 40.0]), 0.2) == pytest.approx([0.0, -1.0])
    assert HEALTHY.reading == ReadingLaw()
