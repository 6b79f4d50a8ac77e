"""One client of the control socket: its lines in, one answer each, its subscription, and how long its silence is
borne."""

import asyncio
import contextlib
import logging
import select
import socket
import time
from collections.abc import Coroutine
from typing import Any, Final, Protocol

from rig.errors import RigError
from rig.service.connections import protocol
from rig.service.connections.protocol import COMMANDS, ClientRequest, Code, Refused

RATE_PER_S: Final = 200
"""Requests of one connection that are answered a second; further ones wait."""
MAX_PENDING_BYTES: Final = 256 * 1024
"""With more than this unread, events are dropped and counted; with an answer more, the reader is cut off."""
STRANGER_PATIENCE_S: Final = 5.0
"""For the first request with the token over the network, and for the single line of a client without a place."""
VIEWER_PATIENCE_S: Final = 60.0
"""For the next request over the network, and for a subscriber anywhere to take what it asked for."""
_LOOK_AFTER_S: Final = 0.2
_SUBSCRIBE_HZ: Final = (0.1, 50.0)
_USUAL_HZ: Final = 10.0
"""Of a subscriber that does not say how often: as often as somebody can read."""
_LOG = logging.getLogger("pamrig")


class ServerSide(Protocol):
    """What a connection needs of its server."""

    dropped_events: int

    def token_fits(self, given: object) -> bool:
        """Whether `given` is the token of the settings."""

    def turn(self) -> contextlib.AbstractAsyncContextManager[None]:
        """Wait for one's turn: for everything that takes time and is no emergency stop."""

    async def handle(self, request: ClientRequest) -> Any:
        """Carry out a request; RigError when it is refused."""

    def snapshot(self, cursor: int | None) -> dict[str, Any]:
        """A status for a subscriber."""


