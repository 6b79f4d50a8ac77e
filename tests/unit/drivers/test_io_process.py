"""The I/O process and its mailbox without a wire and without a second process: a link that does as told, and a clock
that is turned."""

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace

import pytest
from support.own_mailbox import own_mailbox

from drivers.io_process import worker as workers
from drivers.io_process.mailbox import IoMailbox, LinkState, OutputsMode, Trip
from drivers.io_process.worker import Exchange, Worker, WorkerSetup
from rig.errors import DeviceError, DeviceLost

SAFE = (409.0,)
SILENCE_NS = 25_000_000


class Clock:
    """Stands in for the module `time` inside the worker."""

    def __init__(self) -> None:
        self.ns = 1_000_000_000

    def monotonic_ns(self) -> int:
        return self.ns


class ScriptedLink:
    """Confirms what it is given, unless told to fail."""

    def __init__(self) -> None:
        self.sent: list[tuple[float, ...]] = []
        self.fail: DeviceError | None = None
        self.closed = 0
        self.settled = False
        """Whether it was told at its last `close` that the outputs are where they are to stay."""
        self.connects = 0

    def connect(self) -> Mapping[str, str]:
        self.connects += 1
        if self.fail:
            raise self.fail
        return {"port": "scripted"}

    def exchange(self, outputs: tuple[float, ...] | None, fresh: bool, urgent: bool) -> Exchange:
        assert not urgent or outputs == SAFE
        if self.fail:
            raise self.fail
        if outputs is not None and fresh:
            self.sent.append(outputs)
            return Exchange(sent=True)
        return Exchange(values={0: (123.0, 5)})

    def close(self, settled: bool = False) -> None:
        self.closed += 1
        self.settled = settled


@pytest.fixture
def box(tmp_path: Path) -> IoMailbox:
    return own_mailbox(tmp_path)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(workers, "time", SimpleNamespace(monotonic_ns=clock.monotonic_ns))
    return clock


@pytest.fixture
def link() -> ScriptedLink:
    return ScriptedLink()


@pytest.fixture
def worker(link: ScriptedLink, box: IoMailbox, clock: Clock) -> Worker:
    worker = Worker(link, box, WorkerSetup("scripted", {}, SAFE, SILENCE_NS))
    assert worker.connect()
    return worker


def drive(box: IoMailbox, clock: Clock, count: float) -> int:
    return box.post_order(clock.ns, OutputsMode.DRIVE, (count,))


def test_only_the_newest_set_point_is_written(worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock) -> None:
    for count in (1.0, 2.0, 3.0):
        drive(box, clock, count)
    worker.turn()
    assert link.sent == [(3.0,)]
    assert box.report().order_done == 3
    worker.turn()
    assert link.sent == [(3.0,)], "written once, then measured"
    assert box.report().values[0] == 123.0


