"""The page as a client of the daemon: one subscription that is always there, commands over connections of their own.

Emergency stops have threads that nothing else uses, and a fresh connection each, which the daemon hears first.
"""

import asyncio
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

from rig.errors import RigError
from rig.service.client import Client

WATCHED_HZ: Final = 30.0
"""While somebody looks."""
QUIET_HZ: Final = 5.0
"""Otherwise: the daemon keeps 5 s of samples, so the plots have no hole when somebody comes."""
_AGAIN_S: Final = 0.3
_PATIENCE_S: Final = 3.0
_LOOK_S: Final = 0.5
_STOPS: Final = 4
_COMMANDS: Final = 8

OnStatus = Callable[[dict[str, Any] | None, str], None]
"""Called in the event loop with each status, or None and why there is none."""


class DaemonLink:
    """The daemon behind `path`."""

    def __init__(self, path: Path, on_status: OnStatus) -> None:
        self._path, self._on_status = path, on_status
        self._rate_hz = QUIET_HZ
        self._stops = ThreadPoolExecutor(_STOPS, "stop")
        self._commands = ThreadPoolExecutor(_COMMANDS, "command")
        self._loop: asyncio.AbstractEventLoop | None = None

    def follow(self) -> None:
        """Begin to listen; call it in the event loop."""
        self._loop = asyncio.get_running_loop()
        threading.Thread(target=self._listen, name="listen", daemon=True).start()

    def watched(self, somebody: bool) -> None:
        """Whether anybody looks."""
        self._rate_hz = WATCHED_HZ if somebody else QUIET_HZ

    async def estop(self) -> dict[str, Any]:
        """Safe state at once; RigError unless the device took it."""
        return await asyncio.get_running_loop().run_in_executor(self._stops, self._estop)

    async def call(self, command: str, **arguments: Any) -> Any:
        """Any other command; RigError when it is refused."""
        return await asyncio.get_running_loop().run_in_executor(self._commands, self._call, command, arguments)

    async def status(self) -> dict[str, Any]:
        """The status now; TimeoutError when it does not come at once."""
        async with asyncio.timeout(_LOOK_S):
            return dict(await self.call("status"))

    async def start(self, sweeps: list[Path], pause_s: float, before: str) -> Any:
        """Queue sweeps and work on the queue."""
        return await asyncio.get_running_loop().run_in_executor(self._commands, self._start, sweeps, pause_s, before)

    def _estop(self) -> dict[str, Any]:
        with Client(self._path, _PATIENCE_S) as client:
            return client.estop()

    def _call(self, command: str, arguments: dict[str, Any]) -> Any:
        with Client(self._path) as client:
            return client.call(command, **arguments)

    def _start(self, sweeps: list[Path], pause_s: float, before: str) -> Any:
        with Client(self._path) as client:
            return client.start(*sweeps, pause_s=pause_s, before=before)

    def _listen(self) -> None:
        """For ever, in a thread of its own."""
        while True:
            try:
                with Client(self._path, _PATIENCE_S) as client:
                    self._hear(client)
            except RigError as error:
                self._tell(None, str(error))
            time.sleep(_AGAIN_S)

    def _hear(self, client: Client) -> None:
        while True:
            rate_hz = self._rate_hz
            for status in client.subscribe(rate_hz, samples=True):
                self._tell(status, "")
                if rate_hz != self._rate_hz:
                    break

    def _tell(self, status: dict[str, Any] | None, why: str) -> None:
        assert self._loop is not None
        self._loop.call_soon_threadsafe(self._on_status, status, why)
