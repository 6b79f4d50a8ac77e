"""Connections to the page: who may connect, how many, how long one may say nothing. Below HTTP, before any is read."""

import asyncio
from collections.abc import Callable
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

MOST_CONNECTIONS: Final = 200
"""Connections beside those of viewers' sockets; one more, and the one that has been idle for longest goes."""
REQUEST_S: Final = 10.0
"""For a request's first line and headers, once the connection is there or the answer before is given."""
ANSWER_S: Final = 600.0
"""For an answer to be taken."""
_SWEEP_S: Final = 0.5

Admits = Callable[[tuple[Any, ...], tuple[Any, ...]], str]
"""Why the peer at the first address may not come to the second; empty when he may."""


class OpenConnections:
    """Every connection that is not a viewer's socket, with the time since when it idles."""

    def __init__(self, clock: Callable[[], float], most: int = MOST_CONNECTIONS) -> None:
        self._clock, self._most = clock, most
        self._since: dict[Any, float] = {}
        self._sweeping: asyncio.Task[None] | None = None

    def enter(self, connection: Any) -> bool:
        """Whether there is a place, which the longest idle may have to give up."""
        if self._sweeping is None:
            self._sweeping = asyncio.get_running_loop().create_task(self._sweep())
        if len(self._since) >= self._most:
            idle = next((other for other in self._since if not other.busy), None)
            if idle is None:
                return False
            self.leave(idle)
            idle.hang_up()
        self._since[connection] = self._clock()
        return True

    def leave(self, connection: Any) -> None:
        """The connection has gone, or became a viewer."""
        self._since.pop(connection, None)

    def stir(self, connection: Any) -> None:
        """The connection begins or ends a request: it is the latest again."""
        if self._since.pop(connection, None) is not None:
            self._since[connection] = self._clock()

    def overdue(self) -> list[Any]:
        """Who has been idle, or busy, for too long."""
        now = self._clock()
        return [one for one, since in self._since.items() if now - since > (ANSWER_S if one.busy else REQUEST_S)]

    async def _sweep(self) -> None:
        while True:
            await asyncio.sleep(_SWEEP_S)
            for connection in self.overdue():
                self.leave(connection)
                connection.hang_up()


class Gate(H11Protocol):
    """One connection. `admits` and `open_connections` come from `gate`."""

    admits: Admits
    open_connections: OpenConnections

    def connection_made(self, transport: Any) -> None:
        """Let in who may come and finds a place."""
        super().connection_made(transport)
        why = type(self).admits(transport.get_extra_info("peername"), transport.get_extra_info("sockname"))
        if why:
            body = why.encode() + b"\n"
            head = "HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain; charset=utf-8\r\nConnection: close\r\n"
            transport.write(f"{head}Content-Length: {len(body)}\r\n\r\n".encode() + body)
            transport.close()
        elif not self.open_connections.enter(self):
            transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Give the place back."""
        self.open_connections.leave(self)
        super().connection_lost(exc)

    def handle_events(self) -> None:
        """A request may begin here."""
        before = self.busy
        super().handle_events()
        if self.busy and not before:
            self.open_connections.stir(self)

    def on_response_complete(self) -> None:
        """The next request has its own time."""
        self.open_connections.stir(self)
        super().on_response_complete()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """From now on a viewer, who is counted elsewhere."""
        self.open_connections.leave(self)
        super().handle_websocket_upgrade(event)

    @property
    def busy(self) -> bool:
        """A request is being answered."""
        return self.cycle is not None and not self.cycle.response_complete

    def hang_up(self) -> None:
        """Without waiting for anything."""
        if not self.transport.is_closing():
            self.transport.abort()


def gate(admits: Admits) -> type[Gate]:
    """The protocol class of a server that lets in whom `admits` does not refuse."""
    open_connections = OpenConnections(lambda: asyncio.get_running_loop().time())
    return type("PageGate", (Gate,), {"admits": staticmethod(admits), "open_connections": open_connections})
