"""The loop tick by tick on a scripted clock and device: grid, order, phases, zero, the ways out, and every fault of one process."""

import itertools
import math

import pytest
from scripted import (
    OFFSET_DEG,
    PERIOD_NS,
    ListRing,
    ScriptedClock,
    ScriptedDevice,
    ScriptedOperator,
    armed_and_running,
    failing,
    program,
    run_loop,
)

from rig.errors import DeviceError, DeviceLost
from rig.interfaces import Role
from rig.realtime.commands import Answer, Request
from rig.realtime.faults import Fault
from rig.realtime.guard import Limits
from rig.realtime.loop import Loop, LoopSettings
from rig.realtime.state import State
from rig.sample import Flag, Phase, Sample

MS = 1_000_000


def phases(samples: list[Sample]) -> list[Phase]:
    return [Phase(s.phase) for s in samples if s.run]


def test_a_run_goes_through_its_phases_in_order_and_ends_safe() -> None:
    device = ScriptedDevice()
    samples, loop = run_loop(device, armed_and_running(), 60)
    expected = [Phase.SETTLE] * 4 + [Phase.ZERO] * 4 + [Phase.RAMP_IN] * 4 + [Phase.SWEEP] * 20 + [Phase.RAMP_OUT] * 4
    assert phases(samples) == [*expected, Phase.NONE], "one tick more shows what the last set-points did"
    assert loop.fault is Fault.NONE
    assert device.outputs[-1] == "safe"
    assert device.closed == 1


def test_the_sweep_is_written_tick_by_tick() -> None:
    device = ScriptedDevice()
    samples, _ = run_loop(device, armed_and_running(), 60)
    swept = [s for s in samples if s.phase == Phase.SWEEP]
    wanted = program()
    assert [(s.p1_cmd_mpa, s.p2_cmd_mpa) for s in swept] == list(zip(wanted.p1_mpa, wanted.p2_mpa, strict=True))
    assert [s.dp_cmd_mpa for s in swept] == pytest.approx([a - b for a, b in zip(wanted.p1_mpa, wanted.p2_mpa, strict=True)])
    assert all((s.p1_cmd_mpa, s.p2_cmd_mpa) in device.outputs for s in swept)


def test_the_zero_is_the_mean_angle_at_rest_and_every_sample_agrees_with_its_own_zero() -> None:
    samples, _ = run_loop(ScriptedDevice(), armed_and_running(), 60)
    for s in samples:
        from_sensor = OFFSET_DEG + 100.0 * (s.p1_mpa - s.p2_mpa)
        assert s.angle_deg + s.angle_zero_deg == pytest.approx(from_sensor), Phase(s.phase)
        assert bool(s.flags & Flag.ANGLE_ZEROED) == (s.angle_zero_deg != 0.0)
    zeroed = [Phase(s.phase) for s in samples if s.run and s.flags & Flag.ANGLE_ZEROED]
    assert zeroed[0] is Phase.RAMP_IN
    assert {s.angle_zero_deg for s in samples if s.phase == Phase.SWEEP} == {OFFSET_DEG}


def test_a_second_run_takes_a_zero_of_its_own() -> None:
    operator = armed_and_running({50: program(2)})
    samples, _ = run_loop(ScriptedDevice(), operator, 110)
    second = [s for s in samples if s.run == 2]
    assert second[0].angle_zero_deg == 0.0
    assert second[0].angle_deg == pytest.approx(OFFSET_DEG)
    assert not second[0].flags & Flag.ANGLE_ZEROED
    assert second[-1].angle_zero_deg == pytest.approx(OFFSET_DEG)


def test_arming_holds_the_measured_pressures_without_a_jump() -> None:
    device = ScriptedDevice(found_mpa=(0.11, 0.17))
    samples, _ = run_loop(device, ScriptedOperator({0: Request.ARM}), 10)
    assert {(s.p1_cmd_mpa, s.p2_cmd_mpa) for s in samples} == {(0.11, 0.17)}
    assert device.outputs[:-1] == [(0.11, 0.17)] * 10


def test_before_arming_nothing_but_the_safe_state_is_written() -> None:
    device = ScriptedDevice()
    run_loop(device, ScriptedOperator({}), 10)
    assert set(device.outputs) == {"safe"}


