"""A process of the page's own for what takes long: reading records, expanding sweeps. The page itself answers to Stop
meanwhile.

One piece of work at a time; what too many ask for at once is refused.
"""

import asyncio
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, Final, TypeVar, cast

from rig.errors import RigError, StateError
from rig.service.helper_process import HelperProcess
from rig.service.requests import serve_requests

T = TypeVar("T")
WORKER_PATIENCE_S: Final = 60.0
"""For one answer, s."""
_WAITING: Final = 16
_MEMORY_BYTES: Final = 4 * 1024**3


class PageWorker:
    """Started when it is first needed."""

    def __init__(self) -> None:
        self._turn = asyncio.Lock()
        self._waiting = 0
        self._helper = HelperProcess(serve, (), "pamrig-page-worker")

    async def run(self, what: Callable[..., T], *arguments: Any) -> T:
        """Call a function of a module there; RigError when it raises one, takes too long, or dies."""
        if self._waiting >= _WAITING:
            raise StateError("too much is asked of the page at once; try again")
        self._waiting += 1
        try:
            async with self._turn:
                return cast(T, await self._helper.asked((what, *arguments), self._exchange))
        finally:
            self._waiting -= 1

    def _exchange(self, request: tuple[Any, ...]) -> Any:
        try:
            return self._helper.ask(request, WORKER_PATIENCE_S)
        except TimeoutError:
            why = f"it takes more than {WORKER_PATIENCE_S:g} s; use the command line for it"
        except MemoryError:
            why = f"it needs more than {_MEMORY_BYTES / 1024**3:g} GB; use the command line for it"
        except EOFError:
            why = "the process that did it has ended; it may have needed too much memory"
        raise RigError(why)


def serve(pipe: Connection) -> None:
    """Entry of the process: call what is asked for, until the other end closes."""
    serve_requests(pipe, _call, _MEMORY_BYTES)


def _call(what: Callable[..., Any], *arguments: Any) -> Any:
    return what(*arguments)
