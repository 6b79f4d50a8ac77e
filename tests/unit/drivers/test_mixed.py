"""A rig of several devices, one of which fails: every call reaches the others."""

from collections.abc import Mapping

import pytest

from drivers.mixed import MixedRig
from rig.errors import DeviceError, DeviceLost
from rig.interfaces import Measurement, Role
from rig.realtime.clock import VirtualClock


class Valve:
    """Remembers what reached it; fails as it is told."""

    def __init__(self, role: Role, failure: Exception | None = None) -> None:
        self.roles, self.further = frozenset((role,)), ()
        self.failure = failure
        self.reached: list[str] = []

    def _reach(self, what: str) -> None:
        self.reached.append(what)
        if self.failure is not None:
            raise self.failure

    def open(self) -> Mapping[str, str]:
        return {}

    def read(self) -> Measurement:
        return Measurement()

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        self._reach("write")

    def safe(self) -> None:
        self._reach("safe")

    def close(self) -> None:
        self._reach("close")


@pytest.mark.parametrize("failure", [DeviceError("late"), DeviceLost("gone"), OSError("a bug"), ZeroDivisionError()])
def test_one_that_fails_keeps_no_call_from_the_other(failure: Exception) -> None:
    bad, good = Valve(Role.VALVE_1, failure), Valve(Role.VALVE_2)
    rig = MixedRig([bad, good], VirtualClock())
    for call in (lambda: rig.write(0.3, 0.3), rig.safe, rig.close):
        with pytest.raises(type(failure)):
            call()
    assert good.reached == bad.reached == ["write", "safe", "close"]
