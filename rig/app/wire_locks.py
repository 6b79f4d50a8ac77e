"""Who drives what a rig is wired to: one process at a time on this machine holds a Modbus module, a RIO session or a
serial port, whatever rig's YAML it came by.

The process that writes set-points holds a name for each of them in the kernel's table of Unix sockets (unix(7),
abstract), which goes with that process, however it ends, and which nobody can remove or replace, as a file that
carries a lock can be. Whoever makes safe needs none: that must succeed beside a process that holds it, and says so
then.
"""

import errno
import hashlib
import itertools
import math
import os
import signal
import socket
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from rig.errors import DeviceLost
from rig.service.processes import is_stopped

TABLE = "pamrigwire"
"""What the names begin with: of one table each wire is held once."""
_NAMES: Final = Path("/proc/net/unix")
_MOST_BYTES: Final = 260
"""Of a holder's command line; a person wants to know it again."""
_SAFE: Final = "safe by "
_WATCHER: Final = "watcher"
"""One that does nothing else, and may be ended."""
_ATTEMPTS: Final = itertools.count()
ATTEMPT_S: Final = 3.0
"""To connect, to write, and to look, a second each at most."""
GONE_S: Final = 1.0
"""For the kernel to end a killed process."""
_LOOK_S: Final = 0.01


def hold(wires: Sequence[str], holder: int | None = None) -> list[int]:
    """Take all the wires for as long as this process lives, or until the descriptors are closed; DeviceLost says who
    drives one of them. `holder`: the process to name to others, if it is not this one. Who writes the safe state just
    now is waited for, and ended if he was stopped in the middle of it."""
    taken: list[int] = []
    try:
        for wire in wires:
            taken.append(_take(wire))
            with suppress(OSError):  # a name for others to read, no more
                taken.append(_bind(f"{_name_of(wire)} {os.getpid() if holder is None else holder}"))
        for wire in wires:
            _await_safe(wire)
    except BaseException:
        _let_go(taken)
        raise
    return taken


@contextmanager
def held(wires: Sequence[str]) -> Iterator[None]:
    """The wires are this process's meanwhile."""
    taken = hold(wires)
    try:
        yield
    finally:
        _let_go(taken)


@contextmanager
def making_safe(wires: Sequence[str], commander: int, *, watcher: bool = True) -> Iterator[None]:
    """An attempt to make safe what a process of `commander` drove, which is lost. DeviceLost when one of the wires is
    driven by somebody else by now; nothing else is in the way of it. `watcher`: this process does nothing else."""
    announced: list[int] = []
    for wire in wires:
        with suppress(OSError):
            word = f"{_SAFE}{_WATCHER if watcher else 'commander'} {next(_ATTEMPTS)} "
            announced.append(_bind(f"{_name_of(wire)} {word}{os.getpid()}"))
    try:
        if driver := _somebody_else(wires, commander):
            raise DeviceLost(driver)
        yield
    finally:
        _let_go(announced)


def _somebody_else(wires: Sequence[str], commander: int) -> str:
    """Who drives one of them, in words; empty where that is the commander, or nobody says who it is."""
    with suppress(OSError, MemoryError):
        if taken := [_name_of(wire) for wire in wires if _is_held(_name_of(wire))]:
            names = _names()
            others = [pid for name in taken if (pid := _holder(name, names)) not in (None, commander)]
            return f"{wires[0]} is driven by {_introduced(others[0])}" if others else ""
    return ""


def _await_safe(wire: str) -> None:
    """Until nobody writes the safe state to a wire that has just been taken; DeviceLost when that comes to no end."""
    deadline, gone_by = time.monotonic() + ATTEMPT_S, math.inf
    while makers := _makers(wire):
        now = time.monotonic()
        for name, inode in makers.items():
            *_, kind, _, pid = name.split()
            if kind == _WATCHER and (is_stopped(int(pid)) or now > deadline):
                _end(int(pid), inode)
        if now > gone_by:
            raise DeviceLost(f"{wire}: is being made safe by {_introduced(int(pid))}; end that first")
        if now > deadline:  # counted from this look: who stood still meanwhile, with the machine, has ended nobody yet
            gone_by = min(gone_by, now + GONE_S)
        time.sleep(_LOOK_S)


def _makers(wire: str) -> dict[str, int]:
    """The announced attempts: name and inode of the socket."""
    beginning = f"{_name_of(wire)} {_SAFE}"
    found = {name: inode for name, inode in _names().items() if name.startswith(beginning)}
    return {name: inode for name, inode in found.items() if name.rpartition(" ")[2].isdecimal()}


def _end(pid: int, inode: int) -> None:
    """Kill the process that has announced itself: it is the one whose socket that is, and not a number that somebody
    else put into a name."""
    with suppress(OSError):
        process = os.pidfd_open(pid)
        try:
            if any(_leads_to(link) == f"socket:[{inode}]" for link in Path(f"/proc/{pid}/fd").iterdir()):
                signal.pidfd_send_signal(process, signal.SIGKILL)
        finally:
            os.close(process)


def _leads_to(link: Path) -> str:
    with suppress(OSError):  # closed meanwhile
        return os.readlink(link)
    return ""


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


def _is_held(name: str) -> bool:
    """Whether somebody has the name, without reading the whole table."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asking, suppress(ConnectionRefusedError):
        asking.connect(f"\0{name}")
        return True
    return False


def _names() -> dict[str, int]:
    """Every name of the table that is held now, with the inode of its socket; none where the kernel does not tell, for
    looking is never in the way of making safe."""
    found: dict[str, int] = {}
    with suppress(OSError):
        for line in _NAMES.read_text("utf-8", errors="replace").splitlines():
            about, _, name = line.partition(" @")
            if name.startswith(f"{TABLE}-"):
                found[name] = int(about.split()[-1])
    return found


def _holder(name: str, names: Mapping[str, int]) -> int | None:
    """The process that holds the wire of that name; None where it has not said so yet."""
    pids = (each.partition(f"{name} ")[2] for each in names)
    return next((int(pid) for pid in pids if pid.isascii() and pid.isdigit()), None)


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
