"""A watcher whose commanding process is gone, and whose device is away."""

import os
import time

import pytest
from support.shared_names import safe_block, unused_name

from rig.app import compose, watcher_process
from rig.app.trying_on import ALONE_S
from rig.app.watcher_process import GoesOnAlone
from rig.realtime.safe_report import SafeBlock, Writer

name = pytest.fixture(unused_name)
block = pytest.fixture(safe_block)


def test_while_somebody_commands_it_is_he_who_tries_on(block: SafeBlock) -> None:
    block.beat(Writer.CONTROL)
    assert not GoesOnAlone(compose.load(None), block, Writer.SUPERVISOR)()


def test_one_that_is_stopped_tries_nothing(block: SafeBlock, monkeypatch: pytest.MonkeyPatch) -> None:
    """He is there, so that both watchers gave up after ten seconds; what the device held when it was back stayed until
    somebody let him go on."""
    alone = GoesOnAlone(compose.load(None), block, Writer.SUPERVISOR)
    block.beat(Writer.CONTROL)
    stopped_ns = time.monotonic_ns() + 3_000_000_000
    monkeypatch.setattr("time.monotonic_ns", lambda: stopped_ns)
    assert alone()
    block.beat(Writer.CONTROL)  # he goes on
    assert not alone()


@pytest.mark.parametrize(("writer", "speaks"), [(Writer.SUPERVISOR, True), (Writer.GUARDIAN, False)])
def test_without_him_a_watcher_does_for_as_long_as_a_command_would(
    block: SafeBlock, writer: Writer, speaks: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    alone = GoesOnAlone(compose.load(None), block, writer)
    monkeypatch.setattr(os, "getppid", lambda: 1)
    block.beat(Writer.SUPERVISOR)
    assert alone()
    assert alone()
    said = capsys.readouterr().err
    assert said.count("the process that held the rig is gone, or does not move; NOT SAFE as far as is known") == speaks
    began_s = alone.since_s
    monkeypatch.setattr("time.monotonic", lambda: began_s + ALONE_S + 1.0)
    assert not alone()


def test_a_rig_that_somebody_else_drives_by_now_is_left_to_him(
    block: SafeBlock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watcher_process, "driver_of", lambda _: lambda: "it is driven by process 12")
    alone = GoesOnAlone(compose.load(None), block, Writer.SUPERVISOR)
    monkeypatch.setattr(os, "getppid", lambda: 1)
    assert not alone()
