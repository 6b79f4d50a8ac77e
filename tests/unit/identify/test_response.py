"""The response model is found again from data that it made itself, and predicts what it was not fitted to."""

import numpy as np
import pytest

from rig.identify.response.response_fit import (
    Drive,
    RegulatorRecord,
    corrected_misfit_mpa,
    fit_balance,
    fit_bank,
    fit_mean_exponent,
    fit_regulator,
    fit_response,
    mean_pressure_moves,
)
from rig.model.compiled.response import RESPONSE_TERMS, regulated
from rig.model.response.model import REGULATOR_TERMS, Balance, ResponseModel
from rig.record import Column

DT_S = 0.01
REGULATORS = ((0.02, 0.05, 0.08), (0.01, 0.04, 0.03))
JOINT = Balance(0.04, 0.03, (0.2, 0.1, 0.1, 0.0, 0.0), (200.0, 0.0, -100.0))
WEIGHTS = np.zeros(RESPONSE_TERMS)
WEIGHTS[[0, 4, 5, 13, 15]] = (0.5, 30.0, 100.0, 40.0, 50.0)
TRUTH = ResponseModel(0.2, REGULATORS, WEIGHTS, JOINT, 0.0)


def set_points(frequency_hz: float, p0_mpa: float = 0.2) -> tuple[Column, Column]:
    half = 0.1 * np.sin(2 * np.pi * frequency_hz * DT_S * np.arange(1500))
    return p0_mpa + half, p0_mpa - half


def made(truth: ResponseModel, frequency_hz: float, p0_mpa: float = 0.2, noise_deg: float = 0.0) -> Drive:
    p1, p2 = truth.pressures(*set_points(frequency_hz, p0_mpa), DT_S)
    noise = np.random.default_rng(int(100 * frequency_hz)).normal(0.0, noise_deg, len(p1))
    return Drive(DT_S, p1, p2, truth.angle(p1, p2, DT_S) + noise, np.ones(len(p1)))


@pytest.mark.parametrize("skipped", [0, 500])
@pytest.mark.parametrize("truth", REGULATORS)
def test_a_regulator_is_found_again(truth: tuple[float, float, float], skipped: int) -> None:
    rng = np.random.default_rng(1)
    lines = []
    for frequency in (0.2, 0.5, 0.8):
        u, _ = set_points(frequency)
        used = (np.arange(len(u)) >= skipped).astype(float)
        lines.append(RegulatorRecord(DT_S, u, regulated(u, *truth, DT_S) + 0.01 + rng.normal(0.0, 2e-4, len(u)), used))
    found = fit_regulator(lines)
    assert found == pytest.approx(truth, abs=2e-3), "a monitor's offset changes nothing"
    none = np.zeros(REGULATOR_TERMS)
    assert corrected_misfit_mpa(lines, found, none, TRUTH.p0_mpa) == pytest.approx(2e-4, rel=0.05)


def test_the_bank_is_found_again_and_predicts_another_sweep() -> None:
    weights, misfit = fit_bank([made(TRUTH, frequency, noise_deg=0.05) for frequency in (0.2, 0.5, 0.8)], 0.2)
    assert misfit == pytest.approx(0.05, rel=0.05)
    new = made(TRUTH, 0.35)
    said = ResponseModel(0.2, REGULATORS, weights, JOINT, misfit).angle(new.p1_mpa, new.p2_mpa, DT_S)
    assert np.sqrt(np.mean((said - new.angle_deg) ** 2)) < 0.05, "of an angle of 40 deg"


def test_rows_that_do_not_count_change_nothing() -> None:
    record = made(TRUTH, 0.5)
    spoilt, used = record.angle_deg.copy(), record.used.copy()
    spoilt[700:800], used[700:800] = 500.0, 0.0
    weights, _ = fit_bank([record], 0.2)
    without, misfit = fit_bank([Drive(DT_S, record.p1_mpa, record.p2_mpa, spoilt, used)], 0.2)
    assert misfit < 0.01
    angles = [
        ResponseModel(0.2, REGULATORS, each, JOINT, 0.0).angle(record.p1_mpa, record.p2_mpa, DT_S)
        for each in (weights, without)
    ]
    assert np.abs(angles[0] - angles[1]).max() < 0.05


@pytest.mark.parametrize("exponent", [0.4, 1.0, 1.6])
def test_the_law_of_the_mean_pressure_is_found_where_it_shows(exponent: float) -> None:
    truth = ResponseModel(0.2, REGULATORS, WEIGHTS, JOINT, 0.0, exponent)
    records = [made(truth, frequency, p0, 0.02) for frequency in (0.3, 0.7) for p0 in (0.15, 0.2, 0.3)]
    assert fit_mean_exponent(records, 0.2) == pytest.approx(exponent, abs=0.02)
    found = fit_response(records, 0.2, REGULATORS, exponent)
    assert found.exponent == exponent
    assert found.misfit_deg < 0.1


@pytest.mark.parametrize(("shift", "shown"), [(0.009, False), (0.011, True)])
def test_a_mean_pressure_counts_as_moving_from_five_percent_of_p0_on(shift: float, shown: bool) -> None:
    assert mean_pressure_moves([np.full(100, 0.2), np.full(100, 0.2 + shift)], 0.2) is shown


def test_the_joints_balance_is_found_again() -> None:
    """Angles of the balance itself: friction-free equilibrium, pushed through Maxwell-slip elements, viscous friction
    and inertia."""
    free = ResponseModel(0.2, REGULATORS, WEIGHTS, Balance(0.0, 0.0, (0.0,) * 5, JOINT.curve), 0.0)
    records = []
    for frequency in (0.1, 0.3, 0.9):
        p1, p2 = free.pressures(*set_points(frequency), DT_S)
        still = np.zeros(len(p1))
        angle = ResponseModel(0.2, REGULATORS, WEIGHTS, JOINT, 0.0).balanced(
            still, free.equilibrium(p1, p2), still + 1.0, DT_S
        )
        records.append(Drive(DT_S, p1, p2, angle, np.ones(len(p1))))
    found = fit_balance(records, 0.2)
    assert found.viscous_s == pytest.approx(JOINT.viscous_s, abs=0.004)
    assert found.inertia_s == pytest.approx(JOINT.inertia_s, abs=0.01)
    assert sum(found.slip) == pytest.approx(sum(JOINT.slip), abs=0.1)
    assert found.curve[0] == pytest.approx(JOINT.curve[0], rel=0.03)
