"""Who drives what a rig is wired to: one process at a time on this machine holds a Modbus module, a RIO session or a
serial port, whatever rig's YAML it came by.

The process that writes set-points holds a name for each of them in the kernel's table of Unix sockets (unix(7),
abstract), which goes with that process, however it ends, and which nobody can remove or replace, as a file that
carries a lock can be. Whoever makes safe needs none: that must succeed beside a process that holds it, and says so
then.
"""

import errno
import hashlib
import os
import socket
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from rig.errors import DeviceLost

TABLE = "pamrigwire"
"""What the names begin with: of one table each wire is held once."""
_NAMES: Final = Path("/proc/net/unix")
_MOST_BYTES: Final = 260
"""Of a holder's command line; a person wants to know it again."""


def hold(wires: Iterable[str], holder: int | None = None) -> list[int]:
    """Take all the wires for as long as this process lives, or until the descriptors are closed; DeviceLost says who
    drives one of them. `holder`: the process to name to others, if it is not this one."""
    taken: list[int] = []
    try:
        for wire in wires:
            taken.append(_take(wire))
            with suppress(OSError):  # a name for others to read, no more
                taken.append(_bind(f"{_name_of(wire)} {os.getpid() if holder is None else holder}"))
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


def who_drives(wires: Iterable[str], but: int | None = None) -> str:
    """Who drives one of the wires now, in words; empty when nobody does. `but`: a process that is not meant. Looking
    takes nothing from anybody."""
    names = _names()
    for wire in wires:
        name = _name_of(wire)
        if name in names and ((holder := _holder(name, names)) is None or holder != but):
            return f"{wire} is driven by {_introduced(holder)}"
    return ""


def _take(wire: str) -> int:
    try:
        return _bind(_name_of(wire))
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            who = _introduced(_holder(_name_of(wire), _names()))
            raise DeviceLost(f"{wire}: driven by {who}; end that first") from None
        raise DeviceLost(f"{wire}: cannot be held for this process alone: {error.strerror}") from None


def _name_of(wire: str) -> str:
    return f"{TABLE}-{hashlib.sha256(wire.encode()).hexdigest()[:16]}"


def _bind(name: str) -> int:
    """A descriptor that holds the name; OSError, EADDRINUSE, when somebody has it."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as bound:
        bound.bind(f"\0{name}")
        return bound.detach()


def _names() -> set[str]:
    """Every name of the table that is held now; none where the kernel does not tell, for looking is never in the way of
    making safe."""
    with suppress(OSError):
        found = (line.partition(" @")[2] for line in _NAMES.read_text("utf-8", errors="replace").splitlines())
        return {name for name in found if name.startswith(f"{TABLE}-")}
    return set()


def _holder(name: str, names: Iterable[str]) -> int | None:
    """The process that holds the wire of that name; None where it has not said so yet."""
    said = (each.partition(f"{name} ")[2] for each in names)
    return next((int(pid) for pid in said if pid.isascii() and pid.isdigit()), None)


def _introduced(pid: int | None) -> str:
    """What a process is, in one line of printable characters."""
    if pid is None:
        return "another process"
    try:
        command = Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").strip()[:_MOST_BYTES]
    except OSError:
        return f"process {pid}"
    plain = "".join(one if one.isprintable() else "?" for one in command.decode("utf-8", "replace"))
    return f"process {pid} ({plain})"
