"""The control socket: many clients, none of which can hold up the daemon, and none of which comes near the loop.

Each connection is served one request at a time and at most RATE_PER_S of them; what a slow reader does not take is dropped, not kept.
Over TCP only commands for looking are allowed, and only with the token.
"""

import asyncio
import contextlib
import fcntl
import grp
import hmac
import logging
import os
import socket
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, Final

from rig.errors import ConfigError, RigError, StateError
from rig.service import protocol
from rig.service.protocol import COMMANDS, Code, Refused, Request

RATE_PER_S: Final = 200
MAX_CLIENTS: Final = 64
MAX_PENDING_BYTES: Final = 256 * 1024
"""With more than this unread, events are dropped and counted; with an answer more, the reader is cut off."""
_SUBSCRIBE_HZ: Final = (0.1, 50.0)
_SUN_PATH: Final = 107
_LOG = logging.getLogger("pamrig")

Handler = Callable[[Request], Awaitable[Any]]
Snapshot = Callable[[int | None], dict[str, Any]]


class Server:
    """Listens; hands each request to `handle` and each event's making to `snapshot(cursor)`."""

    def __init__(self, handle: Handler, snapshot: Snapshot) -> None:
        self._handle, self._snapshot = handle, snapshot
        self._servers: list[asyncio.Server] = []
        self._lock: int | None = None
        self._path: Path | None = None
        self._token = b""
        self._tasks: set[asyncio.Task[None]] = set()
        self.clients = 0
        self.dropped_events = 0

    async def listen(self, path: Path, group: str) -> None:
        """Take the Unix socket at `path`; StateError when another daemon has it. A stale one is replaced."""
        if len(str(path).encode()) > _SUN_PATH:
            raise ConfigError(f"{path}: a socket's path has at most {_SUN_PATH} bytes")
        self._take_lock(path)
        path.unlink(missing_ok=True)
        before = os.umask(0o177)
        try:
            server = await asyncio.start_unix_server(
                lambda r, w: self._serve(r, w, viewer=False), path, limit=protocol.MAX_LINE_BYTES
            )
        except OSError as error:
            raise StateError(f"{path}: cannot listen there: {error.strerror}") from None
        finally:
            os.umask(before)
        self._path = path
        self._servers.append(server)
        if group:
            _give_to(path, group)

    async def listen_for_viewers(self, host: str, port: int, token: str) -> int:
        """TCP, only for looking and only with `token`; returns the port."""
        self._token = token.encode()
        try:
            server = await asyncio.start_server(
                lambda r, w: self._serve(r, w, viewer=True), host, port, limit=protocol.MAX_LINE_BYTES
            )
        except OSError as error:
            raise StateError(f"{host}:{port}: cannot listen there: {error.strerror}") from None
        self._servers.append(server)
        return int(server.sockets[0].getsockname()[1])

    async def close(self) -> None:
        """Hang up on everybody and give the socket back."""
        for server in self._servers:
            server.close()
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._path is not None:
            self._path.unlink(missing_ok=True)
        if self._lock is not None:
            os.close(self._lock)

    def _take_lock(self, path: Path) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._lock = os.open(path.with_name(path.name + ".lock"), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise StateError(f"{path}: another daemon is running; see `pamrig status`") from None
        except OSError as error:
            raise StateError(f"{path}: cannot be made: {error.strerror}") from None

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, viewer: bool) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        self.clients += 1
        connection = _Connection(self, reader, writer, viewer)
        try:
            if self.clients > MAX_CLIENTS:
                writer.write(protocol.refusal(None, Code.REFUSED, f"there are {MAX_CLIENTS} clients already"))
            else:
                await connection.converse()
        except (ConnectionError, asyncio.CancelledError):
            pass  # a client that dies in the middle, or the end of the daemon
        finally:
            connection.end()
            self.clients -= 1
            self._tasks.discard(task)
            writer.close()

    # for connections

    def token_fits(self, given: object) -> bool:
        """Compared in constant time."""
        return isinstance(given, str) and bool(self._token) and hmac.compare_digest(given.encode(), self._token)

    async def handle(self, request: Request) -> Any:
        """Carry out."""
        return await self._handle(request)

    def snapshot(self, cursor: int | None) -> dict[str, Any]:
        """Make a status for a subscriber."""
        return self._snapshot(cursor)


