"""The channel map: there and back, what it refuses, and what facts must hold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.channels import PNEUMATIC, Channel, Channels, channels_of, check_channels, common
from rig.errors import ConfigError, RecordError
from rig.further_channels import Further, check_furthers, furthers_of, plain

MOTOR = Channels(Channel("set_point", "mm", (0.0, 300.0)), Channel("position", "mm", (-10.0, 290.0)))
BOUNDS = st.floats(-1e6, 1e6)


@given(BOUNDS, st.floats(1e-3, 1e6), st.floats(-2.0, 2.0))
def test_own_values_come_back_and_the_range_is_the_working_range(low: float, width: float, value: float) -> None:
    one = Channel("x", "mm", (low, low + width))
    channels = Channels(one, Channel("y", "N", (low, low + width)))
    ends = np.array([low, low + width])
    assert channels.working_input(ends) == pytest.approx([-0.2, 0.2], abs=1e-6)
    assert channels.working_output(ends) == pytest.approx([-20.0, 20.0], abs=1e-4)
    assert channels.working_output(channels.own_output(value)) == pytest.approx(value, abs=1e-4)
    assert not channels.has_valves


def test_a_pneumatic_rig_is_its_own_working_range() -> None:
    assert channels_of({}, "here") is PNEUMATIC
    assert PNEUMATIC.has_valves
    assert (PNEUMATIC.input_per_mpa, PNEUMATIC.output_per_deg) == (1.0, 1.0)
    assert PNEUMATIC.own_output(3.7) == PNEUMATIC.working_output(3.7) == 3.7


def test_facts_hold_a_map_and_give_it_back() -> None:
    assert channels_of({"channels": MOTOR.plain()}, "here") == MOTOR
    assert MOTOR.output.column == "position_mm"


@pytest.mark.parametrize(
    ("raw", "said"),
    [
        ("text", "expected a mapping"),
        ({"input": MOTOR.plain()["input"]}, "'output' is missing"),
        ({"input": MOTOR.plain()["input"], "output": MOTOR.plain()["input"]}, "both called set_point_mm"),
        ({"input": {"name": "a b", "unit": "mm", "range": [0, 1]}, "output": MOTOR.plain()["output"]}, "is no name"),
        ({"input": {"name": "a", "unit": "", "range": [0, 1]}, "output": MOTOR.plain()["output"]}, "is no unit"),
        ({"input": {"name": "a", "unit": "mm", "range": [1, 1]}, "output": MOTOR.plain()["output"]}, "is empty"),
    ],
)
def test_facts_that_hold_none_are_refused_in_one_line(raw: object, said: str) -> None:
    with pytest.raises(RecordError, match=said) as found:
        channels_of({"channels": raw}, "here")
    assert "\n" not in str(found.value)


def test_records_of_two_rigs_do_not_go_together() -> None:
    assert common([("a", MOTOR), ("b", MOTOR)]) == MOTOR
    with pytest.raises(RecordError, match="they are of different rigs"):
        common([("a", MOTOR), ("b", PNEUMATIC)])
    with pytest.raises(ConfigError, match="is empty"):
        check_channels(Channels(Channel("a", "mm", (2.0, 1.0)), MOTOR.output), "here")


def test_further_channels_in_facts() -> None:
    two = (Further("load_n", "N", 2.0), Further("supply_mpa", "MPa"))
    assert furthers_of({"further": plain(two)}) == two
    assert furthers_of({}) == furthers_of({"further": "load_n"}) == furthers_of({"further": [{"name": "1 x"}]}) == ()
    with pytest.raises(ConfigError, match="place for 4"):
        check_furthers([Further(f"x{number}") for number in range(5)], "here")
    with pytest.raises(ConfigError, match="there already"):
        check_furthers([Further("p1_mpa")], "here", taken=("p1_mpa",))
