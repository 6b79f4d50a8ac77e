"""What the commanding process does about lost processes: real processes, a device that is a list of calls."""

import _thread
import asyncio
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from types import SimpleNamespace
from typing import Any, cast

import pytest
from support.rigs.watched_session import Bench, until

from rig.errors import DeviceError
from rig.realtime.faults import Fault
from rig.realtime.safe_report import LoopVerdict, Outcome, SafeReport, Writer
from rig.realtime.safe_state import SecondPath
from rig.realtime.state import State
from rig.sample import Sample
from rig.service.connections.protocol import Refused
from rig.service.session.process_watch import LOOP_PATIENCE_S, Loss
from rig.service.session.session_monitor import SessionMonitor
from rig.service.session.telemetry import Telemetry, safe_json

pytestmark = pytest.mark.real_time


@pytest.fixture
def bench() -> Iterator[Bench]:
    bench = Bench()
    yield bench
    bench.close()


def no_thread(*_: object) -> None:
    raise RuntimeError("can't start new thread")


def test_with_the_supervisor_lost_too_a_killed_loop_is_followed_up_here(bench: Bench) -> None:
    watch = bench.watch()
    bench.supervisor_works = False
    bench.loop.send(signal.SIGKILL)
    found = until(watch, lambda: watch.safe.safe)
    assert [loss.fault for loss in found] == [Fault.LOOP_DIED]
    assert (watch.safe.writer, watch.safe.outcome) == (Writer.CONTROL, Outcome.SEEN)
    assert "killed by signal 9" in watch.how_it_ended()


def test_a_loop_that_did_not_come_back_from_a_standstill_is_no_loop_that_died(bench: Bench) -> None:
    watch = bench.watch()
    bench.block.tell(SafeReport(Writer.SUPERVISOR, LoopVerdict.STALLED, Outcome.SEEN, 3, 1, 4, 5))
    bench.loop.end()
    assert watch.look() == Loss(Fault.LONG_STALL, "")
    assert watch.safe.safe
    assert "stood still with all the others" in watch.how_it_ended()
    assert bench.mailbox.estop_wanted() is Fault.NONE, "there is no loop of which anything could be demanded"


