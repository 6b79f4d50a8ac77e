"""A black box that the disk does not take: what the ring held at the fault is kept, and written when there is room."""

import asyncio
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from support.records.mcap_files import contents

from rig.errors import RecordError
from rig.realtime.faults import Fault
from rig.realtime.ring import Ring, RingWriter
from rig.realtime.state import State
from rig.sample import Sample
from rig.service.records import blackbox
from rig.service.views import fault_reports
from rig.service.views.fault_reports import FaultReports


@pytest.fixture
def ring() -> Iterator[Ring]:
    made = Ring.create(f"test-{os.getpid()}-reports", 42, capacity=64)
    yield made
    made.block.unlink()


def fill(ring: Ring, first: int, count: int) -> None:
    writer = RingWriter(ring)
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
    monkeypatch.setattr(fault_reports, "REPORT_AGAIN_S", 0.0)
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


async def at_an_end(reports: FaultReports, waits: Callable[[], bool], patience_s: float = 9.0) -> tuple[str, list[str]]:
    """A daemon that ends while a black box waits: what it says of it is lost, and what it waited for."""
    reports.tell_fault()
    while not waits():
        await asyncio.sleep(0)
    said: list[str] = []
    return await reports.end(said.append, patience_s), said


def test_a_black_box_that_waits_is_written_before_the_daemon_goes(
    ring: Ring, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "boxes").write_text("no room for a folder")
    fill(ring, 0, 20)

    async def ended() -> tuple[str, list[str]]:
        reports = FaultReports(monitor_of(ring), tmp_path / "boxes", lambda: None)

        def waits() -> bool:
            if "tried again" not in caplog.text:
                return False
            (tmp_path / "boxes").unlink(missing_ok=True)
            return True

        return await at_an_end(reports, waits)

    assert asyncio.run(ended()) == ("", ["waiting for the disk: the black box of NOT_FOLLOWING"])
    (box,) = (tmp_path / "boxes").iterdir()
    assert len(contents(box).samples) == 20


def test_a_black_box_that_the_disk_never_took_is_said_to_be_lost(
    ring: Ring, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "boxes").write_text("no room for a folder")
    fill(ring, 0, 20)

    async def ended() -> tuple[str, list[str]]:
        reports = FaultReports(monitor_of(ring), tmp_path / "boxes", lambda: None)
        return await at_an_end(reports, lambda: "tried again" in caplog.text)

    lost, _ = asyncio.run(ended())
    assert lost == f"the black box of NOT_FOLLOWING is lost: {tmp_path / 'boxes'}: cannot be made: File exists"
    assert lost in caplog.messages


def test_a_disk_that_stands_still_keeps_no_daemon(
    ring: Ring, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    begun, over = threading.Event(), threading.Event()

    def stands(*_: object) -> Path:
        begun.set()
        over.wait()
        raise RecordError("the disk goes on, and nobody hears of it")

    monkeypatch.setattr(blackbox.Box, "write", stands)
    fill(ring, 0, 20)

    async def ended() -> tuple[str, list[str]]:
        return await at_an_end(FaultReports(monitor_of(ring), tmp_path, lambda: None), begun.is_set, 0.0)

    try:
        lost, _ = asyncio.run(ended())
    finally:
        over.set()
    assert lost == "the black box of NOT_FOLLOWING is lost: the disk did not take it within 0 s"


def test_nothing_is_waited_for_where_no_black_box_waits(ring: Ring, tmp_path: Path) -> None:
    fill(ring, 0, 20)

    async def ended() -> tuple[str, list[str]]:
        reports = FaultReports(monitor_of(ring), tmp_path / "boxes", lambda: None)
        return await at_an_end(reports, lambda: bool(reports.black_boxes))

    assert asyncio.run(ended()) == ("", [])
