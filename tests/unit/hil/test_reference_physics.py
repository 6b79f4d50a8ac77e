"""The parts of the physics plants, each against its own law: orifices, muscles, friction, bearings, sensors."""

import math

import numpy as np
import pytest

from hil.reference.bellows.mechanics import (
    BREAK_AWAY,
    bulge,
    half_angle,
    pouch_force,
    pouch_volume,
    sliding,
)
from hil.reference.bellows.physics import Physics as BellowsPhysics
from hil.reference.bellows.pneumatics import conductance
from hil.reference.bundle.mechanics import ANGLE as BUNDLE_ANGLE
from hil.reference.bundle.mechanics import LATE_RAD, place, rubbed
from hil.reference.bundle.mechanics import STATES as BUNDLE_STATES
from hil.reference.bundle.mechanics import TAKEN as BUNDLE_TAKEN
from hil.reference.bundle.mechanics import dry_torque as bundle_dry_torque
from hil.reference.bundle.physics import Physics as BundlePhysics
from hil.reference.bundle.pneumatics import CHOKED_DROP, seat_flow
from hil.reference.bundle.sensing import mean_weights
from hil.reference.bundle.strands import bundle_force, cavity, invariant, strand_force
from hil.reference.families import disturbance
from hil.reference.fluidic.mechanics import muscle_force as fluidic_force
from hil.reference.fluidic.physics import Physics as FluidicPhysics
from hil.reference.fluidic.pneumatics import nozzle
from hil.reference.mckibben.mechanics import muscle_force
from hil.reference.mckibben.pneumatics import flow_function
from hil.reference.pleated.mechanics import AGE, SLIDE_RAD_S, STATES, dry_torque
from hil.reference.pleated.mechanics import muscle_force as pleated_force
from hil.reference.pleated.physics import Physics as PleatedPhysics
from hil.reference.pleated.pneumatics import parabola


@pytest.mark.parametrize(
    ("flow", "choked"),
    [(flow_function, 0.3), (nozzle, 0.528), (parabola, 0.5), (conductance, 0.36), (seat_flow, 1.0 - CHOKED_DROP)],
)
def test_flow_is_choked_below_the_critical_ratio_and_stops_at_equal_pressures(flow, choked):
    assert flow(0.1) == flow(choked) == 1.0
    assert flow(1.0) == flow(1.2) == 0.0
    assert flow(choked + 1e-3) == pytest.approx(1.0, abs=1e-3)
    assert 0.0 < flow(0.9) < flow(0.7) < 1.0


def test_orifices_are_those_of_the_books():
    assert flow_function(0.65) == pytest.approx(math.sqrt(0.75))
    assert nozzle(0.8) == pytest.approx(math.sqrt(0.8 ** (2 / 1.4) - 0.8 ** (2.4 / 1.4)) / 0.2588, rel=1e-3)
    expansion = 1.0 - 0.2 / (3.0 * CHOKED_DROP)
    by_standard = expansion * math.sqrt(0.2) / (2.0 / 3.0 * math.sqrt(CHOKED_DROP))
    assert seat_flow(0.8) == pytest.approx(by_standard), "IEC 60534-2-1, against its choked flow"


def test_muscle_pulls_in_proportion_to_pressure_and_never_pushes():
    assert muscle_force(0.2, 0.1, 0.436, 0.0125) == pytest.approx(2 * muscle_force(0.1, 0.1, 0.436, 0.0125))
    assert muscle_force(0.2, 0.6, 0.436, 0.0125) == 0.0
    physics = FluidicPhysics()
    assert (
        fluidic_force(0.2, 0.1, 0.0, physics)
        > fluidic_force(0.1, 0.1, 0.0, physics)
        > fluidic_force(0.1, 0.2, 0.0, physics)
    )
    assert fluidic_force(0.2, 0.6, 0.0, physics) == 0.0
    pleats = PleatedPhysics()
    assert pleated_force(0.2, 0.1, 0.0, pleats) == pytest.approx(2.0 * pleated_force(0.1, 0.1, 0.0, pleats))
    assert pleated_force(0.2, 0.21, 0.0, pleats) == pytest.approx(0.2 * pleats.strength_n_mpa)
    assert pleated_force(0.2, 0.5, 0.0, pleats) == 0.0


