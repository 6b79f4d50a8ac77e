"""The interpreter's layer: an audit hook that refuses, from Python, files elsewhere, programs, connections and the
generators."""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

_FILES: Final = ("open", "os.listdir", "os.scandir")
_NEVER: Final = (
    "socket.connect", "socket.bind", "socket.sendto", "socket.sendmsg", "subprocess.Popen", "os.exec", "os.posix_spawn",
    "os.system",
    "os.kill",
)  # fmt: skip


def enter(readable: Sequence[Path], writable: Sequence[Path]) -> None:
    """Guard this interpreter from now on."""
    inside = tuple(os.path.realpath(path) for path in (*readable, *writable))

    def guard(event: str, arguments: tuple[Any, ...]) -> None:
        if event in _FILES and isinstance(arguments[0], str | bytes | os.PathLike):
            place = os.path.realpath(os.fsdecode(arguments[0]))
            if not any(place == root or place.startswith(root + os.sep) for root in inside):
                raise PermissionError(f"blind check: {place} is outside the question")
        elif event == "import" and arguments[0].split(".")[0] == "hil":
            raise PermissionError("blind check: the generators are not for the answering process")
        elif event in _NEVER:
            raise PermissionError(f"blind check: {event} is not for the answering process")

    sys.addaudithook(guard)
