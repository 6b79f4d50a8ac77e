"""The loop through a run, tick by tick on a scripted clock and device: arming, phases, set-points, the zero."""

import itertools
import math

import pytest
from support.scripted import (
    OFFSET_DEG,
    ScriptedDevice,
    ScriptedOperator,
    armed_and_running,
    failing,
    program,
    run_loop,
)

from rig.interfaces import Role
from rig.realtime.commands import Answer, Request
from rig.realtime.faults import Fault
from rig.sample import Flag, Phase, Sample


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
    assert [(s.p1_cmd_mpa, s.p2_cmd_mpa) for s in swept] == list(zip(wanted.p1_cmd_mpa, wanted.p2_cmd_mpa, strict=True))
    assert [s.dp_cmd_mpa for s in swept] == pytest.approx(
        [a - b for a, b in zip(wanted.p1_cmd_mpa, wanted.p2_cmd_mpa, strict=True)]
    )
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
    samples, _ = run_loop(
        ScriptedDevice(found_mpa=(0.11, 0.17)), ScriptedOperator({0: Request.ARM, 5: program(part=100)}), 40
    )
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
