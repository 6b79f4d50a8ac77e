"""The loop on sensors that lie and commands that go too far: what is flagged, what is clipped, what is a fault."""

import itertools
import math

import pytest
from support.scripted import (
    OFFSET_DEG,
    ScriptedDevice,
    ScriptedOperator,
    armed_and_running,
    program,
    run_loop,
)

from rig.errors import DeviceError
from rig.realtime.commands import Request
from rig.realtime.faults import Fault
from rig.realtime.guard import Limits
from rig.realtime.loop import LoopSettings
from rig.sample import Flag, Phase

MS = 1_000_000


def always(first: int, **values: float) -> dict[int, object]:
    return {n: lambda m: m._replace(**values) for n in range(first, 400)}


@pytest.mark.parametrize(
    ("spoil", "fault", "within_ticks"),
    [
        ({"angle_deg": math.nan}, Fault.BAD_VALUE, 5),
        ({"p1_mpa": math.inf}, Fault.BAD_VALUE, 5),
        ({"p2_mpa": -math.inf}, Fault.BAD_VALUE, 5),
        ({"p1_mpa": 3.0}, Fault.BAD_VALUE, 5),
        ({"angle_deg": 5000.0}, Fault.BAD_VALUE, 5),
        ({"p2_mpa": -0.125, "flags": int(Flag.BROKEN_WIRE)}, Fault.BROKEN_WIRE, 5),
        ({"angle_age_ns": 200 * MS}, Fault.STALE_VALUE, 5),
        ({"p1_mpa": 0.05}, Fault.NOT_FOLLOWING, 202),
        ({"angle_deg": math.nan, "flags": int(Flag.ANGLE_ABSENT)}, Fault.BAD_VALUE, 5),
    ],
    ids=[
        "nan",
        "inf",
        "-inf",
        "pressure out of range",
        "angle out of range",
        "broken wire",
        "stale",
        "not following",
        "absent",
    ],
)
def test_a_sensor_that_lies_faults_after_its_patience(spoil: dict[str, float], fault: Fault, within_ticks: int) -> None:
    device = ScriptedDevice(reads=always(20, **spoil), found_mpa=(0.2, 0.2))
    operator = ScriptedOperator({1: Request.ARM, 2: program(sweep=400)})
    samples, loop = run_loop(device, operator, 300)
    assert loop.fault is fault
    assert next(s.tick for s in samples if s.fault) - 20 < within_ticks
    written = [o for o in device.outputs if o != "safe"]
    assert all(math.isfinite(p) and 0.0 <= p <= 0.5 for pair in written for p in pair)


def test_jumps_are_flagged_and_a_habit_of_them_faults() -> None:
    once = ScriptedDevice(reads={30: lambda m: m._replace(angle_deg=m.angle_deg + 40)})
    samples, loop = run_loop(once, armed_and_running(), 60)
    assert [s.tick for s in samples if s.flags & Flag.SUSPECT] == [30, 31], "there and back"
    assert loop.fault is Fault.NONE
    wild = ScriptedDevice(reads={n: lambda m, n=n: m._replace(angle_deg=40.0 * (-1) ** n) for n in range(20, 60)})
    _, loop = run_loop(wild, armed_and_running(), 60)
    assert loop.fault is Fault.BAD_VALUE


def test_a_failed_read_does_not_hide_a_jump() -> None:
    reads = {
        20: DeviceError("scripted"),
        **{n: lambda m: m._replace(angle_deg=m.angle_deg + 40) for n in range(21, 60)},
    }
    samples, _ = run_loop(ScriptedDevice(reads=reads), armed_and_running(), 60)
    assert [s.tick for s in samples if s.flags & Flag.SUSPECT] == [21]