def test_the_settle_phase_starts_from_where_the_set_points_stand() -> None:
    samples, _ = run_loop(ScriptedDevice(found_mpa=(0.11, 0.17)), ScriptedOperator({0: Request.ARM, 5: program(part=100)}), 40)
    steps = [abs(b.p1_cmd_mpa - a.p1_cmd_mpa) for a, b in itertools.pairwise(samples)]
    assert max(steps) == pytest.approx(0.09 * 2 / 100)


def test_arming_waits_for_a_pressure_that_can_be_believed() -> None:
    def old(m):  # type: ignore[no-untyped-def]
        return m._replace(p1_age_ns=10**9)

    device = ScriptedDevice(reads={0: lambda m: m._replace(p1_mpa=math.nan), 1: failing(1, 1)[1], 2: old})
    operator = ScriptedOperator(dict.fromkeys(range(4), Request.ARM))
    run_loop(device, operator, 6)
    assert [a for _, a in operator.answers[:4]] == [Answer.NOT_READY] * 3 + [Answer.DONE]


def test_without_monitors_arming_holds_the_safe_pressures() -> None:
    absent = int(Flag.P1_ABSENT | Flag.P2_ABSENT)
    blind = {n: lambda m: m._replace(p1_mpa=math.nan, p2_mpa=math.nan, flags=absent) for n in range(20)}
    device = ScriptedDevice(reads=blind, roles=frozenset({Role.VALVE_1, Role.VALVE_2, Role.ANGLE}))
    samples, loop = run_loop(device, ScriptedOperator({1: Request.ARM}), 20)
    assert device.outputs[1] == (0.2, 0.2)
    assert loop.fault is Fault.NONE
    assert not any(s.flags & Flag.SUSPECT for s in samples)


# the grid


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
        assert (first.p1_cmd_mpa, first.p2_cmd_mpa) == (0.2, 0.2), "the safe state is written in the tick that sees the fault"


def test_the_loop_counts_past_what_a_sample_can_hold() -> None:
    device, operator = ScriptedDevice(), ScriptedOperator({})
    _, loop = run_loop(device, operator, 3)
    loop.tick(2**32 + 7, 0, 0, 0)
    assert loop._ring.samples[-1].tick == 7  # type: ignore[attr-defined]


# the device


def test_single_errors_are_forgiven_and_flagged() -> None:
    device = ScriptedDevice(reads=failing(20, 2))
    samples, loop = run_loop(device, armed_and_running(), 60)
    bad = [s for s in samples if s.flags & Flag.READ_ERROR]
    assert [s.tick for s in bad] == [20, 21]
    assert all(math.isnan(s.angle_deg) and math.isnan(s.p1_mpa) for s in bad), "never a stale value passed as new"
    assert all(s.flags & Flag.ANGLE_ABSENT and not s.flags & Flag.SUSPECT for s in bad)
    assert loop.fault is Fault.NONE


def test_a_habit_of_errors_fills_the_bucket() -> None:
    samples, loop = run_loop(ScriptedDevice(reads=failing(20, 100)), armed_and_running(), 60)
    assert loop.fault is Fault.DEVICE_ERRORS
    assert next(s.tick for s in samples if s.fault) == 24, "the fifth error in a row"


def test_every_other_read_failing_is_a_habit_too() -> None:
    device = ScriptedDevice(reads={n: DeviceError("scripted") for n in range(20, 60, 2)})
    _, loop = run_loop(device, armed_and_running(), 60)
    assert loop.fault is Fault.DEVICE_ERRORS


def test_failing_writes_are_flagged_and_fault() -> None:
    device = ScriptedDevice(writes=failing(10, 100))
    samples, loop = run_loop(device, armed_and_running(), 60)
    assert loop.fault is Fault.DEVICE_ERRORS
    assert sum(bool(s.flags & Flag.WRITE_ERROR) for s in samples) == 9, "+2 for the write, -1 for the read of the same tick"
    assert device.outputs[-1] == "safe"


