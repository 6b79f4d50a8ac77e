"""The control socket: many clients, none of which can hold up the daemon, and none of which comes near the loop.

Who looks over the network has places of his own and takes none from the Unix socket; when all places are taken there, a
client is still heard once, for an emergency stop. Over TCP only commands for looking are allowed, and only with the
token.
"""

import asyncio
import contextlib
import grp
import hmac
import os
import socket
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable
from os.path import samestat
from pathlib import Path
from typing import Any, Final, NamedTuple

from rig.errors import ConfigError, StateError
from rig.service.connections import protocol, socket_access
from rig.service.connections.connection import Connection
from rig.service.connections.listener import SOCKET_BACKLOG, DutyCycleLimit, Listener
from rig.service.connections.protocol import ClientRequest, Refused

MAX_CLIENTS: Final = 64
"""On the Unix socket."""
MAX_VIEWERS: Final = 16
"""Over the network."""
_HEARD_ONCE: Final = 8
"""Clients beyond MAX_CLIENTS of whom a single line is read, for an emergency stop; one more, and the oldest of them
goes."""
_SUN_PATH: Final = 107

Handler = Callable[[ClientRequest], Awaitable[Any]]
Snapshot = Callable[[int | None], dict[str, Any]]


class _BoundSocket(NamedTuple):
    """The Unix socket by which clients come."""

    path: Path
    made: os.stat_result
    """What was made there."""
    listener: Listener

    @property
    def is_found(self) -> bool:
        """What lies at the path is the socket that was made there."""
        with contextlib.suppress(OSError):
            return samestat(os.lstat(self.path), self.made)
        return False