class _Connection:
    """One client."""

    def __init__(self, server: Server, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, viewer: bool) -> None:
        self._server, self._reader, self._writer, self._viewer = server, reader, writer, viewer
        self._subscription: asyncio.Task[None] | None = None
        self._dropped = 0
        own = writer.get_extra_info("socket")
        if own is not None and own.family == socket.AF_UNIX:
            own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MAX_PENDING_BYTES)

    async def converse(self) -> None:
        """Until the client hangs up, sends what is no line, or does not read its answers."""
        while True:
            try:
                line = await self._reader.readline()
            except ValueError:  # longer than the limit
                self._writer.write(
                    protocol.refusal(None, Code.BAD_REQUEST, f"a line has at most {protocol.MAX_LINE_BYTES} bytes")
                )
                return
            if not line:
                return
            if self._pending > MAX_PENDING_BYTES:
                return
            self._writer.write(await self._answer(line))
            await asyncio.sleep(1 / RATE_PER_S)

    async def _answer(self, line: bytes) -> bytes:
        to = None
        try:
            message = protocol.decode(line)
            to = protocol.request_id(message)
            request = protocol.parse(message)
            self._check_allowed(request, message.get("token"))
            if request.command == "subscribe":
                return protocol.answer(to, self._subscribe(request))
            return protocol.answer(to, await self._server.handle(request))
        except Refused as error:
            return protocol.refusal(to, error.code, str(error))
        except RigError as error:
            return protocol.refusal(to, Code.REFUSED, str(error))

    def _check_allowed(self, request: Request, token: object) -> None:
        if not self._viewer:
            return
        if not self._server.token_fits(token):
            raise Refused(Code.NOT_ALLOWED, "the token is missing or wrong")
        if not COMMANDS[request.command].looking:
            raise Refused(
                Code.NOT_ALLOWED, f"{request.command} is not allowed over the network; use the socket on the rig's machine"
            )

    @property
    def _pending(self) -> int:
        return self._writer.transport.get_write_buffer_size()

    def _subscribe(self, request: Request) -> dict[str, Any]:
        low, high = _SUBSCRIBE_HZ
        rate_hz = float(request.arguments.get("rate_hz", 10.0))
        if not low <= rate_hz <= high:
            raise Refused(Code.BAD_ARGUMENT, f"subscribe: rate_hz: {rate_hz:g} is outside {low:g} .. {high:g}")
        self.end()
        self._subscription = asyncio.create_task(self._publish(1 / rate_hz, bool(request.arguments.get("samples", False))))
        return {"rate_hz": rate_hz}

    async def _publish(self, period_s: float, samples: bool) -> None:
        """Status after status; those that the client is too slow for are dropped, and the next says how many."""
        cursor: int | None = 0 if samples else None
        with contextlib.suppress(ConnectionError):
            while not self._writer.is_closing():
                if self._pending > MAX_PENDING_BYTES:
                    self._dropped += 1
                    self._server.dropped_events += 1
                else:
                    status = self._server.snapshot(cursor)
                    cursor = status.pop("cursor", cursor)
                    self._writer.write(protocol.encode({"event": "status", "dropped": self._dropped, "status": status}))
                await asyncio.sleep(period_s)

    def end(self) -> None:
        """No more events."""
        if self._subscription is not None:
            self._subscription.cancel()


def _give_to(path: Path, group: str) -> None:
    try:
        os.chown(path, -1, grp.getgrnam(group).gr_gid)
        path.chmod(0o660)
    except KeyError:
        raise ConfigError(f"group: {group!r} does not exist; make it with `groupadd {group}`") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be given to the group {group!r}: {error.strerror}") from None
