"""What stands in one place: set-points about P0, the drive by both pressures, the joint's balance, rms and noise."""

import math

import numpy as np
import pytest

from rig.columns import rms, white_noise
from rig.excite.setpoints import around
from rig.model.chain import place_effect
from rig.model.compiled.columns import Joint, balanced, drive
from rig.model.compiled.stages import compiled
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.equations import stages
from rig.model.equations.drive import mean_pressure_factor
from rig.model.equations.joint_balance import LOOP_RADII_DEG
from rig.model.parameters import AddedEffect
from rig.model.response.model import Balance

ANGLE = 15.0 * np.sin(np.linspace(0.0, 12.0, 2400))
WEIGHTS = (0.2, 0.1, 0.1, 0.05, 0.02)
SMOOTH = (0.0,) * len(WEIGHTS)
FREE = np.zeros(len(ANGLE)), np.ones(len(ANGLE))


def test_a_difference_splits_in_halves_about_p0() -> None:
    assert around(0.2, 0.1) == pytest.approx((0.25, 0.15))
    p1, p2 = around(0.2, np.array([0.1, -0.2]))
    assert p1 - p2 == pytest.approx([0.1, -0.2])
    assert p1 + p2 == pytest.approx([0.4, 0.4])


@pytest.mark.parametrize(("exponent", "factor"), [(0.0, 1.0), (1.0, 0.5), (2.0, 0.25)])
def test_the_drive_falls_with_the_mean_pressure(exponent: float, factor: float) -> None:
    p1, p2 = np.array([0.45]), np.array([0.35])
    assert mean_pressure_factor(0.45, 0.35, 0.2, exponent) == pytest.approx(factor)
    assert drive(p1, p2, 0.2, exponent) == pytest.approx(0.1 * factor)


def test_empty_muscles_have_a_finite_drive() -> None:
    assert mean_pressure_factor(0.0, 0.0, 0.2, 1.0) == pytest.approx(10.0)


def test_the_muscle_of_the_model_is_driven_by_that_drive() -> None:
    p1, p2 = 0.3 + 0.1 * np.sin(ANGLE), 0.3 - 0.05 * np.sin(ANGLE)
    params = (0.9, 0.9, 0.1, 0.0, 0.01, 0.0, -0.002, 0.0, 0.005, 1.0, 1.0, 1.0, 0.2)
    plain, scaled = np.zeros(len(p1)), np.zeros(len(p1))
    stages.modified_bouc_wen(p1, p2, plain, [0.0] * 3, params, 0.005)
    d = drive(p1, p2, 0.2, 1.0)
    compiled(stages.modified_bouc_wen)(
        0.2 + d / 2, 0.2 - d / 2, scaled, np.zeros(3), np.array((*params[:11], 0.0, 0.2)), 0.005
    )
    assert scaled == pytest.approx(plain, rel=1e-9, abs=1e-9)


def test_a_balance_with_nothing_changed_is_the_angle_itself() -> None:
    assert balanced(ANGLE, *FREE, Joint(0.02, 0.01, WEIGHTS), 0.005) == pytest.approx(ANGLE, abs=1e-5)


def test_without_friction_an_offset_of_the_equilibrium_turns_the_joint_by_as_much() -> None:
    offset = np.full(len(ANGLE), 3.0)
    assert balanced(ANGLE, offset, FREE[1], Joint(0.0, 0.0, SMOOTH), 0.005) == pytest.approx(ANGLE + 3.0, abs=1e-6)


def test_friction_that_counts_more_holds_the_joint_back() -> None:
    stiffer = balanced(ANGLE, FREE[0], 2.0 * FREE[1], Joint(0.0, 0.0, WEIGHTS), 0.005)
    assert np.ptp(stiffer[1200:]) < np.ptp(ANGLE[1200:]) - 1.0


def test_the_effect_of_viscous_friction_is_the_same_balance() -> None:
    """A viscous time added by the effect or put into the nominal joint by its ratio: one equation."""
    entry = EFFECT_STAGES["viscous_friction"]
    numbers = (
        entry.neutral()
        | {"tau_s": 0.05, "viscous_time_s": 0.05}
        | {f"loop_{j + 1}": 0.0 for j in range(len(LOOP_RADII_DEG))}
    )
    added, pressure = ANGLE.copy(), np.full(len(ANGLE), 0.2)
    params = np.array([numbers[name] for name in entry.parameters])
    compiled(entry.stage)(pressure, pressure.copy(), added, np.zeros(entry.state_size), params, 0.005)
    doubled = balanced(ANGLE, FREE[0], 2.0 * FREE[1], Joint(0.05, 0.0, SMOOTH), 0.005)
    assert added == pytest.approx(doubled, abs=1e-6)


CURVE = (180.0, 60.0, -400.0)
"""deg/MPa, deg/MPa^2, deg/MPa^3: steeper on one side, and flat towards both ends."""


@pytest.mark.parametrize("drive_mpa", [-0.1, -0.05, 0.0, 0.05, 0.1])
def test_a_torque_turns_the_joint_as_far_as_a_change_of_the_drive_does_there(drive_mpa: float) -> None:
    first, second, third = CURVE
    angle_deg = drive_mpa * (first + drive_mpa * (second + drive_mpa * third))
    steeper = (first + drive_mpa * (2.0 * second + drive_mpa * 3.0 * third)) / first
    entry, own = EFFECT_STAGES["gravity_load"], Balance(0.0, 0.0, SMOOTH, CURVE).stage_numbers()
    hanging = {"load_deg": 0.1, "phase_deg": 90.0 - angle_deg}
    numbers = entry.neutral() | own | hanging
    turned, pressure = np.full(10, angle_deg), np.full(10, 0.2)
    params = np.array([numbers[name] for name in entry.parameters])
    compiled(entry.stage)(pressure, pressure.copy(), turned, np.zeros(entry.state_size), params, 0.005)
    assert (angle_deg - turned) / 0.1 == pytest.approx(steeper, rel=0.03)


def test_a_curve_without_a_slope_leaves_the_joint_as_soft_everywhere() -> None:
    assert not {"softer", "softer_out"} & set(Balance(0.0, 0.0, SMOOTH, (0.0, 5.0, 5.0)).stage_numbers())


def test_rms_counts_rows_by_their_weight() -> None:
    assert rms(np.array([3.0, -3.0])) == 3.0
    assert rms(np.array([3.0, 100.0]), np.array([1.0, 0.0])) == 3.0
    assert math.isnan(rms(np.zeros(0)))
    assert math.isnan(rms(np.ones(2), np.zeros(2)))


def test_white_noise_is_found_under_motion_jumps_and_repeats() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.03, len(ANGLE))
    jumped = ANGLE + noise
    jumped[::400] += 5.0
    assert white_noise([jumped]) == pytest.approx(0.03, rel=0.1)
    repeated = ANGLE + noise
    repeated[5::5] = repeated[4:-1:5]
    assert white_noise([repeated], without_repeats=True) == pytest.approx(0.03, rel=0.1)


def test_a_model_of_before_may_call_a_parameter_by_its_former_name() -> None:
    size = EFFECT_STAGES["viscous_friction"].size
    placed = [
        place_effect(AddedEffect("viscous_friction", {size: 0.1, name: 0.05}), {})
        for name in ("drag_s", "viscous_time_s")
    ]
    assert placed[0] == placed[1]
