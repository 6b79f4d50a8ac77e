"""The loop on a device that fails: forgiven, counted, faulted, and safe on every way out."""

import math

import pytest
from support.scripted import (
    ListRing,
    ScriptedClock,
    ScriptedDevice,
    ScriptedOperator,
    armed_and_running,
    failing,
    run_loop,
)

from rig.errors import DeviceError, DeviceLost, DevicePending
from rig.interfaces import Measurement
from rig.realtime.commands import Answer, Request
from rig.realtime.faults import Fault
from rig.realtime.loop import Loop, LoopSettings
from rig.realtime.state import State
from rig.sample import Flag


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
    assert sum(bool(s.flags & Flag.WRITE_ERROR) for s in samples) == 9, (
        "+2 for the write, -1 for the read of the same tick"
    )
    assert device.outputs[-1] == "safe"


@pytest.mark.parametrize("where", ["reads", "writes"])
def test_a_lost_device_faults_at_once(where: str) -> None:
    device = ScriptedDevice(**{where: {15: DeviceLost("scripted: gone")}})
    samples, loop = run_loop(device, armed_and_running({40: Request.RESET}), 60)
    assert loop.fault is Fault.DEVICE_LOST
    faulted = [s for s in samples if s.fault]
    assert "safe" in device.outputs, "tried although the device said it was lost"
    assert "scripted: gone" in loop.ring.device_messages, "in the driver's words"
    assert all(s.state == State.FAULT for s in faulted)


@pytest.mark.parametrize("where", ["reads", "writes"])
def test_the_cause_is_published_before_the_way_to_a_lost_device_is_tried(where: str) -> None:
    """That way may be a new I/O process: whoever ends a loop that takes too long over it must find why it does."""
    ring, published = ListRing(), []

    class Lost(ScriptedDevice):
        def safe(self) -> None:
            published.append(ring.samples[-1].fault if ring.samples else 0)
            super().safe()

    device = Lost(**{where: {15: DeviceLost("scripted: gone")}})  # type: ignore[arg-type]
    operator = armed_and_running({40: Request.QUIT})
    loop = Loop(device, ScriptedClock(), ring, operator, LoopSettings())  # type: ignore[arg-type]
    loop.run()
    assert published[0] == Fault.NONE, "at the start"
    assert published[1:] == [Fault.DEVICE_LOST] * len(published[1:])
    assert len(published) > 1
    assert len({sample.tick for sample in ring.samples}) == len(ring.samples), "one sample a tick"


def test_a_silent_device_is_the_cause_also_where_the_way_to_safe_takes_long() -> None:
    """Waiting for its answer, and then for the safe state, took longer than the supervisor bears: the loop was ended
    before it had said anything, and was blamed for it (LOOP_DIED)."""
    clock, ring, found = ScriptedClock(), ListRing(), []
    ring.now_ns = clock.now_ns

    class Silent(ScriptedDevice):
        def read(self) -> Measurement:
            try:
                return super().read()
            except DeviceError:
                clock.let_pass(4_000_000)
                raise

        def safe(self) -> None:
            found.append((ring.samples[-1].fault if ring.samples else 0, clock.now_ns() - ring.beaten_ns))
            super().safe()

    device = Silent(reads=failing(15, 5))
    Loop(device, clock, ring, armed_and_running({40: Request.QUIT}), LoopSettings()).run()  # type: ignore[arg-type]
    assert found[1] == (Fault.DEVICE_ERRORS, 0), "told, and the time for the safe state begins with it"


def test_a_lost_device_is_never_read_again_and_cannot_be_reset() -> None:
    device = ScriptedDevice(reads={15: DeviceLost("scripted: gone")})
    operator = armed_and_running({40: Request.RESET})
    run_loop(device, operator, 60)
    assert (40, Answer.GONE) in operator.answers
    assert device.calls["read"] == 16


def test_a_safe_state_that_could_not_be_written_is_owed_until_it_is() -> None:
    device = ScriptedDevice(safes=failing(1, 5))  # number 0 is the one of the first tick
    operator = armed_and_running({45: Request.RESET, 55: Request.RESET}, estop=range(40, 46))
    samples, _ = run_loop(device, operator, 60)
    assert [s.tick for s in samples if s.flags & Flag.WRITE_ERROR] == [40, 41, 42, 43, 44]
    assert device.outputs.count("safe") >= 2
    assert [a for t, a in operator.answers if t in (45, 55)] == [Answer.NOT_READY, Answer.DONE]