def test_a_machine_that_was_suspended_makes_the_rig_safe(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """The loop's own clock stood still with it: the sweep went on where it was, as if nothing had been."""
    asleep_s, clock_gettime = 0.0, time.clock_gettime

    def told(clock: int) -> float:
        return clock_gettime(time.CLOCK_MONOTONIC) + (asleep_s if clock == time.CLOCK_BOOTTIME else 0.0)

    monkeypatch.setattr(time, "clock_gettime", told)
    watch = bench.watch()
    assert watch.look() is None
    asleep_s = 3600.0
    bench.writer.beat()
    assert watch.look() == Loss(
        Fault.LONG_STALL, "the machine was suspended for 3600 s, and the rig was in nobody's hands"
    )
    assert bench.mailbox.estop_wanted() is Fault.LONG_STALL


def test_a_recorder_that_stood_still_with_all_the_others_is_not_lost(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It had "not moved for 20 s", after so long a pause: no reset without a new session, and a black box more."""
    now_ns, paused_ns = time.monotonic_ns, 0
    found = []
    with monkeypatch.context() as patch:  # whoever watches the tests looks at the clock after them
        patch.setattr(time, "monotonic_ns", lambda: now_ns() + paused_ns)
        patch.setattr(time, "monotonic", lambda: (now_ns() + paused_ns) * 1e-9)
        watch = bench.watch()
        bench.writer.put(Sample(**dict.fromkeys(Sample._fields, 0)))  # type: ignore[arg-type]
        for _ in range(6):
            bench.writer.beat()
            found.append(watch.look())
            paused_ns += 60_000_000_000
    assert found[:2] == [None, None]
    assert [loss.fault for loss in found if loss] == [Fault.RECORDER_DIED], "it does not come back either"


def test_a_machine_that_gives_no_thread_any_more_keeps_nobody_from_taking_over(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ended the daemon in the moment at which the loop was lost."""
    watch = bench.watch()
    monkeypatch.setattr(_thread, "start_new_thread", no_thread)
    monkeypatch.setattr(threading.Thread, "start", no_thread)
    bench.supervisor_works = False
    for _ in range(2):
        bench.loop.end()
        until(watch, lambda: watch.safe.safe)
    assert watch.safe.writer is Writer.CONTROL


def test_a_stopped_loop_is_ended_before_the_write_that_counts(bench: Bench) -> None:
    watch = bench.watch()
    bench.loop.send(signal.SIGSTOP)
    found = until(watch, lambda: watch.safe.outcome is Outcome.SEEN)
    assert found == [Loss(Fault.LOOP_DIED, "the loop has not moved for 0.1 s")]
    assert bench.wrote_while_alive[-1] is False
    assert not bench.loop.is_alive()


def test_a_supervisor_that_works_gets_its_time_and_is_believed(bench: Bench) -> None:
    watch = bench.watch()
    bench.loop.end()
    watch.look()
    bench.block.tell(SafeReport(Writer.SUPERVISOR, LoopVerdict.ENDED, Outcome.SEEN, 1, 1, 2, 3))
    until(watch, lambda: watch.safe.safe)
    time.sleep(2 * LOOP_PATIENCE_S)
    watch.look()
    assert bench.wrote_while_alive == []


@pytest.mark.parametrize("demanded", [False, True])
def test_beside_somebody_else_who_drives_by_now_it_writes_by_an_operator_s_word_alone(
    bench: Bench, demanded: bool
) -> None:
    """A daemon that was stopped, and goes on beside the next one, wrote into that one's sweep for as long as its own
    fault stood."""
    refused = threading.Event()

    def claim() -> AbstractContextManager[None]:
        refused.set()
        raise DeviceError("driven by process 12")

    watch = bench.watch(lambda: SecondPath(bench.safe, lambda: True, claim=claim))
    bench.supervisor_works = False
    if demanded:
        watch.demand(Fault.ESTOP)
    bench.loop.end()
    until(watch, lambda: watch.safe.safe if demanded else refused.is_set())
    assert bool(bench.wrote_while_alive) is demanded
    bench.block.release()
    watch.close()


def test_whoever_still_takes_over_at_the_end_comes_to_the_end_of_it(bench: Bench) -> None:
    """Somebody else was seen to have done it, the command ended, and its own attempt with it, between arming the
    module's watchdog anew and stopping it: half a second later the outputs went to 0."""
    began, told, closed = threading.Event(), threading.Event(), threading.Event()

    def slow() -> None:
        began.set()
        assert told.wait(5.0)
        time.sleep(0.1)

    watch = bench.watch(lambda: SecondPath(slow, lambda: True, closed.set))
    bench.supervisor_works = False
    bench.loop.end()
    until(watch, began.is_set)
    now_ns = time.monotonic_ns()
    bench.block.tell(SafeReport(Writer.GUARDIAN, LoopVerdict.ENDED, Outcome.SEEN, now_ns, 1, now_ns, now_ns))
    told.set()
    assert watch.settle(5.0).writer is Writer.GUARDIAN
    watch.close()
    assert closed.is_set()


def test_a_lost_supervisor_means_the_safe_state_by_a_loop_that_takes_it(bench: Bench) -> None:
    watch = bench.watch()
    bench.trouble = "the supervisor's process is gone"
    assert watch.look() == Loss(Fault.SUPERVISOR_DIED, bench.trouble)
    assert bench.mailbox.estop_wanted() is Fault.SUPERVISOR_DIED
    assert not watch.answer.safe
    time.sleep(0.001)
    bench.writer.beat()
    bench.writer.made_safe()
    bench.writer.saw_safe()
    assert (watch.answer.writer, watch.answer.outcome) == (Writer.LOOP, Outcome.SEEN)


def test_what_a_device_took_before_it_was_lost_is_called_safe_by_nobody(bench: Bench) -> None:
    """The status said `safe: true` beside "not confirmed", and an emergency stop meanwhile was answered with ok."""
    watch = bench.watch()
    bench.writer.made_safe()
    bench.writer.saw_safe()
    assert watch.safe.safe
    bench.writer.doubt_safe()
    shown = safe_json(watch.safe, (0.1, 0.1))
    assert shown is not None
    assert (shown["outcome"], shown["safe"], shown["confirmed"]) == ("doubted", False, False)
    assert shown["words"].startswith("NOT SAFE as far as is known: the device took the safe state from the loop, and")
    watch.demand(Fault.ESTOP)
    time.sleep(0.001)
    bench.writer.beat()
    assert not watch.answer.safe
    assert bench.loop.is_alive(), "it goes on to write it"
    bench.writer.made_safe()
    assert watch.answer.outcome is Outcome.WRITTEN


def test_a_loop_that_left_a_device_it_had_lost_is_followed_up(bench: Bench) -> None:
    """It ended in good order, and what it had written before the loss was taken for what stands."""
    watch = bench.watch()
    bench.supervisor_works = False
    bench.writer.made_safe()
    bench.writer.doubt_safe()
    bench.loop.end()
    until(watch, lambda: watch.safe.outcome is Outcome.SEEN)
    assert watch.safe.writer is Writer.CONTROL


@pytest.mark.parametrize("again", [False, True], ids=["once", "again and again"])
def test_a_loop_that_beats_but_does_not_take_the_demand_is_ended_too(bench: Bench, again: bool) -> None:
    watch = bench.watch()
    watch.demand(Fault.ESTOP)

    def safe() -> bool:
        bench.writer.beat()
        if again and bench.loop.is_alive():
            watch.demand(Fault.ESTOP)
        return watch.answer.safe

    until(watch, safe)
    assert watch.answer.writer is Writer.CONTROL
    assert bench.wrote_while_alive[-1] is False


def test_a_loop_whose_safe_state_is_on_its_way_over_a_slow_wire_is_not_ended(bench: Bench) -> None:
    watch = bench.watch()
    watch.demand(Fault.ESTOP)
    bench.writer.safe_coming(True)
    until_s = time.monotonic() + 3 * LOOP_PATIENCE_S

    def carried() -> bool:
        bench.writer.beat()
        assert not watch.answer.safe, "nobody has seen it"
        return time.monotonic() > until_s

    until(watch, carried)
    assert bench.loop.is_alive()
    assert bench.wrote_while_alive == []
    bench.writer.made_safe()
    bench.writer.beat()
    assert watch.answer.writer is Writer.LOOP


def test_nobody_is_lost_because_the_machine_stood_still(bench: Bench) -> None:
    """This process runs again first: the loop has neither beaten nor done what was demanded."""
    watch = bench.watch()
    assert watch.look() is None
    watch.demand(Fault.ESTOP)
    time.sleep(3 * LOOP_PATIENCE_S)
    assert watch.look() is None
    bench.writer.beat()
    bench.writer.made_safe()
    assert watch.look() is None
    time.sleep(LOOP_PATIENCE_S)  # for whoever would take over
    assert bench.loop.is_alive()
    assert bench.wrote_while_alive == []
    assert watch.answer.writer is Writer.LOOP


def test_a_device_out_of_reach_is_tried_for_as_long_as_it_takes(bench: Bench) -> None:
    watch = bench.watch()
    bench.supervisor_works, bench.unreachable = False, True
    bench.loop.end()
    until(watch, lambda: watch.safe.outcome is Outcome.FAILED)
    assert not watch.answer.safe
    bench.unreachable = False
    until(watch, lambda: watch.safe.outcome is Outcome.SEEN)


def test_an_emergency_stop_that_the_device_did_not_take_is_refused(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rig.service.session.emergency_stop.ESTOP_PATIENCE_S", 0.3)
    bench.unreachable = True
    bench.loop.send(signal.SIGSTOP)
    monitor = SessionMonitor(cast(Any, None))
    monitor.session = cast(Any, SimpleNamespace(watch=bench.watch(), loop_alive=True))
    with pytest.raises(
        Refused, match="emergency stop not carried out: NOT SAFE as far as is known: the commanding process could not"
    ):
        asyncio.run(monitor.estop())
    bench.unreachable = False
    assert asyncio.run(monitor.estop()).writer is Writer.CONTROL


def test_who_was_answered_an_emergency_stop_finds_its_fault(bench: Bench) -> None:
    """The status still said what was before it, and a reset that followed at once was refused."""
    bench.writer.put(Sample(**dict.fromkeys(Sample._fields, 0))._replace(state=State.ARMED))  # type: ignore[arg-type]
    monitor = SessionMonitor(cast(Any, SimpleNamespace(driver=str)))
    monitor.session = cast(Any, SimpleNamespace(watch=bench.watch(), loop_alive=True, ring=bench.ring))
    monitor.telemetry = Telemetry(bench.ring)
    monitor.telemetry.update()

    async def stopped() -> State:
        asked = asyncio.create_task(monitor.estop())
        await asyncio.sleep(0.002)
        bench.writer.beat()
        bench.writer.made_safe()
        bench.writer.saw_safe()
        await asyncio.sleep(0.006)  # the sample of that tick comes last
        fault = Sample(**dict.fromkeys(Sample._fields, 0))._replace(state=State.FAULT, fault=Fault.ESTOP)  # type: ignore[arg-type]
        bench.writer.put(fault)
        await asked
        return monitor.state

    assert asyncio.run(stopped()) is State.FAULT


def test_what_the_loop_wrote_and_cannot_read_back_is_looked_at_from_here(bench: Bench) -> None:
    watch = bench.watch()
    bench.writer.put(Sample(**dict.fromkeys(Sample._fields, 0))._replace(fault=Fault.ESTOP))  # type: ignore[arg-type]
    bench.ring.recorded = bench.ring.head
    bench.writer.made_safe()

    def seen() -> bool:
        bench.writer.beat()
        return watch.safe.outcome is Outcome.SEEN

    until(watch, seen)
    assert watch.safe.writer is Writer.LOOP
    assert bench.wrote_while_alive == []
