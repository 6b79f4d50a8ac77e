"""A ramp of the set-points, and the heat of muscles that work: what physics says they must do."""

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


@pytest.mark.parametrize("after", [0.1, 0.3])
def test_a_ramp_goes_at_its_rate_and_arrives(after: float) -> None:
    p1, p2 = through("set_point_ramp", {"rate_mpa_s": 0.2}, step(0.2, after))
    speed = np.abs(np.diff(p1)) / DT
    assert speed[:99] == pytest.approx(0.2)
    assert p1[101:] == pytest.approx(after, abs=1e-12)
    assert p2 == pytest.approx(0.4 - p1)


def test_a_ramp_leaves_what_is_slower_than_it_alone() -> None:
    slow = 0.2 + 0.05 * np.sin(2.0 * np.pi * 0.2 * DT * np.arange(2000))
    assert through("set_point_ramp", {"rate_mpa_s": 0.07}, slow)[0] == pytest.approx(slow, abs=1e-12)


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


@pytest.mark.parametrize("tau_s", [0.02, 0.1])
def test_a_throttle_that_is_laminar_is_a_filter_of_one_pole(tau_s: float) -> None:
    """But for half a tick: a filter takes the course between two samples for straight, a throttle for a step."""
    asked = 0.2 + 0.05 * np.sin(2.0 * np.pi * 0.5 * DT * np.arange(800))
    linear = through("valve_filter", {"tau_s": tau_s}, asked)
    throttled = through("valve_filter", {"tau_s": tau_s, "turbulent_mpa_s": 999.0}, asked)
    assert throttled == pytest.approx(np.array(linear), abs=0.05 * 2.0 * np.pi * 0.5 * 0.6 * DT)


@pytest.mark.parametrize("more", [2.0, 4.0])
def test_a_turbulent_throttle_is_the_later_the_more_it_has_to_follow(more: float) -> None:
    """Where the drop goes with the square of the flow, the time to come to half a step goes with the root of it."""
    numbers = {"tau_s": 0.05, "turbulent_mpa_s": 0.01}
    half_way = [
        np.argmax(through("valve_filter", numbers, step(0.1, 0.1 + size, 4000))[0] > 0.1 + 0.5 * size)
        for size in (0.05, 0.05 * more)
    ]
    assert half_way[1] / half_way[0] == pytest.approx(np.sqrt(more), rel=0.05)


def test_a_turbulent_throttle_of_one_valve_leaves_the_other_alone() -> None:
    numbers = {"tau_s": 0.1, "turbulent_mpa_s": 0.03, "balance": 1.0}
    p1, p2 = through("valve_filter", numbers, step(0.2, 0.3))
    assert p2 == pytest.approx(0.4 - np.array(step(0.2, 0.3)), abs=1e-9)
    assert np.all(np.diff(p1) >= 0.0)
    assert 0.2 < p1[10] < 0.3
