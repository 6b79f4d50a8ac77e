"""Every fault can be explained to a person."""

import pytest

from rig.realtime.faults import EXPLANATIONS, Fault, explain


@pytest.mark.parametrize("fault", [f for f in Fault if f])
def test_every_fault_has_a_cause_and_a_hint(fault: Fault) -> None:
    line = explain(fault)
    assert line.startswith(f"{fault.name}: ")
    assert EXPLANATIONS[fault].cause in line
    assert EXPLANATIONS[fault].hint in line
    assert EXPLANATIONS[fault].hint
    assert "\n" not in line


def test_an_unknown_code_is_said_to_be_unknown() -> None:
    assert explain(250) == "fault 250: unknown to this version"


def test_codes_are_never_renumbered() -> None:
    known = {"NONE": 0, "ESTOP": 1, "MISSED_TICKS": 2, "LONG_STALL": 3, "DEVICE_ERRORS": 4, "DEVICE_LOST": 5,
    "FROZEN_SENSOR": 6,
             "BAD_VALUE": 7, "BROKEN_WIRE": 8, "STALE_VALUE": 9, "ANGLE_LIMIT": 10, "NOT_FOLLOWING": 11,
             "LOOP_DIED": 12,
             "CONTROL_LOST": 13, "TERMINATED": 14, "LOOP_ERROR": 15, "RECORDER_DIED": 16,
             "SUPERVISOR_DIED": 17}  # fmt: skip
    assert {name: Fault[name].value for name in known} == known
