"""A daemon in the test's own process, on an event loop whose pool has two threads."""

import asyncio
from concurrent.futures import ThreadPoolExecutor

import pytest

from rig.app import compose
from rig.app.supervise import parts_of
from rig.service.daemon import Daemon
from rig.service.settings import DaemonSettings


async def listening(
    settings: DaemonSettings, caplog: pytest.LogCaptureFixture
) -> "tuple[Daemon, asyncio.Future[None]]":
    """It and its service, once it can be asked; `caplog` hears what the daemon tells its log."""
    asyncio.get_running_loop().set_default_executor(ThreadPoolExecutor(2))
    daemon = Daemon(parts_of(compose.load(None), virtual=True), settings)
    serving = asyncio.ensure_future(daemon.serve())
    while "listening" not in caplog.text:
        await asyncio.sleep(0.001)
    return daemon, serving