def test_before_the_first_order_nothing_is_written(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    for _ in range(3):
        clock.ns += 10 * SILENCE_NS
        worker.turn()
    assert link.sent == []
    assert box.report().trip is Trip.NONE


def test_a_silent_owner_is_taken_for_dead(worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock) -> None:
    drive(box, clock, 700.0)
    worker.turn()
    clock.ns += SILENCE_NS
    worker.turn()
    assert box.report().trip is Trip.NONE
    clock.ns += 1
    worker.turn()
    assert link.sent == [(700.0,), SAFE]
    assert box.report().trip is Trip.SILENCE
    drive(box, clock, 800.0)
    worker.turn()
    assert link.sent[-1] == SAFE, "latched: the owner that comes back does not drive"


def test_a_driving_owner_that_dies_leaves_safe_outputs(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    drive(box, clock, 700.0)
    worker.turn()
    worker.orphan()
    assert not worker.finished
    worker.turn()
    assert link.sent[-1] == SAFE
    assert worker.finished
    assert box.report().trip is Trip.ORPHANED


def test_an_owner_that_lets_go_leaves_its_outputs(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    drive(box, clock, 700.0)
    worker.turn()
    box.post_order(clock.ns, OutputsMode.RELEASED, ())
    worker.orphan()
    assert worker.finished
    assert link.sent == [(700.0,)]


def test_a_safe_order_outlives_its_owner(worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock) -> None:
    drive(box, clock, 700.0)
    worker.turn()
    box.post_order(clock.ns, OutputsMode.SAFE, SAFE)
    worker.orphan()
    assert not worker.finished
    worker.turn()
    assert link.sent[-1] == SAFE
    assert worker.finished


@pytest.mark.parametrize("mode", [OutputsMode.SAFE, OutputsMode.RELEASED])
def test_outputs_that_stand_stay_whatever_the_last_exchange_was(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock, mode: OutputsMode
) -> None:
    """The device's own watchdog is to be stopped then."""
    drive(box, clock, SAFE[0])
    worker.turn()
    box.post_order(clock.ns, mode, SAFE)
    worker.turn()
    link.fail = DeviceError("late")
    worker.turn()
    worker.end()
    assert link.settled


def test_outputs_that_could_not_be_written_are_left_to_the_device_s_own_watchdog(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    drive(box, clock, 700.0)
    worker.turn()
    box.post_order(clock.ns, OutputsMode.SAFE, SAFE)
    link.fail = DeviceError("busy")
    worker.turn()
    worker.orphan()
    clock.ns += 3_000_000_000
    worker.turn()
    assert worker.finished
    worker.end()
    assert not link.settled


def test_who_is_let_go_as_its_line_comes_back_leaves_the_watchdog_on(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    """The owner saw the line down, and asked for nothing more; old set-points stand."""
    drive(box, clock, 700.0)
    worker.turn()
    link.fail = DeviceLost("pulled")
    worker.turn()
    box.post_order(clock.ns, OutputsMode.RELEASED, ())
    worker.orphan()
    assert worker.finished
    link.fail = None
    worker.end()
    assert not link.settled


def test_an_alarm_from_outside_is_obeyed_in_every_mode_and_latched(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    count = box.raise_alarm()
    worker.turn()
    assert link.sent == [SAFE]
    assert box.report().alarm_done == count
    drive(box, clock, 700.0)
    worker.turn()
    assert link.sent == [SAFE]
    count = box.raise_alarm()
    worker.turn()
    assert link.sent == [SAFE, SAFE], "asked again, written again"
    assert box.report().alarm_done == count


def test_an_alarm_from_before_the_first_turn_is_heard(link: ScriptedLink, box: IoMailbox, clock: Clock) -> None:
    count = box.raise_alarm()
    late = Worker(link, box, WorkerSetup("scripted", {}, SAFE, SILENCE_NS))
    assert late.connect()
    late.turn()
    assert (link.sent, box.report().alarm_done) == ([SAFE], count)


def test_safe_outputs_count_as_confirmed_from_the_device_s_word_until_something_else_may_follow(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    drive(box, clock, SAFE[0])
    worker.turn()
    assert box.report().holds_safe
    assert not box.confirmed, "the owner still drives"
    box.post_order(clock.ns, OutputsMode.SAFE, SAFE)
    assert not box.confirmed, "ordered, and not answered for yet"
    worker.turn()
    assert box.confirmed
    box.raise_alarm()
    assert not box.confirmed, "asked for again"
    worker.turn()
    assert box.confirmed
    link.fail = DeviceLost("unplugged")
    worker.turn()
    assert not box.confirmed


def test_single_failures_are_counted_and_the_line_is_kept(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    link.fail = DeviceError("garbled")
    for _ in range(4):
        worker.turn()
    assert (box.report().state, box.report().errors, box.report().text) == (LinkState.UP, 4, "garbled")
    link.fail = None
    worker.turn()
    assert link.closed == 0


def test_an_outage_while_driving_ends_safe_as_soon_as_the_line_is_back(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    drive(box, clock, 700.0)
    worker.turn()
    link.fail = DeviceLost("unplugged")
    worker.turn()
    assert box.report().state is LinkState.DOWN
    link.fail = None
    for _ in range(100):
        clock.ns += 10_000_000
        drive(box, clock, 800.0)
        worker.turn()
    assert (700.0,) in link.sent
    assert (800.0,) not in link.sent
    assert link.sent[-1] == SAFE
    assert (box.report().state, box.report().trip, box.report().reconnects) == (LinkState.UP, Trip.OUTAGE, 1)


def test_what_was_sent_and_never_confirmed_counts_as_driven(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    """The device may have obeyed a set-point whose reply was late or broken. When the line came back it was sent once
    more."""
    drive(box, clock, 700.0)
    link.fail = DeviceError("a reply without its end")
    for _ in range(5):
        worker.turn()
    assert (box.report().state, box.report().trip) == (LinkState.DOWN, Trip.OUTAGE)
    link.fail = None
    clock.ns += 1_000_000_000
    drive(box, clock, 700.0)
    worker.turn()
    assert link.sent == [SAFE]


def test_an_outage_before_anything_was_sent_takes_nothing_over(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    link.fail = DeviceLost("unplugged")
    worker.turn()
    assert (box.report().state, box.report().trip) == (LinkState.DOWN, Trip.NONE)


def test_a_lost_line_is_tried_again_but_not_without_pause(worker: Worker, link: ScriptedLink, clock: Clock) -> None:
    link.fail = DeviceLost("unplugged")
    for _ in range(1000):
        clock.ns += 1_000_000
        worker.turn()
    assert 3 <= link.connects - 1 <= 5, "one second at four tries a second"


def test_an_orphan_gives_up_on_a_line_that_stays_dead(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    drive(box, clock, 700.0)
    worker.turn()
    link.fail = DeviceLost("unplugged")
    worker.turn()
    worker.orphan()
    turns = 0
    while not worker.finished and turns < 1000:
        clock.ns += 10_000_000
        worker.turn()
        turns += 1
    assert 150 <= turns <= 250, "about two seconds"


def test_a_refused_first_connection_is_final_and_says_why(link: ScriptedLink, box: IoMailbox, clock: Clock) -> None:
    link.fail = DeviceError("no such port")
    assert not Worker(link, box, WorkerSetup("scripted", {}, SAFE, SILENCE_NS)).connect()
    assert (box.report().state, box.report().text) == (LinkState.REFUSED, "no such port")


def test_what_failed_is_told_also_when_the_line_is_back_before_its_owner_looks(
    worker: Worker, link: ScriptedLink, box: IoMailbox, clock: Clock
) -> None:
    """The facts of the line stood there instead, on several lines."""
    worker.connect()
    link.fail = DeviceError("no answer within 102 ms")
    for _ in range(WorkerSetup("scripted", {}, SAFE, SILENCE_NS).lost_after):
        worker.turn()
    assert box.report().state is LinkState.DOWN
    link.fail = None
    clock.ns += 1_000_000_000
    worker.turn()
    assert (box.report().state, box.report().reconnects) == (LinkState.UP, 1)
    assert box.report().text == "no answer within 102 ms"