class Connection:
    """One client."""

    def __init__(
        self, server: ServerSide, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, viewer: bool
    ) -> None:
        self._server, self._reader, self._writer, self._viewer = server, reader, writer, viewer
        self._subscription: asyncio.Task[None] | None = None
        self._dropped = 0
        self._known = not viewer
        self._to: int | str | None = None
        self._ahead: asyncio.Task[bytes] | None = None
        """The line after the one that is being worked on."""
        own = writer.get_extra_info("socket")
        if own is not None and own.family == socket.AF_UNIX:
            own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MAX_PENDING_BYTES)

    async def converse(self) -> None:
        """Until the client hangs up, sends what is no line, does not read its answers, or is a stranger for too
        long."""
        while line := await self._line(self._patience_s):
            if self._pending > MAX_PENDING_BYTES:
                return
            self._writer.write(await self._answer(line))
            if not self._known:
                return
            await asyncio.sleep(1 / RATE_PER_S)

    async def hear_an_estop(self, otherwise: str) -> None:
        """Read one line and carry it out when it is an emergency stop; refuse everything else in the words
        `otherwise`."""
        line = await self._line(STRANGER_PATIENCE_S)
        with contextlib.suppress(Refused):
            if protocol.parse(protocol.decode(line)).command == "estop":
                self._writer.write(await self._answer(line))
                return
        self.refuse(otherwise)

    def refuse(self, why: str) -> None:
        """Say why there is no conversation."""
        self._writer.write(protocol.refusal(None, Code.REFUSED, why))

    def end(self) -> None:
        """No more events, and hang up; on one that takes nothing, without waiting for it."""
        for task in (self._subscription, self._ahead):
            if task is not None:
                task.cancel()
        if self._pending > MAX_PENDING_BYTES:
            self._writer.transport.abort()
        self._writer.close()

    @property
    def _patience_s(self) -> float | None:
        if not self._known:
            return STRANGER_PATIENCE_S
        return VIEWER_PATIENCE_S if self._viewer and self._subscription is None else None

    async def _line(self, patience_s: float | None) -> bytes:
        """The next line; empty at the end, and when it is too long or too long in coming, which is told."""
        try:
            async with asyncio.timeout(patience_s):
                ahead, self._ahead = self._ahead, None
                return await (ahead or self._reader.readline())
        except ValueError:  # longer than the limit
            self._writer.write(
                protocol.refusal(None, Code.BAD_REQUEST, f"a line has at most {protocol.MAX_LINE_BYTES} bytes")
            )
        except TimeoutError:
            self.refuse(f"no request within {patience_s:g} s")
        return b""

    async def _answer(self, line: bytes) -> bytes:
        """The answer to a line, whatever it is."""
        self._to = None
        try:
            return protocol.answer(*await self._result(line))
        except Refused as error:
            return protocol.refusal(self._to, error.code, str(error))
        except RigError as error:
            return protocol.refusal(self._to, Code.REFUSED, str(error))
        except Exception as error:  # noqa: BLE001 - a bug must not hang up on somebody whose next line is an emergency stop
            _LOG.exception("error in the daemon itself, please report it")
            return protocol.refusal(self._to, Code.REFUSED, f"error in the daemon itself, please report it: {error!r}")

    async def _result(self, line: bytes) -> tuple[int | str | None, Any]:
        """All but an emergency stop waits for its turn, and what only looks is done in it."""
        if protocol.may_be_an_estop(line) and (request := self._read(line)).command == "estop":
            return request.id, await self._server.handle(request)
        async with self._server.turn():
            request = self._read(line)
            if COMMANDS[request.command].looking:
                return request.id, await self._look(request)
        if request.command == "start":
            return request.id, await self._while_there(self._server.handle(request))
        return request.id, await self._server.handle(request)

    async def _while_there(self, work: Coroutine[Any, Any, Any]) -> Any:
        """What may take a minute is given up when the client has gone: what he asked for is not to move the rig then.
        An emergency stop that he sends meanwhile is heard at once; what else he says waits for its turn."""
        task = asyncio.create_task(work)
        try:
            while not task.done():
                if self._ahead is None:
                    self._ahead = asyncio.create_task(self._reader.readline())
                waited = {task} if self._ahead.done() else {task, self._ahead}
                await asyncio.wait(waited, timeout=_LOOK_AFTER_S, return_when=asyncio.FIRST_COMPLETED)
                if not task.done() and self._gone:
                    raise RigError("the client has gone")
                await self._hear_ahead()
            return task.result()
        finally:
            task.cancel()

    async def _hear_ahead(self) -> None:
        """Carry out the line after this one when it is an emergency stop."""
        ahead = self._ahead
        if ahead is None or not ahead.done() or ahead.exception() is not None:
            return
        if protocol.may_be_an_estop(ahead.result()):
            self._ahead, to = None, self._to
            self._writer.write(await self._answer(ahead.result()))
            self._to = to

    @property
    def _gone(self) -> bool:
        """Hung up in both directions; one that only says no more (`echo ... | nc -U`) still waits for its answer."""
        own = self._writer.get_extra_info("socket")
        look = select.poll()
        look.register(own.fileno(), 0)
        return any(seen & (select.POLLHUP | select.POLLERR | select.POLLNVAL) for _, seen in look.poll(0))

    def _read(self, line: bytes) -> ClientRequest:
        message = protocol.decode(line)
        self._to = protocol.request_id(message)
        request = protocol.parse(message)
        self._check_allowed(request, message.get("token"))
        return request

    async def _look(self, request: ClientRequest) -> Any:
        return self._subscribe(request) if request.command == "subscribe" else await self._server.handle(request)

    def _check_allowed(self, request: ClientRequest, token: object) -> None:
        if not self._viewer:
            return
        if not self._server.token_fits(token):
            self._known = False
            raise Refused(Code.NOT_ALLOWED, "the token is missing or wrong")
        self._known = True
        if not COMMANDS[request.command].looking:
            raise Refused(
                Code.NOT_ALLOWED,
                f"{request.command} is not allowed over the network; use the socket on the rig's machine",
            )

    @property
    def _pending(self) -> int:
        return self._writer.transport.get_write_buffer_size()

    def _subscribe(self, request: ClientRequest) -> dict[str, Any]:
        low, high = _SUBSCRIBE_HZ
        rate_hz = float(request.arguments.get("rate_hz", _USUAL_HZ))
        if not low <= rate_hz <= high:
            raise Refused(Code.BAD_ARGUMENT, f"subscribe: rate_hz: {rate_hz:g} is outside {low:g} .. {high:g}")
        if self._subscription is not None:
            self._subscription.cancel()
        self._subscription = asyncio.create_task(
            self._publish(1 / rate_hz, bool(request.arguments.get("samples", False)))
        )
        return {"rate_hz": rate_hz}

    async def _publish(self, period_s: float, samples: bool) -> None:
        """Status after status; those that the client is too slow for are dropped, and the next says how many."""
        cursor: int | None = 0 if samples else None
        taken_s = time.monotonic()
        with contextlib.suppress(ConnectionError):
            while not self._writer.is_closing():
                if self._pending <= MAX_PENDING_BYTES:
                    taken_s = time.monotonic()
                    cursor = await self._send_status(cursor)
                elif time.monotonic() - taken_s > VIEWER_PATIENCE_S:
                    self._writer.transport.abort()
                else:
                    self._dropped += 1
                    self._server.dropped_events += 1
                await asyncio.sleep(period_s)

    async def _send_status(self, cursor: int | None) -> int | None:
        """One event; returns where the next begins."""
        async with self._server.turn():
            status = self._server.snapshot(cursor)
            cursor = status.pop("cursor", cursor)
            self._writer.write(protocol.encode({"event": "status", "dropped": self._dropped, "status": status}))
        return cursor