@pytest.mark.parametrize("where", ["reads", "writes"])
def test_a_lost_device_faults_at_once(where: str) -> None:
    device = ScriptedDevice(**{where: {15: DeviceLost("scripted: gone")}})
    samples, loop = run_loop(device, armed_and_running({40: Request.RESET}), 60)
    assert loop.fault is Fault.DEVICE_LOST
    faulted = [s for s in samples if s.fault]
    assert "safe" in device.outputs, "tried although the device said it was lost"
    assert all(s.state == State.FAULT for s in faulted)


def test_a_lost_device_is_never_read_again_and_cannot_be_reset() -> None:
    device = ScriptedDevice(reads={15: DeviceLost("scripted: gone")})
    operator = armed_and_running({40: Request.RESET})
    run_loop(device, operator, 60)
    assert (40, Answer.NOT_READY) in operator.answers
    assert device._calls["read"] == 16


def test_a_safe_state_that_could_not_be_written_is_owed_until_it_is() -> None:
    device = ScriptedDevice(safes=failing(1, 5))  # number 0 is the one of the first tick
    operator = armed_and_running({45: Request.RESET, 55: Request.RESET}, estop=range(40, 46))
    samples, _ = run_loop(device, operator, 60)
    assert [s.tick for s in samples if s.flags & Flag.WRITE_ERROR] == [40, 41, 42, 43, 44]
    assert device.outputs.count("safe") >= 2
    assert [a for t, a in operator.answers if t in (45, 55)] == [Answer.NOT_READY, Answer.DONE]


def test_an_error_of_the_program_ends_safe_and_the_record_says_so() -> None:
    device = ScriptedDevice(reads={20: ZeroDivisionError("scripted bug")})
    operator = armed_and_running()

    ring = ListRing()
    loop = Loop(device, ScriptedClock(), ring, operator, LoopSettings())  # type: ignore[arg-type]
    with pytest.raises(ZeroDivisionError):
        loop.run()
    last = ring.samples[-1]
    assert (last.tick, last.fault, last.state, last.run) == (20, Fault.LOOP_ERROR, State.FAULT, 1)
    assert device.outputs[-1] == "safe"
    assert device.closed == 1


def test_leaving_tries_the_safe_state_again() -> None:
    device = ScriptedDevice(safes=failing(1, 2))
    run_loop(device, ScriptedOperator({}), 5)
    assert device.outputs == ["safe", "safe"]
    assert device.closed == 1


# the operator


def test_stop_ramps_down_from_where_it_is_and_does_not_fault() -> None:
    device = ScriptedDevice(found_mpa=(0.2, 0.2))
    samples, loop = run_loop(device, armed_and_running(stop_at=22), 60)
    out = [s for s in samples if s.phase == Phase.RAMP_OUT]
    assert [s.tick for s in out] == [22, 23, 24, 25]
    assert [s.dp_cmd_mpa for s in out] == sorted((s.dp_cmd_mpa for s in out), reverse=out[0].dp_cmd_mpa > 0)
    assert out[0].p1_cmd_mpa == samples[21].p1_cmd_mpa, "no jump"
    assert loop.fault is Fault.NONE
    assert samples[27].state == State.DONE


@pytest.mark.parametrize("at", [3, 7, 11, 20, 35], ids=["settle", "zero", "ramp in", "sweep", "ramp out"])
def test_stop_works_in_every_phase(at: int) -> None:
    samples, loop = run_loop(ScriptedDevice(found_mpa=(0.2, 0.2)), armed_and_running(stop_at=at), 80)
    ran = [s for s in samples if s.run]
    assert samples[at].phase == Phase.RAMP_OUT
    assert len(ran) == at - 2 + 4 + 1
    assert samples[-1].state == State.DONE
    assert (samples[-1].p1_cmd_mpa, samples[-1].p2_cmd_mpa) == (0.2, 0.2)
    assert loop.fault is Fault.NONE


def test_estop_writes_the_safe_state_in_the_same_tick() -> None:
    device = ScriptedDevice(found_mpa=(0.2, 0.2))
    samples, loop = run_loop(device, armed_and_running(estop=range(22, 60)), 60)
    assert loop.fault is Fault.ESTOP
    assert (samples[22].state, samples[22].fault, samples[22].run) == (State.FAULT, Fault.ESTOP, 1)
    assert [s.run for s in samples[23:]] == [0] * 37, "the tick of the fault is the last of its record"
    after = device.outputs[device.outputs.index("safe", 1) :]
    assert set(after) == {"safe"}


