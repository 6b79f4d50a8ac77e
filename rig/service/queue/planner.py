"""The queue's way to the process that reads and expands sweeps (`rig.service.queue.expander`)."""

import asyncio
import contextlib
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Final, cast

from rig.errors import RigError
from rig.rig_config import RigConfig
from rig.service.helper_process import HelperProcess
from rig.service.queue.expander import MEMORY_BYTES, Expander, Published, Summary, serve

PLANNING_PATIENCE_S: Final = 120.0
"""For one sweep; a day of set-points at 5 ms takes about 45 s on a busy desktop."""


class Planner:
    """One such process, started when it is first needed. One request at a time; the others wait for their turn."""

    def __init__(self, rig: RigConfig, patience_s: float = PLANNING_PATIENCE_S) -> None:
        self._patience_s = patience_s
        self._turn = asyncio.Lock()
        self._helper = HelperProcess(serve, (rig,), "pamrig-planner")

    @property
    def process(self) -> BaseProcess | None:
        """The one that runs; None before the first request and after the last one was killed."""
        return self._helper.process

    async def check(self, path: Path) -> Summary:
        """What the sweep at `path` amounts to; RigError, one line, when it does not fit."""
        return cast(Summary, await self._ask(Expander.check, path))

    async def open(self, path: Path) -> Summary:
        """The same, and keep it for `publish`."""
        return cast(Summary, await self._ask(Expander.open, path))

    async def publish(self, index: int, run: int, session: int) -> Published:
        """Put the program of a record of the opened sweep where the loop finds it, as run number `run`."""
        return cast(Published, await self._ask(Expander.publish, index, run, session))

    async def warm(self) -> None:
        """Start the process before it is needed; what goes wrong is told to who needs it."""
        with contextlib.suppress(RigError):
            await self._ask(Expander.warm)

    def close(self) -> None:
        """End the process, whatever it is doing."""
        self._helper.close()

    async def _ask(self, *request: Any) -> Any:
        """A method of `Expander` and its arguments."""
        async with self._turn:
            return await self._helper.asked(request, self._exchange)

    def _exchange(self, request: tuple[Any, ...]) -> Any:
        try:
            return self._helper.ask(request, self._patience_s)
        except TimeoutError:
            why = f"takes more than {self._patience_s:g} s to read and expand; make it smaller"
        except MemoryError:
            why = f"needs more than {MEMORY_BYTES / 1024**3:g} GB to expand; make it smaller"
        except EOFError:
            why = "the process that read it has ended: the daemon is ending, or it needed too much memory"
        sweep = next((part for part in request if isinstance(part, Path)), "the sweep")
        raise RigError(f"{sweep}: {why}")
