"""An RS-485 line between a client and a server: two pseudo-terminals, and bytes that take the time of their baud
rate."""

import contextlib
import os
import select
import threading
import time
from pathlib import Path

from hil.emulators.priority import run_in_real_time
from hil.emulators.pty import plugged_pty

_LOOK_S = 0.2


class BusWire:
    """Carries frames between the ports `client` and `server`, each a link to a pty; the client's plug can be pulled."""

    def __init__(self, client: Path, server: Path, baud: int, bits_per_byte: int = 11) -> None:
        self._byte_s = bits_per_byte / baud
        self._silence_s = 0.00175 if baud > 19200 else 3.5 * self._byte_s
        self._client_device, self._server_device = client, server
        self._server = plugged_pty(server)
        self._client: tuple[int, int] | None = None

    def plug(self) -> None:
        """Connect the client's end. Idempotent."""
        if self._client is None:
            self._client = plugged_pty(self._client_device)
            threading.Thread(target=self._carry_all, args=(self._client[0],), daemon=True).start()

    def unplug(self) -> None:
        """Pull the client's plug: its port is gone. Idempotent."""
        ends, self._client = self._client, None
        for descriptor in ends or ():
            os.close(descriptor)
        self._client_device.unlink(missing_ok=True)

    def stop(self) -> None:
        """End the line for good."""
        self.unplug()
        self._server_device.unlink(missing_ok=True)

    def _carry_all(self, client: int) -> None:
        run_in_real_time()
        server = self._server[0]
        with contextlib.suppress(OSError, ValueError):
            while self._client and self._client[0] == client:
                for ready in select.select([client, server], [], [], _LOOK_S)[0]:
                    self._carry(ready, server if ready == client else client)

    def _carry(self, source: int, target: int) -> None:
        """Half duplex: one frame at a time, complete when its last byte is through; a module knows that by the silence
        after it."""
        began = time.monotonic()
        data = os.read(source, 4096)
        through_s = began + len(data) * self._byte_s + (self._silence_s if target == self._server[0] else 0.0)
        while (left := through_s - time.monotonic()) > 0:
            time.sleep(left)
        os.write(target, data)
