"""The process of the page: waits for the word, serves on the daemon's listening socket, beats, and ends when the daemon
is gone."""

import asyncio
import contextlib
import gc
import logging
import os
import signal
import socket
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rig.service.processes import name_process
from rig.service.web.page_setup import PAGE_BACKLOG, PageSetup

if TYPE_CHECKING:
    from uvicorn import Server

    from rig.service.web.site import Site

BEAT_S: Final = 0.2
"""From one sign of life to the daemon to the next, s; see `rig.service.web.host.PAGE_SILENCE_S`."""
_NICE: Final = 0
"""As any program: Stop goes through it. The loop stands above all of them, the daemon above this one."""
_OUT_OF_MEMORY: Final = "800"
"""Among the first to go, and not as safe from it as the daemon that starts it."""
_LOOK_S: Final = 0.5
_MOST_MESSAGE_BYTES: Final = 4096
"""Of what a page sends over its WebSocket, which is a few words."""
_KEEP_ALIVE_S: Final = 5
"""A connection without a request is closed then: each holds a place. A browser opens another one in milliseconds."""


def page_process(setup: PageSetup, listening: socket.socket, pipe: Connection, parent: int) -> None:
    """Entry of the process: load everything, wait until the daemon says that it is its turn, serve."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # they are for the process that commands; without it this one ends
    name_process("page")
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _NICE)  # not the daemon's, which it starts with
        Path("/proc/self/oom_score_adj").write_text(_OUT_OF_MEMORY, encoding="ascii")
    from rig.service.web.site import Site

    site = Site(setup)
    server = _server(site)
    gc.collect()
    gc.freeze()
    try:
        while not pipe.poll(_LOOK_S):
            if os.getppid() != parent:
                return
        pipe.recv_bytes()
    except (EOFError, OSError):
        return
    asyncio.run(_serve(server, site, listening, pipe, parent))


def _server(site: "Site") -> "Server":
    import uvicorn

    from rig.service.web.access.gate import gate

    config = uvicorn.Config(
        site.app,
        http=gate(site.admits),
        ws="websockets-sansio",
        ws_max_size=_MOST_MESSAGE_BYTES,
        ws_per_message_deflate=False,
        loop="asyncio",
        lifespan="off",
        log_config=None,
        log_level="error",  # whatever is no HTTP would be a line, as fast as somebody sends it
        access_log=False,
        server_header=False,
        proxy_headers=False,
        timeout_keep_alive=_KEEP_ALIVE_S,
        backlog=PAGE_BACKLOG,
    )
    logging.getLogger("uvicorn.error").addFilter(_is_ours)
    server = uvicorn.Server(config)
    server.capture_signals = contextlib.nullcontext  # type: ignore[assignment,method-assign]
    return server


def _is_ours(line: logging.LogRecord) -> bool:
    """Not what a viewer sent that is no text, for which uvicorn has a traceback."""
    return not line.getMessage().startswith("Invalid UTF-8 sequence")


async def _serve(server: Any, site: "Site", listening: socket.socket, pipe: Connection, parent: int) -> None:
    """Until the daemon is gone; then at once, so that the address is free for the next."""
    tasks = [asyncio.create_task(_beat(pipe, parent)), asyncio.create_task(server.serve([listening]))]
    async with site.following():
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    os._exit(0)


async def _beat(pipe: Connection, parent: int) -> None:
    """Say that the event loop turns; returns when nobody listens any more."""
    with contextlib.suppress(OSError):
        while os.getppid() == parent:
            pipe.send_bytes(b".")
            await asyncio.sleep(BEAT_S)
