"""How a daemon ends: the rig first, then what is told of it."""

import asyncio
import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from rig.app import compose
from rig.app.supervise import parts_of
from rig.realtime.faults import Fault
from rig.realtime.ring import Ring
from rig.service.daemon import Daemon
from rig.service.queue.planner import Planner
from rig.service.session.session_monitor import SessionMonitor
from rig.service.settings import DaemonSettings, Web


def test_a_black_box_that_cannot_be_written_is_in_the_last_line_and_delays_no_safe_state(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", logger="pamrig")
    (tmp_path / "blackbox").write_text("no room for a folder")
    ring = Ring.create(f"test-{os.getpid()}-ends", 42, capacity=64)
    lost_before_safe: list[bool] = []

    def opened(monitor: SessionMonitor) -> None:
        monitor.session = SimpleNamespace(ring=ring, id=42, facts={})  # type: ignore[assignment]

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
