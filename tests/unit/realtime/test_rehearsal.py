"""Waking early and rehearsing: never early for the deadline, without effect on rig and record, and never in the way."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from support.scripted import PERIOD_NS, ListRing, ScriptedDevice, armed_and_running

from rig.app import compose
from rig.app.loop_process import loop_settings, punctual, rehearse_for
from rig.interfaces import Clock, Device
from rig.qualify.benchmarks.tracking import closed_at_rest
from rig.qualify.lateness import at_rest
from rig.realtime import clock as clocks
from rig.realtime.clock import MonotonicClock, VirtualClock, WarmUpClock
from rig.realtime.commands import Mailbox, Request, Script
from rig.realtime.faults import Fault
from rig.realtime.loop import Loop, LoopSettings
from rig.realtime.rehearsal import NoDevice, Rehearsal, Rehearsals
from rig.realtime.state import State
from rig.sample import Phase, Sample

US = 1_000
EARLY_NS = 400 * US


class FakeTime:
    """Stands in for the module `time`: looking at it takes 1 us, sleeping takes as long as asked for and `late_ns`
    more."""

    def __init__(self) -> None:
        self.now_ns = 10**9
        self.late_ns = 0
        self.slept_ns = 0

    def monotonic_ns(self) -> int:
        self.now_ns += US
        return self.now_ns

    def sleep(self, seconds: float) -> None:
        self.now_ns += round(seconds * 1e9) + self.late_ns
        self.slept_ns += round(seconds * 1e9)


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> FakeTime:
    fake = FakeTime()
    monkeypatch.setattr(clocks, "time", fake)
    return fake


def taking(fake: FakeTime, takes_ns: int, began: list[int]) -> Callable[[], None]:
    """A rehearsal of that length, which notes when it began."""

    def rehearse() -> None:
        began.append(fake.now_ns)
        fake.now_ns += takes_ns

    return rehearse


@pytest.mark.parametrize(("takes_us", "times"), [(20, 14), (100, 2), (300, 1)])
def test_it_wakes_early_rehearses_while_there_is_time_and_is_on_time(fake: FakeTime, takes_us: int, times: int) -> None:
    began: list[int] = []
    clock = WarmUpClock(EARLY_NS, taking(fake, takes_us * US, began))
    for _ in range(20):
        fake.late_ns = 50 * US
        deadline_ns = fake.now_ns + PERIOD_NS
        clock.wait_until_ns(deadline_ns)
        assert 0 <= fake.now_ns - deadline_ns <= 2 * US
        assert began[-1] + takes_us * US <= deadline_ns
    assert len(began) == 20 * times


@pytest.mark.parametrize("late_us", [390, 2000])
def test_who_wakes_too_late_does_not_rehearse(fake: FakeTime, late_us: int) -> None:
    began: list[int] = []
    clock = WarmUpClock(EARLY_NS, taking(fake, 100 * US, began))
    fake.late_ns = late_us * US
    deadline_ns = fake.now_ns + PERIOD_NS
    clock.wait_until_ns(deadline_ns)
    assert began == []
    assert fake.now_ns >= deadline_ns


def test_a_deadline_that_has_passed_is_not_waited_for(fake: FakeTime) -> None:
    began: list[int] = []
    WarmUpClock(EARLY_NS, taking(fake, 100 * US, began)).wait_until_ns(fake.now_ns - PERIOD_NS)
    assert began == []
    assert fake.slept_ns == 0


def test_on_a_slow_machine_rehearsals_that_make_ticks_late_are_given_up(fake: FakeTime) -> None:
    began: list[int] = []
    clock = WarmUpClock(EARLY_NS, taking(fake, 2 * EARLY_NS, began))
    for _ in range(1000):
        clock.wait_until_ns(fake.now_ns + PERIOD_NS)
    assert 0 < len(began) <= 10


def test_after_one_long_rehearsal_one_is_left_out(fake: FakeTime) -> None:
    began: list[int] = []
    clock = WarmUpClock(EARLY_NS, taking(fake, 2 * EARLY_NS, began))
    clock.wait_until_ns(fake.now_ns + PERIOD_NS)
    clock.rehearse = taking(fake, 300 * US, began)
    for _ in range(300):
        fake.late_ns = 50 * US
        clock.wait_until_ns(fake.now_ns + PERIOD_NS)
    assert len(began) == 1 + 299


def test_a_rehearsal_is_a_tick_in_the_middle_of_a_sweep() -> None:
    rehearsal = Rehearsal(NoDevice(0.2, 0.2), VirtualClock(), LoopSettings())
    loop = rehearsal.loop
    published = ListRing()
    loop.ring = published  # type: ignore[assignment]
    for _ in range(2000):
        rehearsal()
    assert not rehearsal.failed
    assert {(s.state, s.phase, s.fault) for s in published.samples} == {(State.RUNNING, Phase.SWEEP, Fault.NONE)}
    assert len(published.samples) == 2000


def test_an_error_of_the_rehearsal_ends_the_rehearsals_and_nothing_else() -> None:
    class Breaking(NoDevice):
        calls = 0

        def read(self):  # type: ignore[no-untyped-def]
            self.calls += 1
            if self.calls > 10:
                raise ZeroDivisionError("scripted bug")
            return super().read()

    device = Breaking(0.2, 0.2)
    rehearsal = Rehearsal(device, VirtualClock(), LoopSettings())
    for _ in range(20):
        rehearsal()
    assert rehearsal.failed
    assert device.calls == 11


class RehearsedVirtually(VirtualClock):
    """Virtual time with a rehearsal before each tick."""

    rehearse: Callable[[], None] = staticmethod(lambda: None)

    def wait_until_ns(self, deadline_ns: int) -> None:
        self.rehearse()
        super().wait_until_ns(deadline_ns)


def simulated_run(rehearsed: bool) -> list[Sample]:
    """A short sweep on the simulated rig, with or without rehearsals in between."""
    rig = compose.load(None)
    clock, ring = RehearsedVirtually(), ListRing()
    device = compose.make_device(rig, clock)
    if rehearsed:
        beside = VirtualClock()
        clock.rehearse = Rehearsal(device.twin(beside), beside, loop_settings(rig))  # type: ignore[attr-defined]
    operator = armed_and_running({100: Request.QUIT})
    device.open()
    Loop(device, clock, ring, operator, loop_settings(rig)).run()  # type: ignore[arg-type]
    return ring.samples


def test_the_simulated_rig_does_not_notice_its_twin() -> None:
    assert simulated_run(rehearsed=True) == simulated_run(rehearsed=False)


@pytest.mark.parametrize(
    ("early_us", "period_ms", "early_ns"), [(400, 5, 400_000), (2000, 5, 1_250_000), (400, 1, 250_000)]
)
def test_of_a_period_at_most_a_quarter_is_taken(early_us: int, period_ms: int, early_ns: int) -> None:
    assert made_clock(early_us, period_ms, ScriptedDevice()).early_ns == early_ns  # type: ignore[attr-defined]


def test_who_does_not_want_it_sleeps_until_the_tick() -> None:
    assert type(made_clock(0, 5, ScriptedDevice())) is MonotonicClock


def test_a_device_without_a_twin_is_never_called_by_a_rehearsal() -> None:
    device = ScriptedDevice()
    clock = made_clock(400, 5, device)
    assert isinstance(clock, WarmUpClock)
    clock.wait_until_ns(clock.now_ns() + PERIOD_NS)
    assert device.calls == {"read": 0, "write": 0, "safe": 0}
    assert device.outputs == []


def made_clock(early_us: int, period_ms: int, device: Device) -> Clock:
    rig = compose.load(None)
    rig = replace(rig, period_ns=period_ms * 10**6, realtime=replace(rig.realtime, early_us=early_us))
    return punctual(MonotonicClock(), device, rig)


def test_a_running_loop_says_which_kind_of_tick_is_rehearsed() -> None:
    said: list[str] = []
    rehearsals = Rehearsals(lambda: said.append("open"), lambda: said.append("closed"))  # type: ignore[arg-type]
    rig = compose.load(None)
    for program, kind in ((at_rest(rig, 20), "open"), (closed_at_rest(rig, 20), "closed")):
        clock, ring = RehearsedVirtually(), ListRing()
        device = compose.make_device(rig, clock)
        device.open()
        loop = Loop(device, clock, ring, Script([program], Mailbox.private()), loop_settings(rig))  # type: ignore[arg-type]
        rehearsals.follows_angle = loop.follows_angle
        clock.rehearse = rehearsals  # type: ignore[assignment]
        said.clear()
        loop.run()
        running = [sample for sample in ring.samples if sample.phase is Phase.SWEEP]
        assert len(running) == 20
        assert said.count(kind) >= 18, said
        assert said[0] == "open", "nothing runs yet"


def test_the_clock_of_a_rig_is_told_what_its_loop_carries_out() -> None:
    rig = compose.load(None)
    device = compose.make_device(rig, MonotonicClock())
    clock = punctual(MonotonicClock(), device, rig)
    loop = Loop(device, clock, ListRing(), Script([at_rest(rig, 5)], Mailbox.private()), loop_settings(rig))  # type: ignore[arg-type]
    rehearse_for(loop, clock)
    assert isinstance(clock, WarmUpClock)
    assert isinstance(clock.rehearse, Rehearsals)
    assert clock.rehearse.follows_angle == loop.follows_angle
    clock.rehearse()
