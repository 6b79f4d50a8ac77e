"""A Modbus rig whose module can be taken off its line and put back, for every process that talks to it."""

import contextlib
import json
import socket
import threading
from pathlib import Path

from rig.qualify.faults.wired import ModbusFaultBench


class Line:
    """Between a rig and its module; `cut` closes what is connected and lets nobody connect, until `mend`."""

    def __init__(self, module: int) -> None:
        self._module = module
        self._ends: set[socket.socket] = set()
        self._cut = threading.Event()
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listening.getsockname()[1])
        threading.Thread(target=self._let_in, args=(self._listening,), daemon=True).start()

    def cut(self) -> None:
        self._cut.set()
        for end in (self._listening, *self._ends):
            _hang_up(end)

    def mend(self) -> None:
        self._cut.clear()
        self._listening = socket.create_server(("127.0.0.1", self.port))
        threading.Thread(target=self._let_in, args=(self._listening,), daemon=True).start()

    def _let_in(self, listening: socket.socket) -> None:
        with listening:
            while True:
                try:
                    rig, _ = listening.accept()
                except OSError:
                    return
                module = socket.create_connection(("127.0.0.1", self._module))
                self._ends |= {rig, module}
                for ends in ((rig, module), (module, rig)):
                    threading.Thread(target=self._carry, args=ends, daemon=True).start()
                if self._cut.is_set():
                    self.cut()

    def _carry(self, source: socket.socket, to: socket.socket) -> None:
        try:
            while said := source.recv(4096):
                to.sendall(said)
        except OSError:
            pass
        _hang_up(to)
        self._ends.discard(source)
        source.close()


def _hang_up(end: socket.socket) -> None:
    with contextlib.suppress(OSError):
        end.shutdown(socket.SHUT_RDWR)


class SwitchedBench(ModbusFaultBench):
    """`line` leads to the module, whose own watchdog is of no help."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, watchdog_s=60.0)
        rig = json.loads(self.rig.read_text())
        module = rig["devices"]["wago"]
        self.line = Line(module["port"])
        module["port"] = self.line.port
        self.rig.write_text(json.dumps(rig))

    def __exit__(self, *_: object) -> None:
        super().__exit__()
        self.line.cut()
