"""Whose a TCP connection from this machine is, as the kernel knows it: what SO_PEERCRED is for a Unix socket.

Asked by netlink (sock_diag(7)), one question a connection however many there are; from the table in /proc where that is
not to be had.
"""

import contextlib
import grp
import os
import pwd
import socket
import struct
from pathlib import Path
from typing import Any, Final

Address = tuple[Any, ...]

_NETLINK_SOCK_DIAG: Final = 4
_SOCK_DIAG_BY_FAMILY: Final = 20
_REQUEST: Final = 1
_HEAD: Final = struct.Struct("=IHHII")  # struct nlmsghdr: length, type, flags, sequence, pid
_QUESTION: Final = struct.Struct("=BBBBI")  # struct inet_diag_req_v2 before its id: family, protocol, ext, pad, states
_ID: Final = struct.Struct("!HH16s16s12s")  # struct inet_diag_sockid: ports, addresses; interface and no cookie
_ANY_INTERFACE: Final = b"\0\0\0\0" + b"\xff" * 8
_UID_AT: Final = _HEAD.size + 4 + _ID.size + 12
_PATIENCE_S: Final = 0.2


def owner_of(peer: Address, here: Address) -> int | None:
    """User whose socket `peer` is, connected to `here`; None when it is not of this machine."""
    try:
        return _asked(peer, here)
    except OSError:
        return listed(peer, here)


def _asked(peer: Address, here: Address) -> int | None:
    """OSError where the kernel does not answer such questions."""
    family = _family(peer)
    ident = _ID.pack(int(peer[1]), int(here[1]), _packed(peer), _packed(here), _ANY_INTERFACE)
    question = _QUESTION.pack(family, socket.IPPROTO_TCP, 0, 0, 0xFFFFFFFF) + ident
    head = _HEAD.pack(_HEAD.size + len(question), _SOCK_DIAG_BY_FAMILY, _REQUEST, 0, 0)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, _NETLINK_SOCK_DIAG) as kernel:
        kernel.settimeout(_PATIENCE_S)
        kernel.sendto(head + question, (0, 0))
        answer = kernel.recv(4096)
    if len(answer) < _UID_AT + 4 or _HEAD.unpack_from(answer)[1] != _SOCK_DIAG_BY_FAMILY:
        return listed(peer, here)  # no such socket, or a kernel that cannot look up a single one
    return int(struct.unpack_from("=I", answer, _UID_AT)[0])


def listed(peer: Address, here: Address, table: Path | None = None) -> int | None:
    """The same from the kernel's table (proc(5), /proc/net/tcp)."""
    wanted = f" {_in_table(peer)} {_in_table(here)} ".encode()
    path = table or Path("/proc/net/tcp6" if _family(peer) == socket.AF_INET6 else "/proc/net/tcp")
    with contextlib.suppress(OSError):
        text = path.read_bytes()
        found = text.find(wanted)
        if found >= 0:
            return int(text[found:].split(maxsplit=8)[6])
    return None


def may_come(uid: int | None, group: str) -> bool:
    """The same rule as at the daemon's socket: its own user, root, and the members of its group."""
    if uid is None:
        return False
    if uid in (0, os.getuid()):
        return True
    with contextlib.suppress(KeyError):
        user = pwd.getpwuid(uid)
        return bool(group) and grp.getgrnam(group).gr_gid in os.getgrouplist(user.pw_name, user.pw_gid)
    return False


def _family(address: Address) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in str(address[0]) else socket.AF_INET


def _packed(address: Address) -> bytes:
    """In network order, 16 bytes long."""
    return socket.inet_pton(_family(address), str(address[0]).partition("%")[0]).ljust(16, b"\0")


def _in_table(address: Address) -> str:
    """An address as the table has it: words of the machine's byte order in hexadecimal, then the port."""
    packed = socket.inet_pton(_family(address), str(address[0]).partition("%")[0])
    words = [packed[at : at + 4][::-1].hex().upper() for at in range(0, len(packed), 4)]
    return f"{''.join(words)}:{int(address[1]):04X}"
