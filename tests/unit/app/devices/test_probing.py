"""What `devices probe` ends with."""

import os
from pathlib import Path

import pytest

from rig.app import wire_locks
from rig.app.devices.probing import Bystander, judge
from rig.errors import CheckFailed
from rig.realtime.clock import VirtualClock

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


def test_a_bystander_looks_on_while_nobody_drives_and_ends_with_whoever_did(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wire_locks, "TABLE", f"pamrigwire-{os.getpid()}-{tmp_path.name}")
    now = VirtualClock()

    def look() -> None:
        now.wait_until_ns(now.now_ns() + 100_000_000)
        bystander.look()

    bystander = Bystander(["RIO0"], now.now_ns)
    look()
    with wire_locks.held(["RIO0"]):
        look()
    assert not bystander.alone
    with pytest.raises(CheckFailed, match=f"RIO0 is driven by process {os.getpid()} .* and now by nobody"):
        look()
    assert bystander.alone
