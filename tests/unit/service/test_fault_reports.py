"""A black box that the disk does not take: what the ring held at the fault is kept, and written when there is room."""

import asyncio
import os
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from support.records.mcap_files import contents

from rig.realtime.faults import Fault
from rig.realtime.ring import Ring, RingWriter
from rig.realtime.state import State
from rig.sample import Sample
from rig.service.views import fault_reports
from rig.service.views.fault_reports import FaultReports


@pytest.fixture
def ring() -> Iterator[Ring]:
    made = Ring.create(f"test-{os.getpid()}-reports", 42, capacity=64)
    yield made
    made.block.unlink()


def fill(ring: Ring, first: int, count: int) -> None:
    writer = RingWriter(ring, os.getpid())
    for tick in range(first, first + count):
        writer.put(Sample(**dict.fromkeys(Sample._fields, 0) | {"tick": tick, "scheduled_ns": tick * 5_000_000}))


def monitor_of(ring: Ring) -> Any:
    return SimpleNamespace(
        fault=Fault.NOT_FOLLOWING, message="valve 1", session=SimpleNamespace(ring=ring), state=State.FAULT,
        safe=SimpleNamespace(outcome=None, words="", safe=True),
    )  # fmt: skip


def test_a_black_box_is_written_when_the_disk_has_room_again(
    ring: Ring, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """It was lost: the ring goes on behind a fault, and nobody tried again."""
    (tmp_path / "boxes").write_text("no room for a folder")
    monkeypatch.setattr(fault_reports, "AGAIN_S", 0.0)
    fill(ring, 0, 20)

    async def told() -> list[Path]:
        reports = FaultReports(monitor_of(ring), tmp_path / "boxes", lambda: None)
        reports.tell_fault()
        while "tried again" not in caplog.text:
            await asyncio.sleep(0)
        fill(ring, 20, 200)  # the ring has gone round since
        (tmp_path / "boxes").unlink()
        await asyncio.gather(*reports.tasks)
        return reports.black_boxes

    (box,) = asyncio.run(told())
    assert [sample.tick for sample in contents(box).samples] == list(range(20))
    assert caplog.text.count("tried again") == 1
    assert [file.suffix for file in (tmp_path / "boxes").iterdir()] == [".mcap"]


def test_so_many_black_boxes_wait_and_no_more(
    ring: Ring, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "boxes").write_text("no room for a folder")
    monkeypatch.setattr(fault_reports, "MOST_WAITING", 1)

    async def told() -> None:
        reports = FaultReports(monitor := monitor_of(ring), tmp_path / "boxes", lambda: None)
        for fault in (Fault.NOT_FOLLOWING, Fault.ESTOP):
            monitor.fault = fault
            reports.tell_fault()
        while "is lost" not in caplog.text:
            await asyncio.sleep(0)
        assert sum(not task.done() for task in reports.tasks) >= 1
        for task in reports.tasks:
            task.cancel()

    asyncio.run(told())
