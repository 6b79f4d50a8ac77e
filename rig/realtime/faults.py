"""Every fault: its code, its cause in words, and what to do about it. The only list of them."""

from enum import IntEnum
from typing import Final, NamedTuple


class Fault(IntEnum):
    """Codes as they stand in samples and logs; never renumbered."""

    NONE = 0
    ESTOP = 1
    MISSED_TICKS = 2
    LONG_STALL = 3
    DEVICE_ERRORS = 4
    DEVICE_LOST = 5
    FROZEN_SENSOR = 6
    BAD_VALUE = 7
    BROKEN_WIRE = 8
    STALE_VALUE = 9
    ANGLE_LIMIT = 10
    NOT_FOLLOWING = 11
    LOOP_DIED = 12
    CONTROL_LOST = 13
    TERMINATED = 14
    LOOP_ERROR = 15
    RECORDER_DIED = 16
    SUPERVISOR_DIED = 17
    ANGLE_LOST = 18
    TRACKING_ERROR = 19


class Explanation(NamedTuple):
    """A fault for a person."""

    cause: str
    hint: str


EXPLANATIONS: Final[dict[Fault, Explanation]] = {
    Fault.NONE: Explanation("no fault", ""),
    Fault.ESTOP: Explanation("emergency stop by the operator", "make sure the rig may move, then reset"),
    Fault.MISSED_TICKS: Explanation(
        "too many periods were skipped within one second",
        "run `pamrig latency`; free the machine, or give the loop real-time priority",
    ),
    Fault.LONG_STALL: Explanation(
        "the loop stood still for limits.stall_periods periods or longer (4 unless the rig's YAML says otherwise)",
        "look for a blocking driver, swapping or a suspended machine",
    ),
    Fault.DEVICE_ERRORS: Explanation(
        "the device failed too often (leaky bucket full)", "check cable, power, address; see `pamrig devices probe`"
    ),
    Fault.DEVICE_LOST: Explanation(
        "the connection to the device is gone", "check power and cable, then reset; the device is opened anew"
    ),
    Fault.FROZEN_SENSOR: Explanation(
        "a sensor repeats one value while the set-points move",
        "check the sensor's cable and supply, and the coupling of its shaft",
    ),
    Fault.BAD_VALUE: Explanation(
        "a sensor kept giving values that are out of range, jump, or are not numbers",
        "check the sensor's wiring and the calibration",
    ),
    Fault.BROKEN_WIRE: Explanation(
        "a monitor reads below its live zero: broken wire", "check its wire and the regulator's power"
    ),
    Fault.STALE_VALUE: Explanation(
        "a measurement is older than allowed", "check the connection, or raise limits.max_age_s"
    ),
    Fault.ANGLE_LIMIT: Explanation(
        "the joint left the angle envelope", "check the coupling and the zero, or widen `limits.angle_deg`"
    ),
    Fault.NOT_FOLLOWING: Explanation(
        "a pressure does not follow its set-point",
        "check the air supply, the regulator's power and whether the two valves are swapped",
    ),
    Fault.LOOP_DIED: Explanation("the loop ended or hung", "see the log, then reset"),
    Fault.CONTROL_LOST: Explanation(
        "the process that commands the loop is gone", "start it again; it comes back disarmed"
    ),
    Fault.TERMINATED: Explanation("the loop was told to end by a signal", "nothing is wrong if this was asked for"),
    Fault.LOOP_ERROR: Explanation("an error in the loop itself", "please report it with the log"),
    Fault.RECORDER_DIED: Explanation(
        "the recorder ended during a run", "check the disk; recover the record with `pamrig log recover`"
    ),
    Fault.SUPERVISOR_DIED: Explanation(
        "the supervisor or the guardian ended or was stopped", "reset; without them nobody stands above the loop"
    ),
    Fault.ANGLE_LOST: Explanation(
        "the angle gave no value that can be true while the loop was closed over it",
        "check the sensor's wiring, supply and coupling before the loop is closed again",
    ),
    Fault.TRACKING_ERROR: Explanation(
        "the angle stayed further from its reference than closed_loop.error_deg for closed_loop.error_s",
        "look at the record: a sign, gains too high (`pamrig tune`), or a reference that the rig cannot follow",
    ),
}


def explain(code: int, message: str = "") -> str:
    """`FROZEN_SENSOR: cause (hint); what was said` for a code of a sample; an unknown code is said to be unknown."""
    try:
        fault = Fault(code)
    except ValueError:
        return f"fault {code}: unknown to this version"
    cause, hint = EXPLANATIONS[fault]
    return f"{fault.name}: {cause}" + (f" ({hint})" if hint else "") + (f"; {message}" if message else "")
