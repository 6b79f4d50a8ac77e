"""Sizes in words, in the units that people use."""

import pytest
from support.records.told_answers import cause, told

from rig.gap.answer.result import Interval
from rig.gap.answer.words.sentences import headline
from rig.gap.answer.words.sizes import size


def test_units_are_those_that_people_use() -> None:
    assert size(Interval(0.0102, 0.0101, 0.0103, "s")) == "10 ms"
    assert size(Interval(0.004, 0.0039, 0.0041, "MPa")) == "4.0 kPa"
    assert size(Interval(-0.021, -0.022, -0.02, "1")) == "2.1 %"
    assert size(Interval(0.23, 0.18, 0.29, "MPa")) == "0.23 MPa", "and not 0.2, which is the rest pressure"
    assert size(Interval(0.036, 0.025, 0.05, "s")) == "36 ms"
    assert size(Interval(0.036, 0.0, 0.1, "s")) == "40 ms"
    assert size(Interval(0.998, 0.998, 0.998, "deg")) == "1.0 deg", "and not 1.00 beside a 1.4"
    assert size(Interval(-12.0, -13.0, -11.0, "deg"), signed=True) == "-12 deg"


@pytest.mark.parametrize(("give", "soft"), [(0.02, ""), (0.55, "; it gives way there by 55 % of what")])
def test_a_stop_that_gives_way_is_told_as_that(give: float, soft: str) -> None:
    """A bearing that is rough at one place was a stop at 5.7 deg, and in another record the joint stood at 21 deg."""
    stop = cause("end_stop", high_deg=(5.7, 5.5, 5.9, "deg"), give=(give, give, give, "1"))
    said = headline(told(stop))[0]
    assert said.startswith(f"The angle meets a stop where it reads 5.7 deg{soft}")
