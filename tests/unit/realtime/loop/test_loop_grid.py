"""The loop's grid on a scripted clock: late ticks, skipped periods, and when they are a fault."""

import pytest
from support.scripted import (
    PERIOD_NS,
    ScriptedClock,
    ScriptedDevice,
    ScriptedOperator,
    armed_and_running,
    program,
    run_loop,
)

from rig.errors import DeviceLost
from rig.interfaces import Measurement
from rig.realtime.commands import Request
from rig.realtime.faults import Fault
from rig.realtime.guard import Limits
from rig.realtime.loop import LoopSettings
from rig.realtime.state import State
from rig.sample import Flag, Phase

MS = 1_000_000


def test_the_grid_is_absolute() -> None:
    samples, _ = run_loop(ScriptedDevice(), ScriptedOperator({}), 50, ScriptedClock({7: 2 * MS, 20: 4 * MS}))
    assert [s.scheduled_ns for s in samples] == [samples[0].scheduled_ns + k * PERIOD_NS for k in range(50)]
    assert [s.woken_ns - s.scheduled_ns for s in samples if s.woken_ns != s.scheduled_ns] == [2 * MS, 4 * MS]
    assert sum(s.missed for s in samples) == 0


@pytest.mark.parametrize(("late_ms", "missed"), [(4.999, 0), (5.0, 1), (7.0, 1), (12.0, 2), (19.9, 3)])
def test_a_tick_later_than_a_period_skips_whole_periods_and_counts_them(late_ms: float, missed: int) -> None:
    samples, loop = run_loop(ScriptedDevice(), ScriptedOperator({}), 30, ScriptedClock({10: int(late_ms * MS)}))
    late = samples[10]
    assert late.missed == missed
    assert late.tick == 10 + missed
    assert 0 <= late.woken_ns - late.scheduled_ns < PERIOD_NS
    assert all(s.scheduled_ns == samples[0].scheduled_ns + s.tick * PERIOD_NS for s in samples)
    assert loop.fault is Fault.NONE


def test_skipped_periods_keep_the_phase_of_the_sweep() -> None:
    late = {20: 12 * MS}
    on_time, _ = run_loop(ScriptedDevice(), armed_and_running(), 60)
    skipped, _ = run_loop(ScriptedDevice(), armed_and_running(), 60, ScriptedClock(late))
    by_tick = {s.tick: (s.phase, s.dp_cmd_mpa) for s in on_time}
    assert 21 not in [s.tick for s in skipped]
    assert all(by_tick[s.tick] == (s.phase, s.dp_cmd_mpa) for s in skipped if s.run)


def test_the_slew_limit_counts_the_skipped_periods() -> None:
    settings = LoopSettings(limits=Limits(slew_mpa_s=1.0))  # 0.005 MPa a tick
    slow = program(sweep=40, part=10, amplitude_mpa=0.04)  # 0.002 MPa a tick on each valve
    samples, _ = run_loop(ScriptedDevice(found_mpa=(0.2, 0.2)), ScriptedOperator({1: Request.ARM, 2: slow}), 90,
                          ScriptedClock({45: 11 * MS}), settings)  # fmt: skip
    assert not any(s.flags & Flag.CLIPPED_SLEW for s in samples if s.phase == Phase.SWEEP)


@pytest.mark.parametrize(
    ("late", "fault"),
    [
        ({20: 6 * MS, 25: 6 * MS}, Fault.NONE),
        ({20: 6 * MS, 25: 6 * MS, 30: 6 * MS}, Fault.MISSED_TICKS),
        ({20: 6 * MS, 25: 6 * MS, 240: 6 * MS}, Fault.NONE),
        ({20: 19 * MS}, Fault.NONE),
        ({20: 21 * MS}, Fault.LONG_STALL),
        ({20: 60_000 * MS}, Fault.LONG_STALL),
    ],
    ids=["two misses", "three in a second", "three, but not in a second", "under 4 T", "over 4 T", "a minute asleep"],
)
def test_misses_and_stalls(late: dict[int, int], fault: Fault) -> None:
    samples, loop = run_loop(ScriptedDevice(), armed_and_running(), 300, ScriptedClock(late))
    assert loop.fault is fault
    if fault:
        first = next(s for s in samples if s.fault)
        assert first.state == State.FAULT
        assert (first.p1_cmd_mpa, first.p2_cmd_mpa) == (0.2, 0.2), (
            "the safe state is written in the tick that sees the fault"
        )


@pytest.mark.parametrize(
    ("held_up_ms", "fault"), [(24, Fault.NONE), (26, Fault.LONG_STALL), (60_000, Fault.LONG_STALL)]
)
def test_a_tick_that_is_held_up_while_it_reads_writes_nothing_old(held_up_ms: int, fault: Fault) -> None:
    """A group of processes that is frozen (`docker pause`) may be so in the middle of a tick: the set-points of a
    minute ago came to the valves when it went on, whatever the device's own watchdog had made of them."""
    clock = ScriptedClock()

    def frozen(now: Measurement) -> Measurement:
        clock.wait_until_ns(clock.now_ns() + held_up_ms * MS)
        device.outputs.append("frozen")
        return now

    device = ScriptedDevice(reads={20: frozen})
    _, loop = run_loop(device, armed_and_running(), 300, clock)
    assert loop.fault is fault
    assert (device.outputs[device.outputs.index("frozen") + 1] == "safe") is bool(fault)


def test_after_a_standstill_it_is_not_the_device_that_is_to_blame() -> None:
    """Who serves a slow wire stood still as well, and was said to have lost the device."""
    device = ScriptedDevice(reads={20: DeviceLost("its I/O process has not moved")})
    samples, loop = run_loop(device, armed_and_running(), 30, ScriptedClock({20: 3000 * MS}))
    assert loop.fault is Fault.LONG_STALL
    assert next(s for s in samples if s.fault).fault == Fault.LONG_STALL
    assert "safe" in device.outputs[-2:]


def test_the_loop_counts_past_what_a_sample_can_hold() -> None:
    device, operator = ScriptedDevice(), ScriptedOperator({})
    _, loop = run_loop(device, operator, 3)
    loop.tick(2**32 + 7, 0, 0, 0)
    assert loop.ring.samples[-1].tick == 7  # type: ignore[attr-defined]
