"""A watcher who stands by while the one who commands tries to make a rig safe whose device is away."""

import os
import time
from collections.abc import Callable
from types import SimpleNamespace

import pytest
from support.shared_names import safe_block, unused_name

from rig.app import compose, watcher_process
from rig.app.watcher_process import GoesOnAlone, try_for_commander
from rig.errors import DeviceError
from rig.realtime.safe_report import Outcome, SafeBlock, Writer
from rig.realtime.safe_state import SecondPath

name = pytest.fixture(unused_name)
block = pytest.fixture(safe_block)


class Story:
    """What happens at each pause of the one who stands by, whose sleeps turn the clock; and the device."""

    def __init__(self, block: SafeBlock, monkeypatch: pytest.MonkeyPatch) -> None:
        self.block, self.now_s, self.asked, self.closed = block, time.monotonic(), 0, 0
        self.back, self.commanded, self.driver = False, True, ""
        self.pauses = 0
        self.each: Callable[[int], None] = lambda _: None
        parent = os.getppid()
        monkeypatch.setattr(os, "getppid", lambda: parent if self.commanded else 1)
        monkeypatch.setattr(watcher_process, "driver_of", lambda _: lambda: self.driver)
        self.alone = GoesOnAlone(compose.load(None), block, Writer.GUARDIAN)
        clock = SimpleNamespace(
            monotonic=lambda: self.now_s, monotonic_ns=lambda: round(self.now_s * 1e9), sleep=self.sleep
        )
        monkeypatch.setattr(watcher_process, "time", clock)

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds
        self.pauses += 1
        assert self.pauses < 10_000, "it comes to no end"
        if self.commanded:
            self.beat()
        self.each(self.pauses)

    def beat(self) -> None:
        with pytest.MonkeyPatch.context() as then:
            then.setattr("time.monotonic_ns", lambda: round(self.now_s * 1e9))
            self.block.beat(Writer.CONTROL)

    def safe(self) -> None:
        self.asked += 1
        if not self.back:
            raise DeviceError("no answer")

    def close(self) -> None:
        self.closed += 1

    def run(self) -> Outcome:
        self.beat()
        try_for_commander(self.block, Writer.GUARDIAN, self.alone, SecondPath(self.safe, lambda: True, self.close))
        return self.block.report(Writer.GUARDIAN).outcome


@pytest.fixture
def story(block: SafeBlock, monkeypatch: pytest.MonkeyPatch) -> Story:
    return Story(block, monkeypatch)


def test_beside_one_who_commands_it_touches_nothing_until_it_is_released(story: Story) -> None:
    story.each = lambda pause: story.block.release() if pause == 1000 else None
    assert story.run() is Outcome.UNKNOWN
    assert story.asked == 0


def test_it_tries_once_he_is_gone_until_the_device_has_taken_it(story: Story) -> None:
    def each(pause: int) -> None:
        story.commanded = pause < 100
        story.back = pause > 110

    story.each = each
    assert story.run() is Outcome.SEEN
    assert story.asked == pytest.approx(12, abs=2)
    assert story.closed == 1


def test_it_lets_go_when_he_is_back(story: Story) -> None:
    """One who was stopped and goes on opens the device anew, whose wires one alone can hold."""
    seen = []

    def each(pause: int) -> None:
        story.commanded = not 10 < pause < 20
        if pause in (15, 25):
            seen.append((story.block.report(Writer.GUARDIAN).outcome, story.closed))
        if pause == 30:
            story.block.release()

    story.each = each
    story.run()
    assert seen == [(Outcome.FAILED, 0), (Outcome.UNKNOWN, 1)]


@pytest.mark.parametrize(("drives_s", "asked"), [(1.0, True), (60.0, False)])
def test_his_own_loop_on_the_way_to_its_end_is_waited_for_and_somebody_else_is_not(
    drives_s: float, asked: bool, story: Story
) -> None:
    story.commanded, until_s = False, story.now_s + drives_s
    story.driver = "it is driven by process 12"

    def each(_: int) -> None:
        story.driver = story.driver if story.now_s < until_s else ""
        story.back = True

    story.each = each
    story.run()
    assert bool(story.asked) is asked


def test_it_does_not_try_for_ever(story: Story) -> None:
    story.commanded, began_s = False, story.now_s
    assert story.run() is Outcome.FAILED
    assert story.now_s - began_s < 400.0
