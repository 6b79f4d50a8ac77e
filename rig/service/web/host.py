"""The operator's page seen from the daemon: its socket, its process and a spare one, and how a lost one is replaced.

The daemon holds the listening socket, so that what was asked of a page that froze is answered by the next. Nothing of
the page runs in this process: it hears beats from it, and that is all. Standard library only.
"""

import asyncio
import contextlib
import importlib.util
import logging
import multiprocessing
import os
import secrets
import socket
import time
from dataclasses import dataclass, field, replace
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Final

from rig.errors import RigError, StateError
from rig.service.aside import aside
from rig.service.processes import RestartDelays, is_stopped, start_process
from rig.service.session.session_parts import SessionParts
from rig.service.settings import DaemonSettings, Web, read_token
from rig.service.web.page_setup import PAGE_BACKLOG, PageSetup
from rig.service.web.serve import page_process

DEFAULT_PORT: Final = 8420
"""Tried first where none is asked for; where it is taken, the kernel chooses one."""
PAGE_LOOK_S: Final = 0.1
"""From one look at the page's process to the next, s."""
PAGE_SILENCE_S: Final = 3.0
"""A page that has not beaten for so long hangs; one that the kernel calls stopped is replaced at the next look."""
COMING_S: Final = 60.0
"""Until its first beat: it imports its packages before, for which it may have to wait for a processor."""
_PACKAGES: Final = ("jinja2", "starlette", "uvicorn", "websockets")
PAGE_AGAIN_S: Final = (0.0, 0.5, 2.0, 10.0)
"""Before a page that died is replaced for the first, second ... time in a row."""
_LOG = logging.getLogger("pamrig")


@dataclass
class _Running:
    """One process of the page, serving or waiting."""

    process: BaseProcess
    pipe: Connection
    heard_s: float = field(default_factory=time.monotonic)
    serves: bool = False
    patience_s: float = COMING_S


def missing_packages() -> list[str]:
    """What of the extra is not installed."""
    return [name for name in _PACKAGES if importlib.util.find_spec(name) is None]


def bind(web: Web) -> socket.socket:
    """Listening where the settings say; StateError when that cannot be. A port that nobody asked for gives way."""
    for port in (web.port,) if web.port else (DEFAULT_PORT, 0):
        try:
            found = socket.getaddrinfo(web.host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
            return socket.create_server(found[0][4][:2], family=found[0][0], backlog=PAGE_BACKLOG)
        except OSError as error:
            problem = error
    raise StateError(f"{web.host}:{port}: the page cannot listen there: {problem.strerror}")


def signing_key(folder: Path) -> bytes:
    """The key in the state folder, made where there is none: logins outlive a restart."""
    path = folder / "page.key"
    with contextlib.suppress(OSError):
        if len(key := path.read_bytes()) == 32:
            return key
    key = secrets.token_bytes(32)
    fresh = path.with_suffix(".new")
    with contextlib.suppress(OSError):
        fresh.unlink(missing_ok=True)
        with open(os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600), "wb") as file:
            file.write(key)
        fresh.replace(path)
    return key


def page_setup(parts: SessionParts, settings: DaemonSettings) -> PageSetup:
    """What the page's process is told."""
    return PageSetup(
        socket=settings.socket,
        rig=parts.rig,
        simulated=parts.simulated,
        logs=settings.logs,
        state=settings.state,
        local=settings.web.local,
        group=settings.group,
        sweeps=(*settings.web.sweeps, *parts.sweeps),
        models=parts.models,
        simulator=settings.web.model or parts.simulator,
        names=tuple(settings.web.names),
    )


