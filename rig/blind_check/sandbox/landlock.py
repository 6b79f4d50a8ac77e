"""The kernel's layer of files: whatever code runs, it reads and writes at the given places only. See landlock(7)."""

import ctypes
import os
import struct
import sys
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


def enter(readable: Sequence[Path], writable: Sequence[Path]) -> bool:
    """Restrict this process; False where the kernel has no Landlock."""
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
