"""How a daemon ends: the rig first, then what is told of it."""

import asyncio
import logging
import os
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from support.rigs.served_daemon import listening

from rig.app import compose
from rig.app.supervise import parts_of
from rig.realtime.faults import Fault
from rig.realtime.ring import Ring
from rig.service.connections import protocol
from rig.service.daemon import Daemon
from rig.service.queue.job_queue import Queue
from rig.service.queue.planner import Planner
from rig.service.queue.queue_runner import QueueRunner
from rig.service.records.durable_file import DurableFile
from rig.service.records.operating_time import OperatingTime
from rig.service.session.session_monitor import SessionMonitor
from rig.service.settings import DaemonSettings, Web
from rig.service.views import metrics
from rig.service.web.host import Page

ENDED_S = 0.3
"""For so long whatever a thread does waits for a daemon that ends before it."""


def test_a_black_box_that_cannot_be_written_is_in_the_last_line_and_delays_no_safe_state(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", logger="pamrig")
    (tmp_path / "blackbox").write_text("no room for a folder")
    ring = Ring.create(f"test-{os.getpid()}-ends", 42, capacity=64)
    lost_before_safe: list[bool] = []

    def opened(monitor: SessionMonitor) -> None:
        monitor.session = SimpleNamespace(ring=ring, id=42, facts={}, dismiss_loop=list)  # type: ignore[assignment]

    def closed(monitor: SessionMonitor, _: Callable[[str], None]) -> str:
        monitor.session = None
        lost_before_safe.append("is lost" in caplog.text)
        return "the rig is safe"

    monkeypatch.setattr(SessionMonitor, "open", opened)
    monkeypatch.setattr(SessionMonitor, "close", closed)
    monkeypatch.setattr(SessionMonitor, "check", lambda _: None)
    monkeypatch.setattr(SessionMonitor, "fault", property(lambda _: Fault.NOT_FOLLOWING))
    monkeypatch.setattr(SessionMonitor, "message", property(lambda _: "valve 1"))
    monkeypatch.setattr(Planner, "warm", lambda _: asyncio.sleep(0))
    settings = DaemonSettings(logs=tmp_path / "logs", state=tmp_path, socket=tmp_path / "s.sock", web=Web(on=False))

    async def serve() -> None:
        daemon = Daemon(parts_of(compose.load(None), virtual=True), settings)
        serving = asyncio.ensure_future(daemon.serve())
        while "tried again" not in caplog.text:
            await asyncio.sleep(0.001)
        daemon.end()
        await serving

    try:
        asyncio.run(serve())
    finally:
        ring.block.unlink()
    assert lost_before_safe == [False]
    assert caplog.messages[-1] == (
        f"ended; the rig is safe; the black box of NOT_FOLLOWING is lost: {tmp_path / 'blackbox'}: cannot be made: "
        "File exists"
    )


def test_what_a_full_disk_did_not_take_of_the_queue_is_kept_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A sweep that was done, or stopped, was none for the next daemon, though the disk had room again."""
    caplog.set_level("INFO", logger="pamrig")
    monkeypatch.setattr(SessionMonitor, "open", lambda _: None)
    monkeypatch.setattr(Planner, "warm", lambda _: asyncio.sleep(0))
    kept = tmp_path / "queue.json"
    Queue(DurableFile(kept)).add(Path("/sweep.yaml"), "long", 2, 1.0, 0.0)
    queues, make = list[Queue](), Queue.__init__

    def made(queue: Queue, *given: Any) -> None:
        make(queue, *given)
        queues.append(queue)

    monkeypatch.setattr(Queue, "__init__", made)
    settings = DaemonSettings(logs=tmp_path / "logs", state=tmp_path, socket=tmp_path / "s.sock", web=Web(on=False))

    async def serve() -> None:
        daemon, serving = await listening(settings, caplog)
        (job,) = queues[-1].jobs
        job.done = 1  # and the disk was full
        daemon.end()
        await serving

    asyncio.run(serve())
    assert [job.done for job in Queue(DurableFile(kept)).jobs] == [1]


@pytest.mark.parametrize("begun", [(OperatingTime, "save"), (metrics, "write")], ids=["operating time", "metrics"])
def test_what_a_thread_had_begun_is_done_before_the_last_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, begun: tuple[object, str]
) -> None:
    """A task that was cancelled left its thread behind: two wrote the same file, and one wrote and logged after the
    daemon had said that it ended."""
    caplog.set_level("INFO", logger="pamrig")
    under_way, ended, told = threading.Event(), threading.Event(), logging.getLogger("pamrig")
    at_once: list[int] = []

    def slowly(*_: object) -> None:
        at_once.append(1)
        under_way.set()
        ended.wait(ENDED_S)
        told.info("%d at once", len(at_once))
        at_once.pop()

    def closed(*_: object) -> str:
        return "the rig is safe"

    monkeypatch.setattr(*begun, slowly)
    monkeypatch.setattr(SessionMonitor, "open", lambda _: None)
    monkeypatch.setattr(SessionMonitor, "close", closed)
    monkeypatch.setattr(Planner, "warm", lambda _: asyncio.sleep(0))
    settings = DaemonSettings(
        logs=tmp_path / "logs", state=tmp_path, socket=tmp_path / "s.sock", web=Web(on=False), metrics=tmp_path / "m"
    )

    async def serve() -> None:
        daemon = Daemon(parts_of(compose.load(None), virtual=True), settings)
        serving = asyncio.ensure_future(daemon.serve())
        while not under_way.is_set():
            await asyncio.sleep(0.001)
        daemon.end()
        await serving
        ended.set()

    asyncio.run(serve())
    assert caplog.messages[-1] == "ended; the rig is safe"
    assert {message for message in caplog.messages if "at once" in message} == {"1 at once"}


def test_the_rig_is_on_its_way_to_safe_before_anybody_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Marks of eight clients, which a recorder did not take whose disk stood still, were all the threads that the end
    had: the rig went on for a second, and the daemon for as long as the disk stood."""
    caplog.set_level("INFO", logger="pamrig")
    free, waits, order = threading.Event(), threading.Event(), list[str]()

    def stuck(_: object) -> None:
        waits.set()
        assert free.wait(30.0)

    def opened(monitor: SessionMonitor) -> None:
        ring = SimpleNamespace(heartbeat_ns=0)
        monitor.session = SimpleNamespace(  # type: ignore[assignment]
            id=42,
            ring=ring,
            facts={},
            recording=SimpleNamespace(expect=stuck),
            dismiss_loop=lambda: order.append("loop"),
        )

    def closed(monitor: SessionMonitor, _: Callable[[str], None]) -> str:
        monitor.session = None
        order.append("session")
        free.set()  # the recorder is ended, and with it what waits for him
        return ""

    monkeypatch.setattr(SessionMonitor, "open", opened)
    monkeypatch.setattr(SessionMonitor, "close", closed)
    monkeypatch.setattr(SessionMonitor, "check", lambda _: None)
    monkeypatch.setattr(QueueRunner, "current", property(lambda _: tmp_path / "a.mcap", lambda *_: None), raising=False)
    monkeypatch.setattr(Planner, "warm", lambda _: asyncio.sleep(0))
    monkeypatch.setattr(Planner, "close", lambda _: order.append("planner"))
    settings = DaemonSettings(logs=tmp_path / "logs", state=tmp_path, socket=tmp_path / "s.sock", web=Web(on=False))

    async def marked() -> asyncio.StreamWriter:
        _, writer = await asyncio.open_unix_connection(settings.socket)
        writer.write(protocol.encode({"command": "mark", "text": "here"}))
        return writer

    async def serve() -> None:
        daemon, serving = await listening(settings, caplog)
        clients = [await marked() for _ in range(8)]
        while not waits.is_set() or caplog.text.count("command mark") < 8:
            await asyncio.sleep(0.001)
        daemon.end()
        await serving
        for client in clients:
            client.close()
            await client.wait_closed()

    asyncio.run(asyncio.wait_for(serve(), 20.0))
    assert order == ["loop", "planner", "planner", "session"]


def test_what_cannot_be_closed_beside_the_rig_is_no_reason_to_leave_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A planner that could not be ended was the end of the end: nobody looked whether the rig was safe, and the
    daemon's process stayed, for its recorder was never told to end."""
    caplog.set_level("INFO", logger="pamrig")

    def opened(monitor: SessionMonitor) -> None:
        monitor.session = SimpleNamespace(id=42, ring=SimpleNamespace(heartbeat_ns=0), facts={}, dismiss_loop=list)  # type: ignore[assignment]

    def closed(monitor: SessionMonitor, _: Callable[[str], None]) -> str:
        monitor.session = None
        return "the rig is safe"

    def refuses(_: object) -> None:
        raise AttributeError("kill")

    monkeypatch.setattr(SessionMonitor, "open", opened)
    monkeypatch.setattr(SessionMonitor, "close", closed)
    monkeypatch.setattr(SessionMonitor, "check", lambda _: None)
    monkeypatch.setattr(Planner, "warm", lambda _: asyncio.sleep(0))
    for one in (Planner, Page):
        monkeypatch.setattr(one, "close", refuses)
    settings = DaemonSettings(logs=tmp_path / "logs", state=tmp_path, socket=tmp_path / "s.sock", web=Web(on=False))

    async def serve() -> None:
        daemon, serving = await listening(settings, caplog)
        daemon.end()
        await serving

    asyncio.run(asyncio.wait_for(serve(), 20.0))
    assert caplog.messages.count("at the end: AttributeError('kill')") == 3
    assert caplog.messages[-1] == "ended; the rig is safe"


def test_a_task_that_was_cancelled_is_no_silent_end_of_a_part_of_the_daemon(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The runner of the queue was, by a stop: nobody worked any more, and no reset came to an end."""
    settings = DaemonSettings(logs=tmp_path / "logs", state=tmp_path, socket=tmp_path / "s.sock", web=Web(on=False))

    async def cancelled(*, ending: bool) -> bool:
        daemon = Daemon(parts_of(compose.load(None), virtual=True), settings)
        if ending:
            daemon._over.set()  # noqa: SLF001  # as its end does
        caplog.clear()
        task = asyncio.ensure_future(asyncio.sleep(60.0))
        task.add_done_callback(daemon._task_ended)  # noqa: SLF001  # as its own work has
        task.cancel()
        await asyncio.wait({task})
        await asyncio.sleep(0)
        daemon._state.close()  # noqa: SLF001  # as `serve` does
        return daemon._over.is_set()  # noqa: SLF001

    assert asyncio.run(cancelled(ending=False))
    assert "error in the daemon itself" in caplog.text
    asyncio.run(cancelled(ending=True))
    assert "error in the daemon itself" not in caplog.text


def test_a_marker_of_a_record_that_ends_meanwhile_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It went into that record, and was answered by an error of the daemon's own."""
    settings = DaemonSettings(logs=tmp_path / "logs", state=tmp_path, socket=tmp_path / "s.sock", web=Web(on=False))

    async def marked() -> dict[str, str]:
        daemon = Daemon(parts_of(compose.load(None), virtual=True), settings)
        daemon._monitor.session = SimpleNamespace()  # type: ignore[assignment]  # noqa: SLF001
        daemon._runner.current = tmp_path / "sine.mcap"  # noqa: SLF001

        async def written(*_: object) -> None:
            daemon._runner.current = None  # noqa: SLF001

        monkeypatch.setattr(daemon._marks, "write", written)  # noqa: SLF001
        try:
            return await daemon._mark({"text": "x"})  # noqa: SLF001
        finally:
            daemon._state.close()  # noqa: SLF001

    assert asyncio.run(marked()) == {"record": "sine.mcap", "text": "x"}
