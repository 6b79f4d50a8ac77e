"""Ctrl-C to a command whose rig is being opened: a module that gives no connection, for ten seconds."""

import contextlib
import json
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from rig.app import shipped
from rig.config import read_yaml
from rig.errors import CheckFailed, RigError

_CONNECT_S: Final = 10.0
_ENDS_S: Final = 5.0
"""Half of what the module would take, on a machine that does other work."""
_LOOK_S: Final = 0.01
_SYN_SENT: Final = "02"
_SAYS: Final = "nothing was written to the rig"


def interrupt_opening(folder: Path, sweep: Path, start_s: float) -> int:
    """Returns when it was interrupted; CheckFailed when it did not end by that, in words."""
    with _without_answer() as port:
        rig = folder / "opening.yaml"
        rig.write_text(json.dumps(_rig(port)), encoding="utf-8")
        command = [sys.executable, "-m", "rig.cli.main", "run", str(sweep), "--rig", str(rig), "--force", "-o"]
        with subprocess.Popen([*command, str(folder / "opening")], stderr=subprocess.PIPE, text=True) as run:
            try:
                _await_opening(run, port, start_s)
                now_ns = time.monotonic_ns()
                run.send_signal(signal.SIGINT)
                _, errors = run.communicate(timeout=_ENDS_S)
            except subprocess.TimeoutExpired:
                raise CheckFailed(f"a run that opens its rig did not end within {_ENDS_S:g} s of Ctrl-C") from None
            finally:
                run.kill()
    if run.returncode != 130 or _SAYS not in errors:
        raise CheckFailed(f"Ctrl-C while a rig opens ended with {run.returncode}: {errors[-300:]}")
    return now_ns


def _await_opening(run: "subprocess.Popen[str]", port: int, start_s: float) -> None:
    deadline = time.monotonic() + start_s
    while not _is_asked(port):
        if run.poll() is not None or time.monotonic() > deadline:
            raise RigError("the run that was to be interrupted did not come to open its rig")
        time.sleep(_LOOK_S)


def _is_asked(port: int) -> bool:
    """Whether somebody waits for a connection there, as the kernel has it."""
    rows = (row.split() for row in Path("/proc/net/tcp").read_text(encoding="ascii").splitlines()[1:])
    return any(row[2].endswith(f":{port:04X}") and row[3] == _SYN_SENT for row in rows)


@contextlib.contextmanager
def _without_answer() -> Iterator[int]:
    """A port of this machine that takes no connection: its queue is full."""
    with contextlib.ExitStack() as sockets:
        server = sockets.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0))
        port: int = server.getsockname()[1]
        sockets.enter_context(socket.create_connection(("127.0.0.1", port)))  # Linux queues one more than it was told
        yield port


def _rig(port: int) -> dict[str, Any]:
    """A lab's rig, its module at that port."""
    rigs = shipped.configs() / "rigs"
    rig: dict[str, Any] = read_yaml(rigs / "all_modbus.yaml")  # type: ignore[assignment]
    module = rig["devices"]["wago"]
    module |= {
        "map": str((rigs / module["map"]).resolve()), "host": "127.0.0.1", "port": port, "connect_s": _CONNECT_S,
    }  # fmt: skip
    return rig