class Page:
    """Keeps one process that serves and one that waits to take its place. Off: does nothing."""

    def __init__(self, web: Web, setup: PageSetup) -> None:
        self._web, self._setup = web, setup
        self._context = multiprocessing.get_context("spawn")
        self._listening: socket.socket | None = None
        self._serving: _Running | None = None
        self._spare: _Running | None = None
        self._pauses = RestartDelays(PAGE_AGAIN_S)
        self.restarts = 0

    def open(self) -> None:
        """Listen and start the processes; StateError when the address is taken, RigError without a token.
        Without the extra there is no page, which is said."""
        if not self._web.on:
            return
        if missing := missing_packages():
            _LOG.warning("no page: it needs the extra `web` (%s): pip install 'pamrig[web]'", ", ".join(missing))
            return
        changes: dict[str, Any] = {"key": signing_key(self._setup.state), "epoch_s": time.time() - time.monotonic()}
        if self._web.token_file is not None and not self._web.local:
            changes["token"] = read_token(self._web.token_file)
        self._setup = replace(self._setup, **changes)
        self._listening = bind(self._web)
        self._serving, self._spare = self._start(), self._start()
        self._let_serve(self._serving)
        _LOG.info("page: %s", self.url)

    @property
    def url(self) -> str:
        """Where a browser finds it; empty when it is off."""
        if self._listening is None:
            return ""
        host, port = self._listening.getsockname()[:2]
        host = {"0.0.0.0": socket.gethostname(), "::": socket.gethostname()}.get(host, host)
        return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"

    def to_json(self) -> dict[str, Any] | None:
        """The page as the status shows it; None when it is off."""
        if self._listening is None:
            return None
        pid = self._serving.process.pid if self._serving is not None else None
        return {"url": self.url, "pid": pid, "restarts": self.restarts}

    async def watch(self) -> None:
        """Look after it until cancelled; what goes wrong with it is told and never ends the daemon."""
        while self._listening is not None:
            try:
                await self._look()
            except (OSError, RuntimeError, RigError) as error:
                _LOG.error("page: %s", error)
                await asyncio.sleep(PAGE_AGAIN_S[-1])
            await asyncio.sleep(PAGE_LOOK_S)

    def close(self) -> None:
        """End both processes and give the address back."""
        for running in (self._serving, self._spare):
            self._end(running)
        self._serving = self._spare = None
        if self._listening is not None:
            self._listening.close()
            self._listening = None

    async def _look(self) -> None:
        if self._spare is None or self._lost(self._spare):
            await aside(partial(self._end, self._spare))
            self._spare = await aside(self._start)
        problem = self._lost(self._serving)
        if not problem:
            return
        await aside(partial(self._end, self._serving))
        self.restarts += 1
        pause_s = self._pauses.next_s()
        _LOG.error("page: %s; started again", problem)
        self._serving = None
        await asyncio.sleep(pause_s)
        self._serving, self._spare = self._spare, None
        self._let_serve(self._serving)

    def _lost(self, running: _Running | None) -> str:
        """Why this process is of no use any more; empty while it is."""
        if running is None or not running.process.is_alive():
            return "its process has ended"
        with contextlib.suppress(EOFError, OSError):
            while running.pipe.poll():
                running.pipe.recv_bytes()
                running.heard_s, running.patience_s = time.monotonic(), PAGE_SILENCE_S
        if is_stopped(running.process.pid):
            return "its process was stopped"
        if running.serves and time.monotonic() - running.heard_s > running.patience_s:
            return f"its process has hung for {running.patience_s:g} s"
        return ""

    def _start(self) -> _Running:
        ours, theirs = self._context.Pipe()
        process = self._context.Process(
            target=page_process,
            args=(self._setup, self._listening, theirs, os.getpid()),
            name="pamrig-page",
            daemon=False,  # it has a process of its own for what takes long, and ends when this one is gone
        )
        start_process(process)
        theirs.close()
        return _Running(process, ours)

    def _let_serve(self, running: _Running | None) -> None:
        self._pauses.began()
        if running is not None:
            running.serves, running.heard_s = True, time.monotonic()
            with contextlib.suppress(OSError):
                running.pipe.send_bytes(b"serve")

    def _end(self, running: _Running | None) -> None:
        """At once: it has nothing to finish. Blocks until the kernel has done so, for which it may have to wait for a
        processor: not to be called where an emergency stop is answered."""
        if running is not None:
            running.process.kill()
            running.process.join()
            running.pipe.close()