@pytest.mark.parametrize("contraction", [0.01, 0.08, 0.15, 0.25, 0.34])
def test_force_of_a_pouch_is_what_its_volume_gives_for_its_length(contraction):
    """Virtual work: force times length given up is pressure times volume won."""
    physics = BellowsPhysics(fold_n=0.0, stretch_per_mpa=0.0)
    t, at_zero = half_angle(contraction), bulge(half_angle(physics.contraction))
    assert 1.0 - math.sin(t) / t == pytest.approx(contraction, rel=1e-4)
    cubic_m_per_unit = 0.5 * physics.length_m * physics.pouch_n_mpa * at_zero / (1.0 - physics.dead_share)
    step = 1e-4
    high, low = (pouch_volume(half_angle(contraction + off), at_zero, physics)[0] for off in (step, -step))
    slope = pouch_volume(t, at_zero, physics)[1]
    assert (high - low) / (2.0 * step) == pytest.approx(slope, rel=2e-3)
    by_work = 0.2 * slope * cubic_m_per_unit / physics.length_m
    assert pouch_force(0.2, contraction, physics) == pytest.approx(by_work, rel=1e-6)


def test_folds_of_a_pouch_push_back_ever_more_and_a_muscle_never_pushes():
    physics = BellowsPhysics()
    free = physics._replace(fold_n=0.0)
    lost = [pouch_force(0.2, c, free) - pouch_force(0.2, c, physics) for c in (0.1, 0.2, 0.3)]
    assert 0.0 < lost[0] < lost[1] < lost[2]
    assert lost[2] - lost[1] > lost[1] - lost[0]
    assert pouch_force(0.2, 0.5, physics) == pouch_force(0.0, 0.15, physics) == 0.0


@pytest.mark.parametrize("contraction", [0.02, 0.08, 0.16, 0.19])
def test_force_of_a_strand_is_the_work_of_its_air_less_the_energy_of_its_bladder(contraction):
    """Virtual work, with the energies differentiated here: pressure times volume, and Gent's rubber."""
    physics, step, pressure_mpa = BundlePhysics(), 1e-5, 0.2
    stretches = 1.0 - contraction + step, 1.0 - contraction - step

    def energy(stretch: float) -> float:
        used = (invariant(stretch, physics)[0] - 3.0) / physics.rubber_limit
        rubber = -0.5 * physics.rubber_mpa * physics.rubber_limit * math.log(1.0 - used) * physics.wall
        return rubber - pressure_mpa * cavity(stretch, physics)[0]

    longer, shorter = (energy(stretch) for stretch in stretches)
    by_work = physics.area_n_mpa * (longer - shorter) / (2.0 * step)
    assert strand_force(pressure_mpa, contraction, physics) == pytest.approx(by_work, rel=1e-5)


def test_a_thin_strand_without_thickness_and_rubber_is_the_ideal_braid():
    physics = BundlePhysics(yarn=0.0, wall=0.0, jam_n=0.0)
    radius_m = math.sqrt(physics.area_n_mpa * 1e-6 / math.pi)
    ideal = muscle_force(0.2, 0.12, physics.braid_rad, radius_m)
    assert strand_force(0.2, 0.12, physics) == pytest.approx(ideal, rel=1e-9)


def test_strands_pull_one_after_another_jam_and_never_push():
    physics = BundlePhysics()
    even = physics._replace(uneven=0.0)
    assert bundle_force(0.2, 0.16, 0.0, even) == pytest.approx(strand_force(0.2, 0.16, even))
    ends = [c for c in np.linspace(0.1, 0.4, 301) if bundle_force(0.05, c, 0.0, even) == 0.0]
    assert bundle_force(0.05, ends[0], 0.0, physics) > 0.0, "where even strands have ended the shortest still pull"
    assert bundle_force(0.2, 0.6, 0.0, physics) == bundle_force(0.0, 0.16, 0.0, physics) == 0.0
    whole, short = bundle_force(0.2, 0.16, 0.0, physics), bundle_force(0.2, 0.16, 0.2, physics)
    assert short < 0.8 * whole, "the shortest are torn first, and they carry the most"
    free = physics._replace(jam_n=0.0)
    lost = [strand_force(0.2, c, free) - strand_force(0.2, c, physics) for c in (0.19, 0.22, 0.24)]
    assert lost[0] == 0.0 < lost[1] < lost[2]


