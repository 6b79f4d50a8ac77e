"""The loop and its operator, by script: stop, emergency stop, reset, disarm, termination, a commander that is lost."""

import pytest
from support.scripted import (
    ListRing,
    ScriptedClock,
    ScriptedDevice,
    ScriptedOperator,
    armed_and_running,
    failing,
    program,
    run_loop,
)

from rig.realtime.commands import Answer, Request
from rig.realtime.faults import Fault
from rig.realtime.loop import Loop, LoopSettings
from rig.realtime.state import State
from rig.sample import Phase


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
    operator = armed_and_running(
        {24: Request.RESET, 40: program(2), 41: Request.RESET, 45: program(3)}, estop=range(22, 30)
    )
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
