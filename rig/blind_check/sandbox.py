"""Where the answering process lives: it may read its question, the program and the system, and write its answer; nothing else.

Two layers. The kernel's (Landlock, Linux 5.13 and later) cannot be climbed from inside: files beyond the given folders, other
processes' memory and command lines, and outgoing connections are refused whatever code runs. The interpreter's (an audit hook)
says the same in Python where the kernel has no Landlock, and there it stops accidents, not attackers; `enter` returns which
layers stand, and the result says so. Call it before any thread starts: it cannot be undone.
"""

import ctypes
import os
import struct
import sys
import sysconfig
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_NO_NEW_PRIVILEGES: Final = 38
_ASK_VERSION: Final = 1
_PATH_BENEATH: Final = 1

_EXECUTE, _READ_FILE, _READ_DIR = 1 << 0, 1 << 2, 1 << 3
_READ: Final = _EXECUTE | _READ_FILE | _READ_DIR
_FILE_RIGHTS: Final = _EXECUTE | _READ_FILE | 1 << 1 | 1 << 14
"""Rights that a rule for a single file may hold: execute, read, write, truncate."""
_RIGHTS_SINCE: Final = {1: (1 << 13) - 1, 2: 1 << 13, 3: 1 << 14}
"""Landlock version -> the file rights it brought: the first 13, refer, truncate."""
_NETWORK: Final = 0b11
"""Bind and connect TCP, since version 4."""
_SCOPES: Final = 0b11
"""Abstract sockets and signals to the outside, since version 6."""

SYSTEM_FOLDERS: Final = (
    "/usr",
    "/lib",
    "/lib64",
    "/bin",
    "/etc",
    "/sys/devices/system/cpu",
    "/proc/cpuinfo",
    "/proc/meminfo",
    "/dev/urandom",
)
SYSTEM_WRITABLE: Final = ("/dev/null",)


def python_folders() -> list[Path]:
    """What an interpreter with our packages has to read: installation, environment and the package `rig`, not its neighbours."""
    import rig

    paths = [sys.prefix, sys.base_prefix, sysconfig.get_path("stdlib"), sysconfig.get_path("platstdlib")]
    return [Path(path).resolve() for path in paths] + [Path(rig.__file__).resolve().parent]


def compile_caches() -> list[Path]:
    """Folders in which the compiler keeps machine code beside our sources; made if they can be."""
    import rig

    root = Path(rig.__file__).resolve().parent
    caches = [
        folder / "__pycache__" for folder in (root, *(p for p in root.rglob("*") if p.is_dir() and p.name != "__pycache__"))
    ]
    if os.access(root, os.W_OK):
        for cache in caches:
            cache.mkdir(exist_ok=True)
    return [cache for cache in caches if cache.is_dir()]


def enter(readable: Sequence[Path], writable: Sequence[Path]) -> list[str]:
    """Shut this process in; returns the layers that stand, "landlock" and "audit" or "audit" alone."""
    readable = [*readable, *python_folders(), *(Path(path) for path in SYSTEM_FOLDERS)]
    writable = [*writable, *compile_caches(), *(Path(path) for path in SYSTEM_WRITABLE)]
    layers = ["landlock"] if _landlock(readable, writable) else []
    _watch(readable, writable)
    return [*layers, "audit"]


def _landlock(readable: Sequence[Path], writable: Sequence[Path]) -> bool:
    """Restrict this process by the kernel; False where it cannot."""
    libc = ctypes.CDLL(None, use_errno=True)
    version = libc.syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), _ASK_VERSION) if sys.platform == "linux" else -1
    if version < 1:
        return False
    rights = sum(bits for since, bits in _RIGHTS_SINCE.items() if version >= since)
    attributes = struct.pack("=QQQ", rights, _NETWORK if version >= 4 else 0, _SCOPES if version >= 6 else 0)
    size = 24 if version >= 6 else 16 if version >= 4 else 8
    rules = libc.syscall(_CREATE_RULESET, attributes, ctypes.c_size_t(size), 0)
    if rules < 0:
        return False
    for path in readable:
        _allow(libc, rules, path, _READ)
    for path in writable:
        _allow(libc, rules, path, rights)
    shut: bool = libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0) == 0 and libc.syscall(_RESTRICT_SELF, rules, 0) == 0
    os.close(rules)
    return shut


def _allow(libc: Any, rules: int, path: Path, rights: int) -> None:
    """Add one rule; a path that is not there needs none."""
    try:
        place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    allowed = rights if path.is_dir() else rights & _FILE_RIGHTS
    libc.syscall(_ADD_RULE, rules, _PATH_BENEATH, struct.pack("=Qi", allowed, place), 0)
    os.close(place)


def _watch(readable: Sequence[Path], writable: Sequence[Path]) -> None:
    """Refuse, from Python, files elsewhere, other programs, connections and the generators' package."""
    inside = tuple(os.path.realpath(path) for path in (*readable, *writable))

    def guard(event: str, arguments: tuple[Any, ...]) -> None:
        if event in ("open", "os.listdir", "os.scandir") and isinstance(arguments[0], str | bytes | os.PathLike):
            place = os.path.realpath(os.fsdecode(arguments[0]))
            if not any(place == root or place.startswith(root + os.sep) for root in inside):
                raise PermissionError(f"blind check: {place} is outside the question")
        elif event == "import" and arguments[0].split(".")[0] == "hil":
            raise PermissionError("blind check: the generators are not for the answering process")
        elif event in ("socket.connect", "subprocess.Popen", "os.exec", "os.posix_spawn", "os.system"):
            raise PermissionError(f"blind check: {event} is not for the answering process")

    sys.addaudithook(guard)