def test_a_safe_state_that_is_on_its_way_is_owed_and_is_no_error() -> None:
    """A slow wire carries it for some ticks; it was said to stand there at once."""
    device = ScriptedDevice(safes={call: DevicePending("on its way") for call in range(1, 9)})
    operator = armed_and_running({45: Request.RESET, 55: Request.RESET}, estop=range(40, 46))
    samples, loop = run_loop(device, operator, 60)
    assert not any(sample.flags & Flag.WRITE_ERROR for sample in samples)
    assert loop.ring.safe == ["made", "not", *["coming"] * 8, "made", "made"]  # the last: on the way out
    assert [a for t, a in operator.answers if t in (45, 55)] == [Answer.NOT_READY, Answer.DONE]


@pytest.mark.parametrize(
    ("reads", "late"),
    [({}, {30: 2_000_000_000}), ({at: DeviceError("scripted: refused") for at in range(30, 45)}, {})],
    ids=["a standstill", "an outage"],
)
def test_what_stood_safe_may_not_after_a_standstill_or_an_outage(
    reads: dict[int, Exception], late: dict[int, int]
) -> None:
    """A device's own watchdog takes its outputs elsewhere meanwhile, and may refuse everything until it is armed anew,
    which is done with the safe state. It was written once, at the fault."""
    device = ScriptedDevice(reads=dict(reads))
    operator = armed_and_running({50: Request.RESET}, estop=range(20, 26))
    _, loop = run_loop(device, operator, 60, ScriptedClock(late))
    assert device.outputs[:-1].count("safe") >= 3, "at the start, at the stop, and after it"
    assert loop.ring.safe.count("doubted") == 1  # type: ignore[attr-defined]
    assert (50, Answer.DONE) in operator.answers


class ReadsBack(ScriptedDevice):
    """One that tells what stands at its outputs, unless it was told not to."""

    held: bool | None = True

    def holds_safe(self) -> bool | None:
        return self.held


@pytest.mark.parametrize(("held", "written_again"), [(True, 0), (None, 1)])
def test_a_device_lost_after_the_stop_is_written_to_again_unless_the_safe_state_was_seen(
    held: bool | None, written_again: int
) -> None:
    device = ReadsBack(reads={50: DeviceLost("scripted: gone")})
    device.held = held
    _, loop = run_loop(device, armed_and_running(estop=range(40, 60)), 55)
    at_the_start, at_the_stop, at_the_end, by_arming = 1, 1, 1, 1
    assert device.outputs.count("safe") == at_the_start + at_the_stop + written_again + at_the_end
    assert loop.ring.safe.count("not") == by_arming + written_again


class OutOfSight(ReadsBack):
    """Away from the loss that the scripted reads tell of, for some calls."""

    away = 5

    def _gone(self) -> bool:
        lost = any(at < self.calls["read"] for at in self.reads)
        self.away -= lost
        return lost and self.away >= 0

    def holds_safe(self) -> bool | None:
        if self._gone():
            raise DeviceLost("scripted: gone")
        return super().holds_safe()

    def safe(self) -> None:
        if self._gone():
            raise DeviceLost("scripted: gone")
        super().safe()


@pytest.mark.parametrize("estop", [range(10, 16), range(0)], ids=["after a stop", "while disarmed"])
def test_a_device_that_is_lost_when_it_was_seen_safe_is_not_seen_any_more(estop: range) -> None:
    """Its own watchdog took the outputs to what it holds for safe, for as long as the network was away and longer: the
    status said "seen at the device", and nobody wrote."""
    device = OutOfSight(reads={30: DeviceLost("scripted: gone")})
    operator = ScriptedOperator({50: Request.RESET}, estop=estop)
    _, loop = run_loop(device, operator, 60)
    said = loop.ring.safe  # type: ignore[attr-defined]
    since = said[said.index("failed") - said[: said.index("failed")].count("doubted") :]
    assert since.count("doubted") == 1
    assert since[-4:] == ["made", "seen", "made", "seen"]
    assert said.count("failed") >= 3
    assert "not" not in said, "it was written: who commands ends no loop for it"
    assert (50, Answer.GONE) in operator.answers


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
