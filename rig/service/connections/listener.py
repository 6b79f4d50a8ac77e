"""Lets clients in: an emergency stop at once, everybody else one after the other, so that no crowd fills the event
loop.

Who has just connected is looked at without taking anything from the connection (MSG_PEEK). That costs microseconds;
making a place for a client costs a hundred times as much, and is rationed.
"""

import asyncio
import contextlib
import errno
import os
import socket
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Final

from rig.service.connections.protocol import MAX_LINE_BYTES

SOCKET_BACKLOG: Final = 128
"""Connections that wait in the kernel to be accepted."""
_AT_ONCE: Final = 16
"""Looked at in one pass of the event loop."""
_MOST_WAITING: Final = 128
"""To be let in; one more, and the oldest is sent away."""
_LOOKED_AT: Final = 512
_OUT_OF_DESCRIPTORS_S: Final = 0.1
_SHARE: Final = 2.0

ComesFirst = Callable[[socket.socket, bytes], bool]
"""Whether a client who has said this is let in before the others."""
Serve = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


class DutyCycleLimit:
    """One thing at a time, and after each a pause of _SHARE times as long as it took: a third of the event loop at
    most."""

    def __init__(self) -> None:
        self._lock = asyncio.Lock()

    @contextlib.asynccontextmanager
    async def turn(self) -> AsyncIterator[None]:
        """Wait for one's turn. Whoever comes after it waits for the pause too."""
        loop = asyncio.get_running_loop()
        await self._lock.acquire()
        began = loop.time()
        try:
            yield
        finally:
            loop.call_later(_SHARE * (loop.time() - began), self._lock.release)


class Listener:
    """One listening socket; `serve` is called with the streams of each client that is let in."""

    def __init__(
        self, listening: socket.socket, serve: Serve, duty_cycle: DutyCycleLimit, comes_first: ComesFirst,
        *, spare: bool = False,
    ) -> None:  # fmt: skip
        """`spare`: keep a descriptor for who comes first where no other is left."""
        self._spares, self._spare = spare, -1
        self._listening, self._serve, self._duty_cycle, self._comes_first = listening, serve, duty_cycle, comes_first
        self._loop = asyncio.get_running_loop()
        self._waiting: deque[socket.socket] = deque()
        self._came = asyncio.Event()
        self._admitting = self._loop.create_task(self._admit())
        self._tasks: set[asyncio.Task[None]] = set()
        self._retiring = False
        listening.setblocking(False)
        self._keep_a_spare()
        self._loop.add_reader(listening, self._accept)

    def close(self) -> None:
        """Let nobody in any more."""
        self._stop_listening()
        for task in (self._admitting, *self._tasks):
            task.cancel()
        while self._waiting:
            self._leave(self._waiting[0]).close()

    def retire(self) -> None:
        """Give the socket back, which nobody can find any more, once whoever has connected to it waits here."""
        self._retiring = True
        self._accept()

    @property
    def over(self) -> bool:
        """Retired, and its last client has gone."""
        return self._listening.fileno() < 0 and not self._waiting and not self._tasks

    def _stop_listening(self) -> None:
        if self._listening.fileno() >= 0:
            self._loop.remove_reader(self._listening)
            self._listening.close()
        self._give_up_the_spare()

    def _keep_a_spare(self) -> None:
        if self._spares and self._spare < 0:
            with contextlib.suppress(OSError):  # none is left: the next that is free
                self._spare = os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC)

    def _give_up_the_spare(self) -> None:
        spare, self._spare = self._spare, -1
        if spare >= 0:
            os.close(spare)

    def _hear_by_the_spare(self) -> None:
        """No descriptor is left: whoever waits to be accepted is heard by the one that is kept for it, until one comes
        first, who has it then. Everybody else is sent away."""
        for _ in range(_AT_ONCE):
            if self._spare < 0:
                return
            self._give_up_the_spare()
            try:
                client, _address = self._listening.accept()
            except OSError:
                self._keep_a_spare()
                return
            client.setblocking(False)
            first_bytes = _peeked(client)
            if first_bytes and self._comes_first(client, first_bytes):
                self._let_in(client)
                return
            client.close()
            self._keep_a_spare()

    def _accept(self) -> None:
        self._keep_a_spare()
        for _ in range(_AT_ONCE):
            try:
                client, _address = self._listening.accept()
            except OSError as error:
                if error.errno in (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM):
                    self._hear_by_the_spare()
                    self._pause()
                elif self._retiring and isinstance(error, BlockingIOError):
                    self._stop_listening()
                break
            client.setblocking(False)
            self._receive(client)

    def _receive(self, client: socket.socket) -> None:
        """Let the client wait, unless he has gone or wants an emergency stop; who has said nothing yet is listened to
        meanwhile."""
        self._waiting.append(client)
        if len(self._waiting) > _MOST_WAITING:
            self._leave(self._waiting[0]).close()
        self._came.set()
        if not self._spoke(client):
            self._loop.add_reader(client, self._spoke, client)

    def _spoke(self, client: socket.socket) -> bool:
        """Whether the client has said anything; what it was decides whether he still waits."""
        first_bytes = _peeked(client)
        if first_bytes is None:
            return False
        if not first_bytes:
            self._leave(client).close()
        elif self._comes_first(client, first_bytes):
            self._let_in(self._leave(client))
        else:
            self._loop.remove_reader(client)
        return True

    def _leave(self, client: socket.socket) -> socket.socket:
        """He waits no longer, whatever becomes of him."""
        self._loop.remove_reader(client)
        self._waiting.remove(client)
        return client

    def _pause(self) -> None:
        """No descriptor is left: looking again at once would be all that this process does."""
        self._loop.remove_reader(self._listening)
        self._loop.call_later(_OUT_OF_DESCRIPTORS_S, self._resume)

    def _resume(self) -> None:
        if self._listening.fileno() >= 0:
            self._loop.add_reader(self._listening, self._accept)

    async def _admit(self) -> None:
        while True:
            await self._came.wait()
            self._came.clear()
            while self._waiting:
                async with self._duty_cycle.turn():
                    if self._waiting:
                        await asyncio.shield(self._let_in(self._leave(self._waiting[0])))

    def _let_in(self, client: socket.socket) -> "asyncio.Future[None]":
        """Serve a client; done when it has its streams, not when it has gone."""
        admitted: asyncio.Future[None] = self._loop.create_future()
        task = self._loop.create_task(self._serve_client(client, admitted))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return admitted

    async def _serve_client(self, client: socket.socket, admitted: "asyncio.Future[None]") -> None:
        reader = asyncio.StreamReader(limit=MAX_LINE_BYTES)
        streams = asyncio.StreamReaderProtocol(reader)
        try:
            transport, _ = await self._loop.connect_accepted_socket(lambda: streams, client)
        except OSError:
            client.close()
            return
        finally:
            if not admitted.done():
                admitted.set_result(None)
        await self._serve(reader, asyncio.StreamWriter(transport, streams, reader, self._loop))


def _peeked(client: socket.socket) -> bytes | None:
    """What the client has said so far; None when nothing, empty when it has gone."""
    try:
        return client.recv(_LOOKED_AT, socket.MSG_PEEK)
    except BlockingIOError:
        return None
    except OSError:
        return b""