def test_a_reset_needs_its_cause_gone_and_does_not_arm() -> None:
    device = ScriptedDevice(found_mpa=(0.2, 0.2))
    operator = armed_and_running({24: Request.RESET, 40: program(2), 41: Request.RESET, 45: program(3)}, estop=range(22, 30))
    samples, _ = run_loop(device, operator, 60)
    answers = dict(operator.answers)
    assert answers[24] is Answer.NOT_READY
    assert answers[40] is Answer.REFUSED
    assert answers[41] is Answer.DONE
    assert answers[45] is Answer.REFUSED, "disarmed: a start needs an arm first"
    assert [s.state for s in samples[41:]] == [State.DISARMED] * 19
    assert all(s.fault == Fault.NONE for s in samples[41:])


def test_a_reset_forgives_the_errors_before_it() -> None:
    device = ScriptedDevice(reads=failing(20, 200) | failing(300, 1))
    operator = armed_and_running({250: Request.RESET, 260: Request.ARM})
    _, loop = run_loop(device, operator, 320)
    assert dict(operator.answers)[250] is Answer.DONE
    assert loop.fault is Fault.NONE, "one error after a reset is one error"


def test_the_loss_of_the_commander_is_a_fault_only_while_something_is_commanded() -> None:
    _, idle = run_loop(ScriptedDevice(), ScriptedOperator({}, lost_at=3), 20)
    _, busy = run_loop(ScriptedDevice(), armed_and_running(lost_at=20), 40)
    assert (idle.fault, busy.fault) == (Fault.NONE, Fault.CONTROL_LOST)


def test_requests_that_do_not_fit_are_refused_and_change_nothing() -> None:
    operator = ScriptedOperator({1: program(), 2: Request.DISARM, 3: Request.RESET, 4: Request.ARM, 5: Request.ARM})
    samples, _ = run_loop(ScriptedDevice(), operator, 10)
    assert [a for _, a in operator.answers[:5]] == [Answer.REFUSED] * 3 + [Answer.DONE, Answer.REFUSED]
    assert samples[-1].state == State.ARMED


def test_disarming_writes_the_safe_state() -> None:
    device = ScriptedDevice()
    samples, _ = run_loop(device, ScriptedOperator({1: Request.ARM, 5: Request.DISARM}), 10)
    assert samples[5].state == State.DISARMED
    assert device.outputs == ["safe", *[(0.2, 0.2)] * 4, "safe", "safe"]


def test_a_termination_while_moving_is_told_as_a_fault_and_ends_safe() -> None:
    device = ScriptedDevice()
    operator = armed_and_running()

    ring = ListRing()
    loop = Loop(device, ScriptedClock(), ring, operator, LoopSettings())  # type: ignore[arg-type]
    device.reads[20] = lambda m: (loop.terminate(), m)[1]  # type: ignore[func-returns-value]
    loop.run()
    assert ring.samples[-1].tick == 20
    assert ring.samples[-1].fault == Fault.TERMINATED
    assert device.outputs[-2:] == ["safe", "safe"]


# the sensors


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
    ids=["nan", "inf", "-inf", "pressure out of range", "angle out of range", "broken wire", "stale", "not following", "absent"],
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
    reads = {20: DeviceError("scripted"), **{n: lambda m: m._replace(angle_deg=m.angle_deg + 40) for n in range(21, 60)}}
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
    assert all(s.dp_cmd_mpa != pytest.approx(s.p1_cmd_mpa - s.p2_cmd_mpa) for s in clipped), "what was asked for is kept as well"


def test_a_command_that_is_too_fast_is_clipped_and_flagged() -> None:
    settings = LoopSettings(limits=Limits(slew_mpa_s=0.3))
    samples, _ = run_loop(ScriptedDevice(found_mpa=(0.2, 0.2)), armed_and_running(), 60, settings=settings)
    assert any(s.flags & Flag.CLIPPED_SLEW for s in samples)
    steps = [abs(b.p1_cmd_mpa - a.p1_cmd_mpa) for a, b in itertools.pairwise(samples)]
    assert max(steps) <= 0.3 * 0.005 + 1e-12
