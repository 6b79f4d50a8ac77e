"""The viewers' sockets: everybody gets the same messages; who is too slow loses some and is told to begin anew."""

import asyncio
import contextlib
import json
from collections.abc import Callable
from typing import Any, Final

from starlette.websockets import WebSocket, WebSocketDisconnect

from rig.service.web.access.command_holder import CommandHolder
from rig.service.web.access.guard import visitor_of

MOST_VIEWERS: Final = 64
"""Open pages with a stream of their own; a further one is refused."""
_WAITING: Final = 100
"""Messages, four seconds' worth, for one viewer."""
_TOO_MANY: Final = 1013  # try again later (RFC 6455, IANA's registry)


class Viewers:
    """All of them."""

    def __init__(
        self, command_holder: CommandHolder, first: Callable[[], list[dict[str, Any]]], watched: Callable[[bool], None]
    ) -> None:
        """`first` makes what a new viewer is told first; `watched` hears whether there is any."""
        self._command_holder, self._first, self._watched = command_holder, first, watched
        self._queues: set[asyncio.Queue[str]] = set()

    def __len__(self) -> int:
        return len(self._queues)

    def tell(self, message: dict[str, Any]) -> None:
        """To everybody, written once."""
        if not self._queues:
            return
        text = encode(message)
        for queue in self._queues:
            _put(queue, text)

    async def serve(self, socket: WebSocket) -> None:
        """One viewer until he goes. What he says is read and not looked at."""
        if len(self._queues) >= MOST_VIEWERS:
            await socket.close(_TOO_MANY)
            return
        visitor = visitor_of(socket.scope)
        queue: asyncio.Queue[str] = asyncio.Queue(_WAITING)
        await socket.accept()
        for message in self._first():
            queue.put_nowait(encode(message))
        self._queues.add(queue)
        self._command_holder.come(visitor)
        self._watched(True)
        try:
            await self._both_ways(socket, queue)
        finally:
            self._queues.discard(queue)
            self._command_holder.go(visitor)
            self._watched(bool(self._queues))

    async def _both_ways(self, socket: WebSocket, queue: "asyncio.Queue[str]") -> None:
        ways = [asyncio.create_task(_listen(socket)), asyncio.create_task(_send(socket, queue))]
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()
            await asyncio.gather(*ways, return_exceptions=True)


def encode(message: dict[str, Any]) -> str:
    """One message as text."""
    return json.dumps(message, separators=(",", ":"), default=str)


def _put(queue: "asyncio.Queue[str]", text: str) -> None:
    if queue.full():
        while not queue.empty():
            queue.get_nowait()
        queue.put_nowait('{"kind":"behind"}')
    queue.put_nowait(text)


async def _listen(socket: WebSocket) -> None:
    with contextlib.suppress(WebSocketDisconnect, KeyError):
        while True:
            await socket.receive_text()


async def _send(socket: WebSocket, queue: "asyncio.Queue[str]") -> None:
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        while True:
            await socket.send_text(await queue.get())
