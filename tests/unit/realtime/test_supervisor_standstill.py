"""The supervisor and a loop that stood still together, on a clock that is turned: what the loop's silence is called."""

import os
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any, cast

import pytest

from rig.realtime import supervisor as supervisors
from rig.realtime.faults import Fault
from rig.realtime.safe_report import LoopVerdict, Outcome, SafeBlock, SafeReport, Writer
from rig.realtime.supervisor import Supervisor

PERIOD_NS = 5_000_000
STOOD_NS = 25_000_000_000


class Turned:
    """A loop that ticks while the clock is turned by whoever waits for its end, until `silent_ns`."""

    def __init__(self) -> None:
        self.now_ns = self.heartbeat_ns = 1_000_000_000
        self.silent_ns = 0
        self.stands_ns = 0
        """When everybody stands still."""

    def gone_within(self, seconds: float) -> bool:
        until_ns = self.now_ns + round(seconds * 1e9)
        if self.now_ns <= self.stands_ns < until_ns:
            until_ns += STOOD_NS
            self.heartbeat_ns = until_ns  # its first tick since
        self.now_ns = until_ns
        if self.now_ns < self.silent_ns:
            self.heartbeat_ns = self.now_ns
        return False


@pytest.fixture
def block() -> Iterator[SafeBlock]:
    block = SafeBlock.create(f"test-{os.getpid()}-{time.monotonic_ns()}-safe", 1)
    yield block
    block.block.unlink()


def verdict(block: SafeBlock, monkeypatch: pytest.MonkeyPatch, change: Callable[[Turned], None]) -> LoopVerdict:
    turned = Turned()
    change(turned)
    monkeypatch.setattr(supervisors, "time", SimpleNamespace(monotonic_ns=lambda: turned.now_ns))
    found: list[LoopVerdict] = []
    ring, authority = cast(Any, turned), cast(Any, SimpleNamespace(take_over=found.append))
    watcher = Supervisor(
        Writer.SUPERVISOR, ring, block, cast(Any, turned), authority, patience_ns=3 * PERIOD_NS, period_ns=PERIOD_NS
    )
    assert [watcher.run()] == found
    return found[0]


def test_a_loop_that_has_not_come_back_from_a_standstill_of_all_did_not_hang(
    block: SafeBlock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A simulated plant that makes up for 25 s holds its loop up for longer than that may be silent: it was called a
    loop that ended or hung."""

    def stands(turned: Turned) -> None:
        turned.stands_ns = turned.silent_ns = turned.now_ns + 100 * PERIOD_NS

    found = verdict(block, monkeypatch, stands)
    assert (found, found.fault) == (LoopVerdict.STALLED, Fault.LONG_STALL)


def test_a_loop_that_hangs_after_it_has_ticked_again_hangs(block: SafeBlock, monkeypatch: pytest.MonkeyPatch) -> None:
    def goes_on(turned: Turned) -> None:
        turned.stands_ns = turned.now_ns + 100 * PERIOD_NS
        turned.silent_ns = turned.stands_ns + STOOD_NS + 100 * PERIOD_NS

    found = verdict(block, monkeypatch, goes_on)
    assert (found, found.fault) == (LoopVerdict.SILENT, Fault.LOOP_DIED)


def test_the_end_of_a_loop_is_called_by_who_saw_its_loss_first(block: SafeBlock) -> None:
    assert block.loop_fault is Fault.LOOP_DIED
    block.tell(SafeReport(Writer.GUARDIAN, LoopVerdict.ENDED, seen_ns=3))
    block.tell(SafeReport(Writer.SUPERVISOR, LoopVerdict.STALLED, Outcome.SEEN, seen_ns=2))
    assert block.loop_fault is Fault.LONG_STALL
    block.tell(SafeReport(Writer.CONTROL, LoopVerdict.SILENT, seen_ns=1))
    assert block.loop_fault is Fault.LOOP_DIED