def test_a_bad_angle_does_not_enter_the_zero() -> None:
    device = ScriptedDevice(reads={8: lambda m: m._replace(angle_deg=math.nan)}, found_mpa=(0.2, 0.2))
    samples, _ = run_loop(device, armed_and_running(), 60)
    assert samples[8].phase == Phase.ZERO
    assert samples[-1].angle_zero_deg == pytest.approx(OFFSET_DEG)


def test_a_frozen_sensor_faults_while_the_set_points_move() -> None:
    settings = LoopSettings(limits=Limits(frozen_s=0.1))
    device = ScriptedDevice(reads=always(20, angle_raw=7.0), found_mpa=(0.2, 0.2))
    samples, loop = run_loop(device, ScriptedOperator({1: Request.ARM, 2: program(sweep=200)}), 200, settings=settings)
    assert loop.fault is Fault.FROZEN_SENSOR
    assert next(s.tick for s in samples if s.fault) in (70, 71), "0.02 MPa at 0.0004 MPa a tick"


def test_a_sensor_that_repeats_itself_at_rest_is_not_frozen_when_the_sweep_begins() -> None:
    settings = LoopSettings(limits=Limits(frozen_s=0.1))
    reads = {n: lambda m: m._replace(angle_raw=7.0, p1_raw=8.0, p2_raw=9.0) for n in range(110)}
    operator = ScriptedOperator({1: Request.ARM, 90: program(sweep=60, part=10)})
    _, loop = run_loop(ScriptedDevice(reads=reads, found_mpa=(0.2, 0.2)), operator, 180, settings=settings)
    assert loop.fault is Fault.NONE


def test_an_angle_that_both_muscles_hold_is_not_frozen() -> None:
    settings = LoopSettings(limits=Limits(frozen_s=0.1))
    stiff = program(part=200, p0_mpa=0.4, amplitude_mpa=0.0)
    device = ScriptedDevice(reads=always(0, angle_raw=7.0), found_mpa=(0.2, 0.2))
    _, loop = run_loop(device, ScriptedOperator({1: Request.ARM, 2: stiff}), 300, settings=settings)
    assert loop.fault is Fault.NONE


def test_an_angle_outside_the_envelope_faults() -> None:
    settings = LoopSettings(limits=Limits(angle_deg=(-0.5, 0.5)))
    _, loop = run_loop(ScriptedDevice(found_mpa=(0.2, 0.2)), armed_and_running(), 60, settings=settings)
    assert loop.fault is Fault.ANGLE_LIMIT


def test_a_command_outside_the_envelope_is_clipped_and_flagged() -> None:
    device = ScriptedDevice(found_mpa=(0.2, 0.2))
    wild = program(amplitude_mpa=1.2, sweep=40)
    settings = LoopSettings(limits=Limits(follow_mpa=1.0, angle_deg=(-360, 360), slew_mpa_s=20.0))
    samples, _ = run_loop(device, ScriptedOperator({1: Request.ARM, 2: wild}), 80, settings=settings)
    assert any(s.flags & Flag.CLIPPED_RANGE for s in samples)
    written = [o for o in device.outputs if o != "safe"]
    assert all(0.0 <= p <= 0.5 for pair in written for p in pair)
    clipped = [s for s in samples if s.flags & Flag.CLIPPED_RANGE]
    assert all(s.dp_cmd_mpa != pytest.approx(s.p1_cmd_mpa - s.p2_cmd_mpa) for s in clipped), (
        "what was asked for is kept as well"
    )


def test_a_command_that_is_too_fast_is_clipped_and_flagged() -> None:
    settings = LoopSettings(limits=Limits(slew_mpa_s=0.3))
    samples, _ = run_loop(ScriptedDevice(found_mpa=(0.2, 0.2)), armed_and_running(), 60, settings=settings)
    assert any(s.flags & Flag.CLIPPED_SLEW for s in samples)
    steps = [abs(b.p1_cmd_mpa - a.p1_cmd_mpa) for a, b in itertools.pairwise(samples)]
    assert max(steps) <= 0.3 * 0.005 + 1e-12