class Server:
    """Listens; hands each request to `handle` and each event's making to `snapshot(cursor)`."""

    def __init__(self, handle: Handler, snapshot: Snapshot, estop: Callable[[], None] = lambda: None) -> None:
        """`estop` begins an emergency stop without waiting; `handle` then sees it through and answers."""
        self._handle, self._snapshot, self._estop = handle, snapshot, estop
        self._listeners: list[Listener] = []
        self._duty_cycle = DutyCycleLimit()
        self._lock: int | None = None
        self._local: set[Connection] = set()
        self._viewers: set[Connection] = set()
        self._heard_once: deque[asyncio.Task[Any]] = deque()
        self._group = ""
        self._bound: _BoundSocket | None = None
        self._token = b""
        self._tasks: set[asyncio.Task[Any]] = set()
        self.dropped_events = 0

    @property
    def clients(self) -> int:
        """How many are connected."""
        return len(self._local) + len(self._viewers)

    async def listen(self, path: Path, group: str) -> None:
        """Take the Unix socket at `path`; StateError when another daemon has it. A stale one is replaced."""
        if len(os.fsencode(path)) > _SUN_PATH:
            raise ConfigError(f"{path}: a socket's path has at most {_SUN_PATH} bytes")
        self._group = group
        _make_folder(path)
        lock = path.with_name(path.name + ".lock")
        self._lock = socket_access.take_lock(lock, f"{path}: another daemon is running; see `pamrig status`")
        self._open(path)

    def _open(self, path: Path) -> None:
        try:
            socket_access.remove_stale_socket(path)
            listening = _unix_socket(path)
            made = os.lstat(path)
        except OSError as error:  # its folder cannot be looked at at present, or no descriptor is left
            raise StateError(f"{path}: cannot be made: {error.strerror}") from None
        fresh = Listener(listening, self._serve_local, self._duty_cycle, self._stopped_at_once, spare=True)
        self._listeners.append(fresh)
        if self._bound is not None:
            self._bound.listener.retire()
        self._bound = _BoundSocket(path, made, fresh)
        if self._group:
            _give_to(path, self._group)

    def stay_reachable(self) -> bool:
        """Make the socket anew where somebody has removed it, for nobody could stop the rig by it any more; whether it
        was. StateError when it cannot be made. Who is connected stays so, and nothing else is left of the old one."""
        for listener in [each for each in self._listeners if each.over]:
            listener.close()
            self._listeners.remove(listener)
        if self._bound is None or self._bound.is_found:
            return False
        _make_folder(self._bound.path)
        self._open(self._bound.path)
        return True

    async def listen_for_viewers(self, host: str, port: int, token: str) -> int:
        """TCP, only for looking and only with `token`; returns the port."""
        self._token = token.encode()
        try:
            found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
            family, _, _, _, address = found[0]
            listening = socket.create_server(address[:2], family=family, backlog=SOCKET_BACKLOG)
        except OSError as error:
            raise StateError(f"{host}:{port}: cannot listen there: {error.strerror}") from None
        self._listeners.append(Listener(listening, self._serve_viewer, self._duty_cycle, lambda *_: False))
        return int(listening.getsockname()[1])

    async def close(self) -> None:
        """Hang up on everybody and give the socket back."""
        for listener in self._listeners:
            listener.close()
        self._listeners.clear()
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._bound is not None and self._bound.is_found:
            self._bound.path.unlink(missing_ok=True)
        self._bound = None
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _stopped_at_once(self, client: socket.socket, first_bytes: bytes) -> bool:
        """An emergency stop begins before its client has a place; it comes first then, and is answered like any
        other."""
        line, whole, _ = first_bytes.partition(b"\n")
        with contextlib.suppress(Refused):
            if whole and protocol.may_be_an_estop(line) and protocol.parse(protocol.decode(line)).command == "estop":
                if socket_access.may_command(client, self._group):
                    self._estop()
                return True
        return False

    async def _serve_local(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async with self._connected(reader, writer, viewer=False) as connection:
            if not socket_access.may_command(writer.get_extra_info("socket"), self._group):
                connection.refuse(
                    f"only the daemon's own user, {os.getuid()}, and root may command it; see `group` in its settings"
                )
            elif len(self._local) < MAX_CLIENTS:
                await self._seat(connection, self._local, MAX_CLIENTS)
            else:
                await self._hear_once(connection)

    async def _serve_viewer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async with self._connected(reader, writer, viewer=True) as connection:
            await self._seat(connection, self._viewers, MAX_VIEWERS)

    @contextlib.asynccontextmanager
    async def _connected(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, viewer: bool
    ) -> AsyncIterator[Connection]:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        connection = Connection(self, reader, writer, viewer)
        try:
            yield connection
        except (ConnectionError, asyncio.CancelledError):
            pass  # a client that dies in the middle, or the end of the daemon
        finally:
            self._tasks.discard(task)
            connection.end()

    async def _seat(self, connection: Connection, seats: set[Connection], most: int) -> None:
        if len(seats) >= most:
            connection.refuse(f"there are {most} clients already")
            return
        seats.add(connection)
        try:
            await connection.converse()
        finally:
            seats.discard(connection)

    async def _hear_once(self, connection: Connection) -> None:
        """Beyond the last place: one line, in case it is an emergency stop. Who comes latest is heard."""
        task = asyncio.current_task()
        assert task is not None
        self._heard_once.append(task)
        if len(self._heard_once) > _HEARD_ONCE:
            self._heard_once[0].cancel()
        try:
            await connection.hear_an_estop(f"there are {MAX_CLIENTS} clients already; only `pamrig estop` is heard now")
        finally:
            self._heard_once.remove(task)

    # for connections

    def token_fits(self, given: object) -> bool:
        """Compared in constant time."""
        if not isinstance(given, str) or not self._token:
            return False
        return hmac.compare_digest(given.encode("utf-8", "surrogatepass"), self._token)

    def turn(self) -> contextlib.AbstractAsyncContextManager[None]:
        """Wait for one's turn: for everything that takes time and is no emergency stop."""
        return self._duty_cycle.turn()

    async def handle(self, request: ClientRequest) -> Any:
        """Carry out."""
        return await self._handle(request)

    def snapshot(self, cursor: int | None) -> dict[str, Any]:
        """Make a status for a subscriber."""
        return self._snapshot(cursor)


def _make_folder(path: Path) -> None:
    """Of the socket at `path`; StateError when it may not be trusted, or cannot be made."""
    socket_access.check_folder(path.parent, make=True)
    try:
        path.parent.mkdir(socket_access.OWN_MODE, parents=True, exist_ok=True)
        socket_access.keep_others_from(path.parent, "the daemon's socket", among_others=True)
    except OSError as error:
        raise StateError(f"{path}: cannot be made: {error.strerror}") from None


def _unix_socket(path: Path) -> socket.socket:
    """Listening at `path`, for its owner only."""
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        os.fchmod(listening.fileno(), 0o600)  # what the name will have (Linux); a umask is of all threads at once
        listening.bind(str(path))
        listening.listen(SOCKET_BACKLOG)
    except OSError as error:
        listening.close()
        raise StateError(f"{path}: cannot listen there: {error.strerror}") from None
    return listening


def _give_to(path: Path, group: str) -> None:
    try:
        os.chown(path, -1, grp.getgrnam(group).gr_gid)
        path.chmod(0o660)
    except KeyError:
        raise ConfigError(f"group: {group!r} does not exist; make it with `groupadd {group}`") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be given to the group {group!r}: {error.strerror}") from None
