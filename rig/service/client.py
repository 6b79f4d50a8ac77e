"""The daemon's client for scripts, notebooks and the command line: a few lines over the control socket.

import pamrig

with pamrig.Client() as rig:
    rig.arm()
    rig.start("paper.yaml")
    rig.wait()
    print(rig.status()["queue"])
"""

import contextlib
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, Self

from rig.errors import RigError, StateError
from rig.service.connections import protocol, socket_access
from rig.service.connections.protocol import Code
from rig.service.processes import DISK_PATIENCE_S

_CONNECT_AGAIN_S: Final = 0.0005
_SAY_AGAIN_S: Final = 0.001
"""Before an emergency stop that was crowded out is said again; twice as long after each time, up to the next."""
_SAY_AGAIN_AT_MOST_S: Final = 0.05
_EXPANDING_S: Final = 120.0
"""So long the daemon bears with each sweep of a `start`."""
ESTOP_TIMEOUT_S: Final = 5.0
"""Longer than a daemon takes to find that nobody could carry it out."""


class _HungUp(RigError):
    """The daemon ended the connection without an answer."""


class Client:
    """One connection to a daemon: RigError, one line, when there is none; StateError when a command does not fit the
    state."""

    def __init__(self, path: Path | None = None, timeout_s: float = 40.0) -> None:
        self.path = path or socket_access.default_socket()
        self._number, self._timeout_s = 0, timeout_s
        self._open(timeout_s)

    def _open(self, timeout_s: float) -> None:
        socket_access.check_folder(self.path.parent)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(timeout_s)
        try:
            self._connect(timeout_s)
            socket_access.check_daemon(self.path, self._socket)
        except OSError as error:
            self._socket.close()
            raise RigError(f"{self.path}: {_no_daemon(self.path, error)}") from None
        except BaseException:
            self._socket.close()
            raise
        self._lines = self._socket.makefile("rb")

    def _connect(self, timeout_s: float) -> None:
        """Try again while the queue is full (EAGAIN on Linux: the backlog of a Unix socket is exhausted)."""
        until = time.monotonic() + timeout_s
        while True:
            try:
                self._socket.connect(str(self.path))
                return
            except BlockingIOError:
                if time.monotonic() > until:
                    raise
                time.sleep(_CONNECT_AGAIN_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Hang up."""
        self._lines.close()
        self._socket.close()

    def call(self, command: str, **arguments: Any) -> Any:
        """Send one command and return its result; the other methods are this with a name."""
        self._number += 1
        self._send({"id": self._number, "command": command, **arguments})
        while (message := self._receive()).get("id") != self._number:
            if "event" not in message:
                break
        if not message.get("ok"):
            error = message.get("error") or {}
            kind = StateError if error.get("code") == Code.WRONG_STATE else RigError
            raise kind(str(error.get("message", "the daemon sent no reason")))
        return message.get("result")

    def status(self) -> dict[str, Any]:
        """Everything there is to know now; keys as in docs/reference/control_protocol.md."""
        return dict(self.call("status"))

    def arm(self, by: str = "") -> list[str]:
        """Let the daemon command the rig; nothing moves yet. Returns what to know of calibrations and devices, a line
        each. `by`: who arms, for the status."""
        return list(self.call("arm", **({"by": by} if by else {})))

    def start(self, *sweeps: str | Path, pause_s: float = 0.0, before: str = "") -> list[dict[str, Any]]:
        """Queue sweeps and work on the queue; without sweeps, go on with what is in it. Returns the new jobs.

        StateError when an interrupted queue still holds something and `before` does not say what is to become of it:
        "first" does it before the new sweeps, "leave" leaves it where it is.
        """
        paths = [str(Path(sweep).absolute()) for sweep in sweeps]
        with self._bearing(_EXPANDING_S * len(paths)):
            return self._start(paths, pause_s, before)

    def _start(self, paths: list[str], pause_s: float, before: str) -> list[dict[str, Any]]:
        return list(self.call("start", sweeps=paths, pause_s=pause_s, **({"before": before} if before else {})))

    def stop(self, after_current: bool = False) -> None:
        """Ramp down and hold the queue, at once or after the record that runs."""
        self.call("stop", after_current=after_current)

    def estop(self) -> dict[str, Any]:
        """Safe state at once. RigError unless the device took it; returns who wrote it and whether it was seen at the
        device.

        By a connection of its own: on this one something may be under way. Who is crowded out by others before he has
        said it connects anew and says it again.
        """
        until, pause_s = time.monotonic() + ESTOP_TIMEOUT_S, _SAY_AGAIN_S
        while True:
            try:
                with Client(self.path, ESTOP_TIMEOUT_S) as fresh:
                    return dict(fresh.call("estop"))
            except _HungUp:
                if time.monotonic() > until:
                    raise
            time.sleep(pause_s)
            pause_s = min(2 * pause_s, _SAY_AGAIN_AT_MOST_S)

    def reset(self) -> None:
        """Clear a fault whose cause is gone; the rig is disarmed then. It takes as long as the disk of the recorder
        that a new one replaces."""
        with self._bearing(2.0 * DISK_PATIENCE_S):
            self.call("reset")

    def mark(self, text: str) -> None:
        """A line into the log of the record that runs; StateError when none does."""
        self.call("mark", text=text)

    def clear(self) -> None:
        """Take what waits out of the queue."""
        self.call("clear")

    def subscribe(self, rate_hz: float = 10.0, samples: bool = False) -> Iterator[dict[str, Any]]:
        """Status after status until the daemon goes; with `samples`, each has the columns of what happened since the
        last."""
        self.call("subscribe", rate_hz=rate_hz, samples=samples)
        while True:
            message = self._receive()
            if message.get("event") == "status":
                yield message["status"]

    def wait(self, poll_s: float = 0.2) -> dict[str, Any]:
        """Until nothing runs or waits any more; returns the last status, which may show a fault."""
        while True:
            status = self.status()
            if not status["working"]:
                return status
            time.sleep(poll_s)

    @contextlib.contextmanager
    def _bearing(self, more_s: float) -> Iterator[None]:
        """Wait so much longer for what is asked in it."""
        self._socket.settimeout(self._timeout_s + more_s)
        try:
            yield
        finally:
            self._socket.settimeout(self._timeout_s)

    def _send(self, message: dict[str, Any]) -> None:
        try:
            self._socket.sendall(protocol.encode(message))
        except ConnectionError:
            pass  # a daemon that hangs up says why first, which `_receive` reads
        except OSError as error:
            raise RigError(f"{self.path}: the daemon hung up ({error.strerror or error})") from None

    def _receive(self) -> dict[str, Any]:
        line = b""
        with contextlib.suppress(ConnectionError):
            try:
                line = self._lines.readline()
            except ConnectionError:
                raise
            except OSError:  # no answer in time, or none to what was asked before on this connection
                raise RigError(
                    f"{self.path}: the daemon does not answer; it may be busy with what this client asked before, be "
                    "stopped or hang. If it hangs its loop makes the rig safe after 1 s, its guardian when the loop is "
                    "lost too; make sure by `pamrig estop`, or without a daemon by `pamrig service safe --rig RIG`"
                ) from None
        if not line:
            raise _HungUp(f"{self.path}: the daemon hung up")
        return protocol.decode(line)


def _no_daemon(path: Path, error: OSError) -> str:
    if isinstance(error, FileNotFoundError):
        return "no daemon there; start one with `pamrig daemon`, or set PAMRIG_SOCKET"
    if isinstance(error, ConnectionRefusedError):
        return (
            "the daemon behind this socket is gone, and nothing here knows what stands at the rig's valves: "
            "`pamrig service safe --rig RIG` writes the safe state and looks; `pamrig daemon` then starts it, disarmed"
        )
    if isinstance(error, PermissionError):
        return (
            "not allowed: that daemon is for its own user, root and the members of the group that its settings name"
            + socket_access.owned_by(path)
        )
    return error.strerror or str(error)