def test_friction_of_yarns_closes_its_loops_and_forgets_them():
    state = np.zeros(BUNDLE_STATES)
    path = [*np.linspace(0.0, 6.0, 61), *np.linspace(6.0, -6.0, 121)]
    before = [rubbed(float(x), state) for x in path]
    assert before[60] == pytest.approx(6.0 / 7.0), "the hyperbola"
    assert before[-1] == pytest.approx(-before[60]), "Masing: the way back is twice as wide"
    inner = [rubbed(float(x), state) for x in (*np.linspace(-6.0, 1.0, 71), *np.linspace(1.0, -2.0, 31), 1.0)]
    assert inner[-1] == pytest.approx(inner[70]), "a small loop closes where it began"
    top = [rubbed(float(x), state) for x in np.linspace(1.0, 6.0, 51)]
    assert top[-1] == pytest.approx(before[60]), "and leaves no trace on the large one"


def test_a_tight_bearing_holds_more_when_it_sets_out_than_later():
    state = np.zeros(BUNDLE_STATES)
    first = [-bundle_dry_torque(1.0, 1e-5, state) for _ in range(4000)]
    assert max(first) > 1.05
    later = [-bundle_dry_torque(1.0, LATE_RAD, state) for _ in range(20)]
    assert later[-1] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("angle", [-0.6, -0.1, 0.0, 0.4])
def test_a_pulley_off_its_centre_pulls_by_the_belt_that_it_takes_up(angle):
    wrong = disturbance("bundle", {"pulley_off_centre": 0.2}).rig
    taken, step = [], 1e-5
    state = np.zeros(BUNDLE_STATES)
    for off in (-step, step, 0.0):
        state[BUNDLE_ANGLE] = angle + off
        place(state, BundlePhysics(), wrong)
        taken.append(state[BUNDLE_TAKEN : BUNDLE_TAKEN + 2].copy())
    slope = (taken[1] - taken[0]) / (2.0 * step)
    arms = state[BUNDLE_TAKEN + 2 : BUNDLE_TAKEN + 4]
    assert slope == pytest.approx([arms[0], -arms[1]], rel=1e-6)


@pytest.mark.parametrize("window_s", [0.0005, 0.004, 0.013, 0.05])
def test_a_mean_over_a_window_is_late_by_half_of_it(window_s):
    weights = mean_weights(window_s, 0.005)
    assert weights.sum() == pytest.approx(1.0)
    assert 0.005 * float(np.sum(weights * np.arange(len(weights)))) == pytest.approx(0.5 * window_s)


def test_elasto_plastic_friction_is_a_spring_below_break_away():
    steady = 0.004
    assert sliding(0.99 * BREAK_AWAY * steady, 1.0, steady) == 0.0
    assert sliding(steady, 1.0, steady) == 1.0
    assert sliding(steady, -1.0, steady) == 0.0, "on the way back it is a spring again"
    assert 0.0 < sliding(0.8 * steady, 1.0, steady) < sliding(0.9 * steady, 1.0, steady) < 1.0


@pytest.mark.parametrize("free", [1e-9, 1e-4, 0.1, 5.0])
def test_rate_and_state_friction_solves_its_own_equation(free):
    """The joint's speed after the step and the torque that the law has at that speed belong together."""
    level, inertia, dt_s = 2.0, 0.01, 5e-4
    state = np.zeros(STATES)
    state[AGE] = 1.0  # at rest for the time that it takes to slide the critical length at the reference speed
    torque = dry_torque(free, level, inertia, state, dt_s)
    speed = free - dt_s / inertia * torque
    by_law = 0.04 * level * math.asinh(max(speed, 0.0) / (2.0 * SLIDE_RAD_S) * math.exp(25.0))
    assert 0.0 <= torque <= inertia * free / dt_s
    assert by_law == pytest.approx(torque, rel=1e-3, abs=1e-6 + inertia * 1e-9 / dt_s)
