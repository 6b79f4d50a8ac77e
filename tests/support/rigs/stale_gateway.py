"""A Modbus TCP gateway before a module, which may stop passing anything on and answer with what it heard before: under
the right transaction id, from the right unit."""

import contextlib
import socket
import threading
from typing import Final

_HEAD: Final = 7
_WRITES: Final = (6, 15, 16)
_BOTH, _READING = 23, 6
"""Read and write in one; the bytes of it that say what is read."""


class StaleGateway:
    """Serves on `port` until `stop`; `stale` from then on: what is written is confirmed and goes nowhere, what is read
    is what was read there last."""

    def __init__(self, module_port: int) -> None:
        self._module_port = module_port
        self.stale = False
        self._heard: dict[bytes, bytes] = {}
        """Reading -> the last reply to it."""
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._server.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def stop(self) -> None:
        """Nobody listens any more."""
        self._server.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._server.accept()
                threading.Thread(target=self._serve, args=(client,), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        with client, socket.create_connection(("127.0.0.1", self._module_port)) as module:
            for one in (client, module):
                one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with contextlib.suppress(OSError, EOFError):
                while True:
                    request = _frame(client)
                    client.sendall(request[:2] + self._answered(module, request)[2:])

    def _answered(self, module: socket.socket, request: bytes) -> bytes:
        asked = request[_HEAD - 1 :]
        asked = asked[:_READING] if request[_HEAD] == _BOTH else asked
        if self.stale and request[_HEAD] in _WRITES:
            pdu = request[_HEAD - 1 : _HEAD + 5]
            return request[:4] + len(pdu).to_bytes(2, "big") + pdu
        if self.stale and asked in self._heard:
            return self._heard[asked]
        module.sendall(request)
        reply = _frame(module)
        if request[_HEAD] not in _WRITES:
            self._heard[asked] = reply
        return reply


def _frame(wire: socket.socket) -> bytes:
    """One whole one; EOFError at the end."""
    head = _exactly(wire, _HEAD - 1)
    return head + _exactly(wire, int.from_bytes(head[4:6], "big"))


def _exactly(wire: socket.socket, count: int) -> bytes:
    came = b""
    while len(came) < count:
        more = wire.recv(count - len(came))
        if not more:
            raise EOFError
        came += more
    return came
