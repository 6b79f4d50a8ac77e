"""Who drives what a rig is wired to: one process at a time on this machine holds a Modbus module, a RIO session or a
serial port, whatever rig's YAML it came by.

The process that writes set-points holds a lock for each of them, which the kernel lets go when that process is gone,
however it ends. Whoever makes safe needs none: that must succeed beside a process that holds it, and says so then.
The lock files lie in /dev/shm, which a service with a temporary folder of its own shares with everybody else, and stay
there: a file that is removed is a lock that two can hold.

The other two locks here share only the call of the kernel with these, and nothing would be simpler for one function: a
mailbox (`drivers.io_process.mailbox`) is of one user, carried over to a child and removed with it; a daemon's
(`rig.service.door.places`) is of the owner of its folder, or the folder itself.
"""

import errno
import fcntl
import hashlib
import os
import stat
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from rig.errors import DeviceLost
from rig.realtime.shared import folder

_EVERYBODY: Final = 0o666
"""Other users of this machine hold the same wire's lock."""
_MOST_BYTES: Final = 300
"""Of a holder's name; what somebody else wrote there is not trusted further."""
_LOOKED_AT_S: Final = 0.1
_AGAIN_S: Final = 0.001
_FLAGS: Final = os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC


def hold(wires: Iterable[str], holder: int | None = None) -> list[int]:
    """Take all the wires for as long as this process lives, or until the descriptors are closed; DeviceLost says who
    drives one of them. `holder`: the process to name to others, if it is not this one."""
    taken: list[int] = []
    try:
        taken.extend(_take(wire, os.getpid() if holder is None else holder) for wire in wires)
    except BaseException:
        _let_go(taken)
        raise
    return taken


@contextmanager
def held(wires: Iterable[str]) -> Iterator[None]:
    """The wires are this process's meanwhile."""
    taken = hold(wires)
    try:
        yield
    finally:
        _let_go(taken)


def _let_go(taken: Iterable[int]) -> None:
    for descriptor in taken:
        os.close(descriptor)


def driver(wires: Iterable[str], but: int | None = None) -> str:
    """Who drives one of the wires now, in words; empty when nobody does. `but`: a process that is not meant."""
    for wire in wires:
        try:
            descriptor = os.open(_path(wire), _FLAGS)
        except OSError:
            continue
        try:
            fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = _holder(descriptor)
            if but is None or holder.partition(" (")[0] != f"process {but}":
                return f"{wire} is driven by {holder}"
        finally:
            os.close(descriptor)
    return ""


def _path(wire: str) -> Path:
    return folder() / f"pamrigwire-{hashlib.sha256(wire.encode()).hexdigest()[:16]}"


def _take(wire: str, holder: int) -> int:
    path = _path(wire)
    try:
        descriptor = _open(path)
    except OSError as error:
        raise DeviceLost(f"{wire}: its lock {path} cannot be opened: {error.strerror}") from None
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise DeviceLost(f"{wire}: its lock {path} is no regular file")
        _lock(descriptor)
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, _introduced(holder), 0)
    except BlockingIOError:
        words = f"{wire}: driven by {_holder(descriptor)}; end that first"
        os.close(descriptor)
        raise DeviceLost(words) from None
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def _lock(descriptor: int) -> None:
    """BlockingIOError when another process drives. Who only looks has the lock as well, for microseconds: he is waited
    for."""
    until = time.monotonic() + _LOOKED_AT_S
    while True:
        try:
            return fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > until:
                raise
        time.sleep(_AGAIN_S)


def _open(path: Path) -> int:
    """Made where it is missing. A file of another user in a sticky folder may not be opened as if to be made
    (fs.protected_regular)."""
    with suppress(FileNotFoundError):
        return os.open(path, _FLAGS)
    try:
        descriptor = os.open(path, _FLAGS | os.O_CREAT | os.O_EXCL, _EVERYBODY)
    except OSError as error:
        if error.errno != errno.EEXIST:
            raise
        return os.open(path, _FLAGS)  # made by another meanwhile
    os.fchmod(descriptor, _EVERYBODY)  # past the umask
    return descriptor


def _introduced(pid: int) -> bytes:
    with suppress(OSError):
        command = Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").strip()
        return f"process {pid} (".encode() + command[: _MOST_BYTES - 40] + b")"
    return f"process {pid}".encode()


def _holder(descriptor: int) -> str:
    said = os.pread(descriptor, _MOST_BYTES, 0).decode("utf-8", "replace")
    return "".join(character if character.isprintable() else "?" for character in said) or "another process"
