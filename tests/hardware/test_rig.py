"""The real rig, in the order of docs/how-to/bring_up.md: first what only reads, then, with --allow-motion, small single
steps.

Never run by default: `pytest tests/hardware -m hardware --rig RIG.yaml`, then the same with --allow-motion. Stops at
the first failure.
"""

import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.app import compose, inventory
from rig.app.devices.bringup import DeviceTicker, let_go, mean, step_valves
from rig.app.devices.timing import time_reads
from rig.interfaces import Device, Role
from rig.realtime.clock import MonotonicClock
from rig.rig_config import RigConfig
from rig.sample import Flag

pytestmark = pytest.mark.hardware

STEP_MPA = 0.02
NEAR_MPA = 0.04
"""A monitor may be 6 % of 0.5 MPa off before it is calibrated."""
SETTLE_S = 1.5
_failed: list[str] = []


@pytest.fixture(scope="module")
def rig(request: pytest.FixtureRequest) -> RigConfig:
    return compose.load(Path(request.config.getoption("--rig")))


@pytest.fixture(autouse=True)
def _in_order(request: pytest.FixtureRequest) -> Iterator[None]:
    """What comes later relies on what came before."""
    if _failed:
        pytest.skip(f"{_failed[0]} failed: put that right first")
    before = request.session.testsfailed
    yield
    if request.session.testsfailed > before:
        _failed.append(request.node.name)


@pytest.fixture
def device(rig: RigConfig) -> Iterator[Device]:
    made = compose.make_device(rig, MonotonicClock())
    made.open()
    yield made
    let_go(made)


@pytest.fixture
def ticker(request: pytest.FixtureRequest, rig: RigConfig) -> Iterator[DeviceTicker]:
    if not request.config.getoption("--allow-motion"):
        pytest.skip("moves the rig: give --allow-motion")
    with DeviceTicker(compose.make_device(rig, MonotonicClock()), rig.period_ns, safe(rig)) as held:
        yield held


def safe(rig: RigConfig) -> tuple[float, float]:
    return rig.safe.p1_mpa, rig.safe.p2_mpa


# reading only: valves off, air off


def test_every_device_answers_within_the_period(rig: RigConfig, device: Device) -> None:
    time_reads(device, rig.period_ns, 50)
    timing = time_reads(device, rig.period_ns, 1000)
    assert timing.holds(rig.period_ns), (
        f"reads take {timing.read_p99_us / 1e3:.2f} ms at p99, {timing.failed} failed: {timing.last_error}"
    )


def test_no_wire_is_broken(rig: RigConfig, device: Device) -> None:
    timing = time_reads(device, rig.period_ns, 200)
    assert Flag.BROKEN_WIRE.name not in timing.flags, (
        "a monitor reads below its live zero: is the regulator powered, the wire whole?"
    )


def test_the_potentiometer_stands_on_its_track(rig: RigConfig, device: Device) -> None:
    timing = time_reads(device, rig.period_ns, 200)
    assert timing.last is not None
    assert math.isfinite(timing.last.angle_deg), "open wire, no excitation, or the joint stands in the dead zone"
    assert Flag.SUSPECT.name not in timing.flags


def test_opening_and_closing_again_works(rig: RigConfig, device: Device) -> None:
    for _ in range(5):
        device.close()
        device.open()
        assert time_reads(device, rig.period_ns, 20).failed == 0


def test_everything_is_calibrated(rig: RigConfig) -> None:
    if lines := inventory.warnings(rig):
        pytest.xfail("; ".join(lines))
    assert inventory.calibrations(rig) or compose.is_simulated(rig)


# motion: air on at low supply pressure, nobody near, a hand at the emergency stop


def test_the_safe_state_is_reached(rig: RigConfig, ticker: DeviceTicker) -> None:
    ticker.go_to(*safe(rig), settle_s=SETTLE_S)
    assert_at(rig, ticker, safe(rig))


def test_each_valve_moves_its_own_monitor(rig: RigConfig, ticker: DeviceTicker) -> None:
    findings = [one.finding() for one in step_valves(ticker, safe(rig), STEP_MPA, SETTLE_S)]
    assert not any(findings), "; ".join(filter(None, findings))


def test_the_joint_turns_to_either_side(rig: RigConfig, ticker: DeviceTicker) -> None:
    first, second = step_valves(ticker, safe(rig), STEP_MPA, SETTLE_S)
    assert first.moved_deg * second.moved_deg < 0.0, "both muscles turn the joint to the same side, or it is stuck"


def test_another_process_can_make_the_rig_safe(rig: RigConfig, ticker: DeviceTicker) -> None:
    """The supervisor's path: this process stops commanding, another one writes the safe state."""
    if not getattr(ticker.device, "second_path", False):
        pytest.skip("this rig allows no second path")
    p1, p2 = safe(rig)
    ticker.go_to(p1 + STEP_MPA, p2 - STEP_MPA, settle_s=SETTLE_S)
    ticker.loosen()
    code = f"""
from pathlib import Path
from rig.app import compose
from rig.realtime.clock import MonotonicClock
compose.make_device(compose.load(Path({str(rig.path)!r})), MonotonicClock()).safe()
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=30)
    ticker.wait(SETTLE_S)
    assert_at(rig, ticker, (p1, p2))


def assert_at(rig: RigConfig, ticker: DeviceTicker, wanted: tuple[float, float]) -> None:
    found = ticker.collect(0.5)
    for role, field, pressure in zip((Role.MONITOR_1, Role.MONITOR_2), ("p1_mpa", "p2_mpa"), wanted, strict=True):
        if any(role in entry.roles for entry in rig.devices):
            assert mean(found, field)[0] == pytest.approx(pressure, abs=NEAR_MPA), (
                f"{role.value}: the pressure does not follow"
            )
