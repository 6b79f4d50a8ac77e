"""A process of the page's own for what takes long: reading records, expanding sweeps. The page itself answers to Stop
meanwhile.

One errand at a time; the process is niced, bounded in memory, and killed when it takes too long.
"""

import asyncio
import contextlib
import multiprocessing
import os
import resource
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Final, TypeVar

from rig.errors import RigError, StateError
from rig.service.processes import start_process

T = TypeVar("T")
PATIENCE_S: Final = 60.0
_WAITING: Final = 16
_MEMORY_BYTES: Final = 4 * 1024**3
_NICE: Final = 19


class Errands:
    """Started when it is first needed."""

    def __init__(self, patience_s: float = PATIENCE_S) -> None:
        self._patience_s = patience_s
        self._context = multiprocessing.get_context("spawn")
        self._turn = asyncio.Lock()
        self._waiting = 0
        self._starting = threading.Lock()
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None

    async def run(self, what: Callable[..., T], *arguments: Any) -> T:
        """Call a function of a module there; RigError when it raises one, takes too long, or dies."""
        if self._waiting >= _WAITING:
            raise StateError("too much is asked of the page at once; try again")
        self._waiting += 1
        try:
            async with self._turn:
                kind, result = await asyncio.to_thread(self._exchange, what, arguments)
        finally:
            self._waiting -= 1
        if kind == "refused":
            raise RigError(result)
        answer: T = result
        return answer

    def _exchange(self, what: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[str, Any]:
        try:
            pipe = self._ready()
            pipe.send((what, arguments))
            if pipe.poll(self._patience_s):
                answer: tuple[str, Any] = pipe.recv()
                return answer
            why = f"it takes more than {self._patience_s:g} s; use the command line for it"
        except (EOFError, OSError):
            why = "the process that did it has ended; it may have needed too much memory"
        self._end()
        return "refused", why

    def _ready(self) -> Connection:
        with self._starting:
            if self._process is None or self._pipe is None or not self._process.is_alive():
                self._pipe, theirs = self._context.Pipe()
                self._process = self._context.Process(target=serve, args=(theirs,), name="pamrig-errands", daemon=True)
                start_process(self._process)
                theirs.close()
            return self._pipe

    def _end(self) -> None:
        with self._starting:
            if self._process is not None:
                self._process.kill()
                self._process.join()
            self._process = self._pipe = None


def serve(pipe: Connection) -> None:
    """Entry of the process: carry out, until the other end closes."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _NICE)
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, resource.RLIM_INFINITY))
    with contextlib.suppress(EOFError, OSError):
        while True:
            what, arguments = pipe.recv()
            pipe.send(_answer(what, arguments))


def _answer(what: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[str, Any]:
    try:
        return "done", what(*arguments)
    except RigError as error:
        return "refused", str(error)
    except MemoryError:
        return "refused", f"it needs more than {_MEMORY_BYTES / 1024**3:g} GB; use the command line for it"
