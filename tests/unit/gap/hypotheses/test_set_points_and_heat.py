"""Stages that stand on the set-points, and the heat of muscles that work: what physics says they must do."""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from rig.model.effect_stages import EFFECT_STAGES
from rig.model.effect_stages.muscle import HEATING_MPA_S

DT = 0.005


def through(stage: str, numbers: Mapping[str, float], p1_mpa: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Both pressures behind a stage in plain Python; the second is 0.4 MPa less the first."""
    known = EFFECT_STAGES[stage]
    p1, p2 = list(p1_mpa), [0.4 - one for one in p1_mpa]
    every = known.neutral() | dict(numbers)
    params = [every[name] for name in known.parameters]
    known.stage(p1, p2, [0.0] * len(p1), [0.0] * known.state_size, params, DT)
    return np.array(p1), np.array(p2)


def step(before: float, after: float, rows: int = 400) -> list[float]:
    return [before] + [after] * (rows - 1)


@pytest.mark.parametrize("brakes_s", [0.0, 0.04, 0.3])
@pytest.mark.parametrize("after", [0.1, 0.3])
def test_a_ramp_goes_at_its_rate_and_arrives_without_going_beyond(brakes_s: float, after: float) -> None:
    p1, p2 = through("set_point_ramp", {"rate_mpa_s": 0.2, "brakes_s": brakes_s}, step(0.2, after))
    speed, beyond = np.abs(np.diff(p1)) / DT, np.sign(after - 0.2) * (p1 - after)
    assert 0.15 < speed.max() <= 0.2 + 1e-9
    assert beyond.max() <= 1e-3
    assert p1[-1] == pytest.approx(after, abs=1e-4)
    assert p2 == pytest.approx(0.4 - p1)
    if brakes_s:
        assert np.abs(np.diff(speed)).max() <= 0.2 / brakes_s * DT * 1.05


def test_a_ramp_leaves_what_is_slower_than_it_alone() -> None:
    slow = 0.2 + 0.05 * np.sin(2.0 * np.pi * 0.2 * DT * np.arange(2000))
    assert through("set_point_ramp", {"rate_mpa_s": 0.07}, slow)[0] == pytest.approx(slow, abs=1e-12)
    late = through("set_point_ramp", {"rate_mpa_s": 0.3, "brakes_s": 0.1}, slow)[0]
    assert np.max(np.abs(late - slow)) < 0.1 * 0.05


def test_a_signal_volume_is_a_low_pass_for_small_changes_and_later_for_large_ones() -> None:
    time_s = DT * np.arange(400)
    laminar = {"signal_s": 0.1, "turbulent_mpa_s": 1000.0}
    small = through("signal_volume", laminar, step(0.2, 0.201))[0]
    assert small[1:] == pytest.approx(0.201 - 0.001 * np.exp(-time_s[1:] / 0.1), abs=1e-6)
    turbulent = laminar | {"turbulent_mpa_s": 0.1}
    left = [
        (0.2 + height - through("signal_volume", turbulent, step(0.2, 0.2 + height))[0][20]) / height
        for height in (0.001, 0.02, 0.15)
    ]
    assert left[0] == pytest.approx(np.exp(-1.0), abs=0.05)
    assert left[0] < left[1] < left[2]


def test_a_turbulent_volume_fills_by_the_root_of_what_is_missing() -> None:
    """Far beyond the laminar flow q it is q^2 tau / turbulent that is missing: an equation with a closed solution."""
    tau_s, turbulent_mpa_s, height = 0.01, 0.002, 0.1
    made = through("signal_volume", {"signal_s": tau_s, "turbulent_mpa_s": turbulent_mpa_s}, step(0.2, 0.2 + height))[0]
    time_s = DT * np.arange(len(made))
    root = np.sqrt(height) - 0.5 * np.sqrt(turbulent_mpa_s / tau_s) * time_s
    early = root > 0.5 * np.sqrt(height)
    assert (0.2 + height - made)[early] == pytest.approx(root[early] ** 2, rel=0.06)


def working(rate_mpa_s: float, rows: int = 2400) -> np.ndarray:
    """A triangle at this rate."""
    return 0.2 + rate_mpa_s * DT * np.abs((np.arange(rows) + 100) % 400 - 200) - rate_mpa_s * DT * 100


@pytest.mark.parametrize(("balance", "first", "second"), [(0.0, 1.0, 1.0), (1.0, 1.0, 0.0), (-0.4, 0.6, 1.0)])
def test_muscles_that_work_warm_by_how_fast_their_pressures_move(balance: float, first: float, second: float) -> None:
    """At HEATING_MPA_S the strength changes by `rate_per_min` a minute, at half of that by half as much."""
    for share in (1.0, 0.5):
        pressures = working(share * HEATING_MPA_S)
        numbers = {"rate_per_min": -0.3, "heat_s": 1000.0, "balance": balance}
        p1, p2 = through("heated_muscles", numbers, pressures)
        minutes = DT * len(pressures) / 60.0
        assert p1[-1] / pressures[-1] - 1.0 == pytest.approx(-0.3 * share * first * minutes, rel=0.02, abs=1e-12)
        assert p2[-1] / (0.4 - pressures[-1]) - 1.0 == pytest.approx(
            -0.3 * share * second * minutes, rel=0.02, abs=1e-12
        )


def test_a_muscle_that_rests_cools_again() -> None:
    held = np.concatenate([working(HEATING_MPA_S), np.full(2400, 0.2)])
    strength = through("heated_muscles", {"rate_per_min": 0.5, "heat_s": 4.0}, held)[0] / held - 1.0
    assert strength[2400] > 10.0 * strength[-1] > 0.0
    assert strength[-1] / strength[2400] == pytest.approx(np.exp(-2399 * DT / 4.0), rel=0.02)
