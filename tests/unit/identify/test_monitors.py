"""How a column is heard to follow its command: the correlations at all lags are those of each lag by itself."""

from dataclasses import replace

import numpy as np
import pytest

from rig.columns import correlation
from rig.identify.records.monitors import FOLLOWED_S, LONGEST_LAG_S, correlations, dead_monitor, monitor_trouble
from rig.record import Column, Record

T_S = np.arange(0.0, 8.0, FOLLOWED_S)


def steps_late() -> Column:
    """Still but for its last half second, and far from zero."""
    return 1e3 + np.where(T_S > 7.5, np.sin(9.0 * T_S), 0.0)


@pytest.mark.parametrize(
    "command", [0.2 * np.sin(2.0 * T_S), steps_late(), np.random.default_rng(1).standard_normal(len(T_S))]
)
@pytest.mark.parametrize("lag_s", [0.0, 0.4])
def test_at_every_lag_it_is_the_correlation_of_the_rows_that_are_so_far_apart(command: Column, lag_s: float) -> None:
    column = 0.3 + np.interp(T_S - lag_s, T_S, command) + 0.01 * np.random.default_rng(2).standard_normal(len(T_S))
    found = correlations(Record("one", T_S, command), column, command)
    t = np.linspace(T_S[0], T_S[-1], int((T_S[-1] - T_S[0]) / FOLLOWED_S))
    heard, said = np.interp(t, T_S, column), np.interp(t, T_S, command)
    assert len(found) == round(LONGEST_LAG_S / FOLLOWED_S)
    expected = [correlation(said[: len(t) - lag], heard[lag:]) for lag in range(len(found))]
    assert found == pytest.approx(np.array(expected), abs=1e-9)


@pytest.mark.parametrize("value", [0.0, 0.2, 1e3])
def test_what_stands_still_follows_nothing(value: float) -> None:
    still = np.full(len(T_S), value)
    command = np.sin(2.0 * T_S)
    record = Record("one", T_S, command)
    assert not np.any(correlations(record, still, command))
    assert not np.any(correlations(record, command, still))


def pressures(apart: float, together: float = 0.0, noise_mpa: float = 5e-4) -> Record:
    """Both monitors 50 ms late of set-points that move so far (MPa) apart, and together."""
    command, common = apart * np.sin(3.0 * T_S), 0.2 + together * np.sin(2.0 * T_S)
    random = np.random.default_rng(4)
    p1, p2 = (
        np.interp(T_S - 0.05, T_S, common + side * command) + noise_mpa * random.standard_normal(len(T_S))
        for side in (0.5, -0.5)
    )
    set_points = {"p1_cmd_mpa": common + 0.5 * command, "p2_cmd_mpa": common - 0.5 * command}
    return Record("one", T_S, command, p1_mpa=p1, p2_mpa=p2, **set_points)


@pytest.mark.parametrize("noise_mpa", [0.0, 5e-4])
@pytest.mark.parametrize("muscle", [1, 2])
def test_two_monitors_on_one_wire_are_no_monitors(muscle: int, noise_mpa: float) -> None:
    """Their difference stood still beside a command that moved, and was called a dead band, with 84 %."""
    record = pressures(0.2)
    one = record.p1_mpa if muscle == 1 else record.p2_mpa
    assert one is not None
    other = one + noise_mpa * np.random.default_rng(5).standard_normal(len(T_S))
    both = replace(record, p1_mpa=one, p2_mpa=other)
    assert dead_monitor(both) == "the monitors of p1 and p2 read the same pressure"


@pytest.mark.parametrize(("apart", "together"), [(0.2, 0.0), (0.02, 0.1), (0.0, 0.1), (0.2, 0.05)])
def test_monitors_of_two_muscles_that_move_together_are_heard(apart: float, together: float) -> None:
    assert dead_monitor(pressures(apart, together)) is None


def test_a_record_with_a_wrong_time_is_left_to_who_says_so() -> None:
    """Ten gigabytes were asked for; where it is put onto a grid, its gap is told."""
    late_s = np.where(np.arange(len(T_S)) < 400, T_S, T_S + 1.5e7)
    command = 0.2 * np.sin(2.0 * T_S)
    assert dead_monitor(Record("one", late_s, command, None, 0.2 + command / 2, 0.2 - command / 2)) is None


@pytest.mark.parametrize("name", ["p1", "p2"])
def test_a_monitor_is_heard_whose_pressure_follows_nothing_and_whose_joint_follows_it(name: str) -> None:
    """A supply that breaks down: the pressure wanders, and the joint with it."""
    wanders = np.cumsum(np.random.default_rng(6).standard_normal(len(T_S)))
    wanders *= 0.02 / np.std(wanders)
    record = pressures(0.1)
    pull = {"p1": 1.0, "p2": -1.0}[name]
    lost = replace(record, **{f"{name}_mpa": 0.2 + wanders})
    assert monitor_trouble(lost, name) == "does not follow its command"
    assert monitor_trouble(replace(lost, angle_deg=30.0 * record.dp_cmd_mpa), name) == "does not follow its command"
    assert monitor_trouble(replace(lost, angle_deg=pull * 300.0 * wanders), name) is None
