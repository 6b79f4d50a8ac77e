"""Broadband noise beside a simulator, which tells of none: a gap where it is louder than healthy rigs are, and none
where it is as loud; and what healthy rigs have is found again from rigs whose noise is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.plants.gap_rigs import model, session

from rig.app.gap.study.noise import HeardNoise, fit_noise, heard_noise
from rig.gap import diagnose
from rig.gap.answer.result import Diagnosis
from rig.gap.priors import UsualNoise, fitted
from rig.log.reader import read
from rig.model.parameters import AddedEffect, Model

FEW = ("sensor_noise", "valve_lag", "sensor_lag")


def usual() -> UsualNoise:
    known = fitted().noise
    assert known is not None
    return known


def asked(std_deg: float, simulator: Model | None = None) -> Diagnosis:
    """What is said of a rig whose sensor is louder by so much than the 0.03 deg that it has, beside its simulator."""
    noise = [AddedEffect("sensor_noise", {"std_deg": std_deg})] if std_deg else []
    return diagnose(simulator or model(), session(71, *noise), library=list(FEW), reference="simulator")


@pytest.mark.parametrize("std_deg", [0.3, 1.0])
def test_a_simulator_lacks_noise_that_healthy_rigs_have_not(std_deg: float) -> None:
    found = asked(std_deg)
    (cause,) = found.causes
    assert cause.effect == "sensor_noise"
    assert cause.parameters["std_deg"].value == pytest.approx(std_deg, rel=0.1)
    assert cause.parameters["std_deg"].low < std_deg < cause.parameters["std_deg"].high


@pytest.mark.parametrize("std_deg", [0.0, 0.06])
def test_as_much_noise_as_healthy_rigs_have_is_none(std_deg: float) -> None:
    found = asked(std_deg)
    assert found.verdict == "none"
    assert not [one for one in found.observations if one.effect == "sensor_noise"]


def test_a_simulator_that_has_that_noise_lacks_none() -> None:
    assert asked(0.5).causes
    noisy = replace(model(), effects=[AddedEffect("sensor_noise", {"std_deg": 0.5})])
    assert not [cause for cause in asked(0.5, noisy).causes if cause.effect == "sensor_noise"]


def test_the_noise_of_builds_is_found_again() -> None:
    random = np.random.default_rng(3)
    logs = np.log(4e-4) + 0.5 * random.standard_normal((400, 1)) + 0.2 * random.standard_normal((400, 5))
    found = fit_noise([[HeardNoise(60.0 * share, 60.0) for share in units] for units in np.exp(logs).tolist()])
    assert found.share == pytest.approx(4e-4, rel=0.1)
    assert found.span_deg == pytest.approx(60.0)
    assert found.spread == pytest.approx(np.hypot(0.5, 0.2), rel=0.1)


def test_of_few_builds_the_spread_is_wider() -> None:
    few = [[HeardNoise(0.01, 60.0)], [HeardNoise(0.04, 60.0)]]
    many = few * 40
    assert fit_noise(few).spread > 1.5 * fit_noise(many).spread


@pytest.mark.parametrize("unit", ["unit_a", "unit_b"])
def test_a_healthy_rig_of_another_build_is_about_as_loud_as_is_usual(shared: Path, unit: str) -> None:
    day = shared / "practice" / unit / "baseline_1"
    if not day.is_dir():
        pytest.skip("the practice set is not part of the project")
    heard = heard_noise(read(day))
    assert abs(np.log(heard.noise_deg / usual().level_deg(heard.span_deg))) < 2.0 * usual().spread


def test_records_that_hardly_move_are_read_by_no_quieter_sensor() -> None:
    assert usual().level_deg(3.0) == usual().level_deg(usual().span_deg)
    assert usual().level_deg(200.0) == pytest.approx(200.0 * usual().share)
