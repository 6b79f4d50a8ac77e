"""A start that is still being looked at does not outlive a stop."""

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rig.app import compose, shipped
from rig.realtime.state import State
from rig.service.aside import DiskWork
from rig.service.connections.protocol import Code, Refused
from rig.service.queue.expander import Summary
from rig.service.queue.job_queue import Queue
from rig.service.queue.queue_runner import QueueRunner
from rig.service.queue.start_handler import StartHandler
from rig.service.records.durable_file import DurableFile
from rig.service.records.ledger import Ledger
from rig.service.settings import DaemonSettings

QUICK = shipped.configs() / "sweeps" / "quick.yaml"


class SlowChecker:
    """Looks at a sweep until it is told to be done with it."""

    def __init__(self) -> None:
        self.began, self.may_end = asyncio.Event(), asyncio.Event()

    async def check(self, _: Path) -> Summary:
        self.began.set()
        await self.may_end.wait()
        return Summary(1, 10.0, b"")


def made(folder: Path) -> tuple[StartHandler, QueueRunner, Queue, SlowChecker]:
    (folder / "logs").mkdir()
    queue, checker = Queue(DurableFile(folder / "queue.json")), SlowChecker()
    monitor: Any = SimpleNamespace(
        fault=None, session=None, telemetry=None, state=State.ARMED, require=lambda event: None
    )
    settings = DaemonSettings(logs=folder / "logs", state=folder, spare_gb=0.0)
    runner = QueueRunner(monitor, queue, compose.load(None), settings, Ledger(DurableFile(settings.ledger)), DiskWork())
    either: Any = checker
    return StartHandler(monitor, queue, runner, either), runner, queue, checker


@pytest.mark.parametrize("stopped", [True, False])
def test_a_stop_while_a_start_is_being_looked_at_holds(tmp_path: Path, stopped: bool) -> None:
    async def look() -> None:
        starting, runner, queue, checker = made(tmp_path)
        asked = asyncio.create_task(starting.start([str(QUICK)], 0.0, ""))
        await checker.began.wait()
        if stopped:
            runner.hold()
        checker.may_end.set()
        if stopped:
            with pytest.raises(Refused, match="while this start was being looked at: nothing was queued") as why:
                await asked
            assert why.value.code is Code.WRONG_STATE
        else:
            assert len(await asked) == 1
        assert (len(queue.jobs), runner.working) == ((0, False) if stopped else (1, True))

    asyncio.run(asyncio.wait_for(look(), 30.0))


def test_a_start_after_the_stop_goes_on(tmp_path: Path) -> None:
    async def look() -> None:
        starting, runner, _, checker = made(tmp_path)
        checker.may_end.set()
        runner.hold()
        await starting.start([str(QUICK)], 0.0, "")
        assert runner.working

    asyncio.run(asyncio.wait_for(look(), 30.0))
