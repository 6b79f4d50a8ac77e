"""What `devices probe` ends with."""

import pytest

from rig.app.devices.probing import judge
from rig.errors import CheckFailed

PORT = "valves: valve_1 on /dev/ttyUSB0: there is no such port; this machine has: /dev/ttyS0"


@pytest.mark.parametrize(
    ("others", "said"),
    [([], PORT), (["a"], f"{PORT}; 1 other finding above"), (["a", "b"], f"{PORT}; 2 other findings above")],
)
def test_the_first_finding_ends_the_probe_and_the_others_are_counted_as_such(others: list[str], said: str) -> None:
    with pytest.raises(CheckFailed) as error:
        judge([PORT, *others])
    assert str(error.value) == said


def test_a_probe_without_findings_is_good() -> None:
    assert judge([]) is None
