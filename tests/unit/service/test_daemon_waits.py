"""What the daemon's event loop never waits for: the processes that show the rig live, which may be slow to end. An
emergency stop is answered there."""

import asyncio
import contextlib
import json
import socket
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from support.rigs.served_daemon import listening

from rig.app import compose
from rig.app.supervise import parts_of
from rig.service import aside
from rig.service.connections import protocol
from rig.service.daemon import Daemon
from rig.service.queue.job_queue import Queue
from rig.service.queue.planner import Planner
from rig.service.session.session_monitor import SessionMonitor
from rig.service.settings import DaemonSettings, Web
from rig.service.views.live import LiveView

PATIENCE_S = 10.0


async def until(event: threading.Event) -> None:
    """Only an event loop that goes on comes to an end here."""
    while not event.is_set():
        await asyncio.sleep(0.001)


async def answer(socket: Path) -> dict[str, object]:
    """To a question for the status."""
    reader, writer = await asyncio.open_unix_connection(socket)
    writer.write(protocol.encode({"id": 1, "command": "status"}))
    said = json.loads(await reader.readline())
    writer.close()
    await writer.wait_closed()
    return dict(said)


def test_while_a_live_view_ends_others_are_answered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    slow = {name: (threading.Event(), threading.Event()) for name in ("follow", "close")}

    def slowly(name: str) -> None:
        begun, over = slow[name]
        begun.set()
        assert over.wait(PATIENCE_S), "the event loop waited"

    monkeypatch.setattr(LiveView, "follow", lambda *_: slowly("follow"))
    monkeypatch.setattr(LiveView, "close", lambda _: slowly("close"))
    monkeypatch.setattr(SessionMonitor, "open", lambda _: None)
    monkeypatch.setattr(Planner, "warm", lambda _: asyncio.sleep(0))
    settings = DaemonSettings(logs=tmp_path / "logs", state=tmp_path, socket=tmp_path / "s.sock", web=Web(on=False))

    async def serve() -> dict[str, object]:
        daemon = Daemon(parts_of(compose.load(None), virtual=True), settings)
        serving = asyncio.ensure_future(daemon.serve())
        await until(slow["follow"][0])
        said = await answer(settings.socket)
        slow["follow"][1].set()
        await asyncio.sleep(0.05)
        daemon.end()
        await until(slow["close"][0])
        slow["close"][1].set()
        await serving
        return said

    said = asyncio.run(asyncio.wait_for(serve(), 3 * PATIENCE_S))
    assert said["ok"]


def test_a_disk_that_stands_still_under_the_queue_keeps_no_other_work_and_no_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Clients who cleared the queue took all threads of the event loop, of which the ledger's entries, a page that was
    to be started anew and the end of the daemon had theirs."""
    caplog.set_level("INFO", logger="pamrig")
    begun, over, forgotten = threading.Semaphore(0), threading.Event(), threading.Event()

    def slowly(_: Queue) -> list[int]:
        begun.release()
        over.wait(PATIENCE_S)
        return []

    monkeypatch.setattr(Queue, "clear", slowly)
    monkeypatch.setattr(aside, "END_S", 0.05)
    monkeypatch.setattr(SessionMonitor, "open", lambda _: None)
    monkeypatch.setattr(SessionMonitor, "close", lambda *_: "the rig is safe")
    monkeypatch.setattr(Planner, "warm", lambda _: asyncio.sleep(0))
    monkeypatch.setattr(LiveView, "close", lambda _: forgotten.set())
    settings = DaemonSettings(logs=tmp_path / "logs", state=tmp_path, socket=tmp_path / "s.sock", web=Web(on=False))

    async def serve() -> None:
        daemon, serving = await listening(settings, caplog)
        clients = [await asyncio.open_unix_connection(settings.socket) for _ in range(3)]
        for _, writer in clients:
            writer.write(protocol.encode({"command": "clear"}))
        for _ in range(2):
            while not begun.acquire(blocking=False):
                await asyncio.sleep(0.001)
        daemon.end()
        await until(forgotten)
        await serving
        over.set()
        for _, writer in clients:
            writer.close()
            await writer.wait_closed()

    asyncio.run(asyncio.wait_for(serve(), PATIENCE_S / 2))
    assert caplog.messages[-1] == (
        "ended; the rig is safe; a disk did not take within 0.05 s what was begun on it: look at the queue and the "
        "ledger"
    )


def test_systemd_is_asked_for_the_time_that_a_recorder_needs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Or it would kill after TimeoutStopSec what the daemon waits for."""

    def waits(_: SessionMonitor, say: Callable[[str], None]) -> str:
        say("waiting for the recorder")
        return ""

    monkeypatch.setattr(SessionMonitor, "open", lambda _: None)
    monkeypatch.setattr(SessionMonitor, "close", waits)
    monkeypatch.setattr(Planner, "warm", lambda _: asyncio.sleep(0))
    settings = DaemonSettings(logs=tmp_path / "logs", state=tmp_path, socket=tmp_path / "s.sock", web=Web(on=False))

    async def serve() -> None:
        daemon = Daemon(parts_of(compose.load(None), virtual=True), settings)
        daemon.end()
        await daemon.serve()

    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        asyncio.run(asyncio.wait_for(serve(), 3 * PATIENCE_S))
        words = []
        with contextlib.suppress(BlockingIOError):
            while True:
                words.append(systemd.recv(200).decode())
    assert "EXTEND_TIMEOUT_USEC=20000000\nSTATUS=waiting for the recorder" in words, "a slow disk may be told after it"
    assert words[-2] == "STOPPING=1"
