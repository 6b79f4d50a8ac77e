"""A rig of several devices, one of which fails: every call reaches the others."""

import threading
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


class MetValve(Valve):
    """Made safe only while the other one is, too."""

    def __init__(self, role: Role, meeting: threading.Barrier) -> None:
        super().__init__(role)
        self._meeting = meeting
        self.threads: list[int] = []

    def safe(self) -> None:
        self.threads.append(threading.get_ident())
        self._meeting.wait(5.0)

    def holds_safe(self) -> bool:
        self._meeting.wait(5.0)
        return True


def test_past_the_loop_all_devices_are_made_safe_and_looked_at_at_once() -> None:
    """One after the other, the second valve waited for the first one's wire to be opened: 0.3 s and more."""
    meeting = threading.Barrier(2)
    rig = MixedRig([MetValve(Role.VALVE_1, meeting), MetValve(Role.VALVE_2, meeting)], VirtualClock())
    rig.safe()
    assert rig.holds_safe() is True


@pytest.mark.parametrize("given", [0, 1])
def test_a_machine_without_threads_makes_all_devices_safe_all_the_same(
    monkeypatch: pytest.MonkeyPatch, given: int
) -> None:
    """At the most processes that a service may have, nobody beside the loop could write to either valve."""
    begin, left = threading.Thread.start, [given]

    def start(thread: threading.Thread) -> None:
        if not left[0]:
            raise RuntimeError("can't start new thread")
        left[0] -= 1
        begin(thread)

    monkeypatch.setattr(threading.Thread, "start", start)
    valves = [MetValve(role, threading.Barrier(1)) for role in (Role.VALVE_1, Role.VALVE_2)]
    MixedRig(valves, VirtualClock()).safe()
    assert [len(valve.threads) for valve in valves] == [1, 1]


def test_a_loop_that_makes_safe_has_one_thread() -> None:
    valves = [MetValve(role, threading.Barrier(1)) for role in (Role.VALVE_1, Role.VALVE_2)]
    rig = MixedRig(valves, VirtualClock())
    rig.open()
    rig.safe()
    assert [valve.threads for valve in valves] == [[threading.get_ident()]] * 2


@pytest.mark.parametrize("failure", [DeviceError("late"), DeviceLost("gone"), OSError("a bug")])
def test_one_that_fails_past_the_loop_keeps_no_call_from_the_other(failure: Exception) -> None:
    for parts in (
        [Valve(Role.VALVE_1, failure), Valve(Role.VALVE_2)],
        [Valve(Role.VALVE_1), Valve(Role.VALVE_2, failure)],
    ):
        rig = MixedRig(parts, VirtualClock())
        with pytest.raises(type(failure)):
            rig.safe()
        assert [valve.reached for valve in parts] == [["safe"]] * 2
