"""A process for what may be large, slow or a trap, kept away from the process that answers to an emergency stop: niced,
bounded in memory, killed when it takes too long.

It answers one request at a time: who asks sees to the turns. After it has ended, the next request gets a fresh one.
"""

import asyncio
import contextlib
import multiprocessing
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Final, TypeVar

from rig.errors import RigError
from rig.service.aside import aside
from rig.service.processes import is_stopped, start_process
from rig.service.requests import RequestRefused

T = TypeVar("T")
_START_S: Final = 120.0
"""For a process to come so far that it listens, on a machine that does other work too."""
_LOOK_S: Final = 0.2
"""From one look at a process that takes its time to the next."""


class _StoppedBySignal(EOFError):
    """It does not come back by itself: who waited had its whole patience to wait, and was told of a request that is too
    large."""


class HelperProcess:
    """One such process, started when it is first needed."""

    def __init__(self, entry: Callable[..., None], arguments: tuple[Any, ...], name: str) -> None:
        """`entry`, a function of a module, gets its end of a pipe and these arguments there; it is to call
        `serve_requests`."""
        self._entry, self._arguments, self._name = entry, arguments, name
        self._context = multiprocessing.get_context("spawn")
        self._starting = threading.Lock()
        self._closed = False
        self._pipe: Connection | None = None
        self.process: BaseProcess | None = None
        self._up: BaseProcess | None = None

    def ask(self, request: tuple[Any, ...], patience_s: float) -> Any:
        """What the process answers; blocks, so call it from a thread. RigError and MemoryError as they are raised
        there, or where no process can be had, TimeoutError when it takes longer, EOFError when it has ended (or `close`
        was called). One that somebody has stopped is replaced, once."""
        try:
            return self._ask_one(request, patience_s)
        except _StoppedBySignal:
            return self._ask_one(request, patience_s)

    def _ask_one(self, request: tuple[Any, ...], patience_s: float) -> Any:
        try:
            process, pipe = self._ready()
        except OSError as error:
            raise RigError(f"{self._name}: this machine gives no process for it: {error.strerror}") from None
        try:
            in_time = self._is_up(process, pipe)
            if in_time:
                pipe.send(request)
                in_time = _hears(pipe, process, patience_s)
            answer = pipe.recv() if in_time else None
        except _StoppedBySignal:
            self._end(process)
            raise
        except (EOFError, OSError):
            self._end(process)
            raise EOFError from None
        if not in_time:
            self._end(process)
            raise TimeoutError
        if isinstance(answer, MemoryError):
            raise answer
        if isinstance(answer, RequestRefused):
            raise RigError(answer.why)
        return answer

    def _is_up(self, process: BaseProcess, pipe: Connection) -> bool:
        """A fresh process has said that it listens; its imports are no part of anybody's patience."""
        if self._up is not process and _hears(pipe, process, _START_S):
            pipe.recv()
            self._up = process
        return self._up is process

    async def asked(self, request: tuple[Any, ...], exchange: Callable[[tuple[Any, ...]], T]) -> T:
        """What `exchange`, which calls `ask`, makes of a request, on a thread. Who is cancelled takes the process with
        him: nobody else is to wait for what he asked, or to get his answer."""
        exchanged = asyncio.ensure_future(aside(lambda: exchange(request)))
        try:
            return await asyncio.shield(exchanged)
        except asyncio.CancelledError:
            await _to_its_end(asyncio.ensure_future(self._given_up(exchanged)))
            raise

    async def _given_up(self, exchanged: "asyncio.Future[Any]") -> None:
        """End the process until nobody waits for it any more: a thread that was slow to begin may start another."""
        while not exchanged.done():
            await aside(self.end)
            await asyncio.wait({exchanged}, timeout=_LOOK_S)
        exchanged.exception()  # that it was ended is told to nobody

    def end(self) -> None:
        """End the process, whatever it is doing; the next request gets another. A thread that waits for it sees its end
        of the pipe close.

        Blocks until the kernel has ended it, for which it may have to wait for a processor: not to be called where an
        emergency stop is answered.
        """
        with self._starting:
            self._kill(self.process)

    def close(self) -> None:
        """End it for good."""
        with self._starting:
            self._closed = True
            self._kill(self.process)

    def _ready(self) -> tuple[BaseProcess, Connection]:
        with self._starting:
            if self._closed:
                raise EOFError
            if self.process is None or self._pipe is None or not self.process.is_alive():
                ours, theirs = self._context.Pipe()
                process = self._context.Process(
                    target=self._entry, args=(theirs, *self._arguments), name=self._name, daemon=True
                )
                try:
                    start_process(process)
                except BaseException:  # one that never began can neither be asked nor ended
                    ours.close()
                    raise
                finally:
                    theirs.close()
                self.process, self._pipe = process, ours
            return self.process, self._pipe

    def _end(self, process: BaseProcess) -> None:
        with self._starting:
            self._kill(process)

    def _kill(self, process: BaseProcess | None) -> None:
        if process is None:
            return
        process.kill()
        process.join()
        if process is self.process:
            self.process = None


def _hears(pipe: Connection, process: BaseProcess, patience_s: float) -> bool:
    """Something comes within `patience_s`; _StoppedBySignal when nothing can."""
    deadline = time.monotonic() + patience_s
    while not pipe.poll(min(_LOOK_S, max(deadline - time.monotonic(), 0.0))):
        if is_stopped(process.pid):
            raise _StoppedBySignal
        if time.monotonic() >= deadline:
            return False
    return True


async def _to_its_end(work: "asyncio.Future[None]") -> None:
    """Until it is done, however often who waits is cancelled meanwhile."""
    while not work.done():
        with contextlib.suppress(asyncio.CancelledError):
            await asyncio.shield(work)
