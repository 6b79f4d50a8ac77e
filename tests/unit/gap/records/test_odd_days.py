"""Earlier days that do not go with the others, found before anything is asked of the records under test."""

from dataclasses import replace

import numpy as np
import pytest
from support.records.made_days import made_day

from rig.gap.records.odd_days import Day, odd_days, two_apart
from rig.record import Record

HEALTHY = [made_day(seed=n, gain=1 + 0.001 * n, offset_deg=3.0 * n) for n in range(1, 6)]


def test_days_that_agree_are_none_of_them_odd() -> None:
    assert odd_days(HEALTHY) == {}


@pytest.mark.parametrize("count", [2, 5])
@pytest.mark.parametrize("place", [0, 1])
def test_a_sick_day_among_healthy_ones_is_found_by_what_it_differs_in(count: int, place: int) -> None:
    days = HEALTHY[:count]
    days.insert(place, made_day(lag_ticks=8))
    (found,) = odd_days(days).items()
    assert found[0] == place
    for channel, unit in (("angle", "deg"), ("p1", "MPa"), ("p2", "MPa")):
        assert f"its {channel} is" in found[1]
        assert f"{unit} (rms) from theirs" in found[1]


def test_a_sensor_that_was_scaled_otherwise_shows_in_the_angle_alone() -> None:
    (found,) = odd_days([*HEALTHY, made_day(gain=1.2)]).values()
    assert found.startswith("its angle is")
    assert "its p" not in found


def test_days_whose_records_have_other_names_are_compared_by_their_commands() -> None:
    days = [
        [replace(record, name=f"monday_{number}_{record.name}") for record in each]
        for number, each in enumerate([*HEALTHY, made_day(lag_ticks=8)])
    ]
    assert list(odd_days(days)) == [len(HEALTHY)]


def test_a_sweep_that_began_later_is_compared_in_phase() -> None:
    late = [
        replace(record, **{name: np.roll(getattr(record, name), 60) for name in ("dp_cmd_mpa", "angle_deg", "p1_mpa",
        "p2_mpa")})
        for record in made_day(seed=9)
    ]  # fmt: skip
    assert odd_days([*HEALTHY, late]) == {}


def test_days_under_another_condition_are_not_compared() -> None:
    """Most days without a load, and some with one: those disagree with the others, and are no less healthy."""

    def loaded(each: Day, load_kg: float) -> Day:
        return [replace(record, facts={"load_kg": load_kg}) for record in each]

    assert odd_days([*(loaded(each, 0.0) for each in HEALTHY), loaded(made_day(lag_ticks=8), 2.0)]) == {}


def test_of_two_days_nobody_can_say_which_is_odd_but_how_far_they_are_apart() -> None:
    assert odd_days([HEALTHY[0], made_day(lag_ticks=8)]) == {}
    assert two_apart(*HEALTHY[:2]) == ""
    assert two_apart(HEALTHY[0], made_day(gain=1.2)).endswith("20 % of the angle's spread")


def test_what_cannot_be_compared_is_not_called_odd() -> None:
    short = [Record("sine0", np.arange(9.0), np.ones(9), angle_deg=np.zeros(9))]
    without = [replace(record, angle_deg=None, p1_mpa=None, p2_mpa=None) for record in made_day(lag_ticks=8)]
    for other in (short, without, []):
        assert odd_days([*HEALTHY[:2], other]) == {}
        assert two_apart(HEALTHY[0], other) == ""
