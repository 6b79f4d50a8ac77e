"""What systemd is told: ready, alive, stopping. The protocol of sd_notify(3) is one datagram; without systemd nothing
is sent."""

import contextlib
import os
import socket


class Notifier:
    """Speaks to the socket that systemd named in the environment, if any."""

    def __init__(self) -> None:
        self._address = os.environ.get("NOTIFY_SOCKET", "")
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) if self._address else None

    @property
    def watchdog_s(self) -> float | None:
        """How often systemd wants to hear that all is well at least; None: it does not."""
        microseconds = os.environ.get("WATCHDOG_USEC", "")
        for_us = os.environ.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        return int(microseconds) / 1e6 if microseconds.isdigit() and for_us else None

    def say(self, **facts: str | int) -> None:
        """Send assignments such as READY=1, STATUS=text; a systemd that does not listen is no error."""
        if self._socket is None:
            return
        text = "\n".join(f"{key}={value}" for key, value in facts.items())
        with contextlib.suppress(OSError):
            self._socket.sendto(text.encode(), _address(self._address))

    def close(self) -> None:
        """Let go of the socket."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def _address(named: str) -> str:
    """A leading @ stands for the zero byte of an abstract socket."""
    return "\0" + named[1:] if named.startswith("@") else named
