"""The kernel's layer of system calls: no sockets, no signals, no other process's memory, no way back out of the other
layers.

A classic BPF program of three parts: another machine's calling convention is refused, then each listed number, and the
rest is allowed. Refused calls fail with EPERM. See seccomp(2).
"""

import ctypes
import errno
import platform
import struct
import sys
from typing import Final

_NO_NEW_PRIVILEGES: Final = 38
_MODE_FILTER, _ALL_THREADS = 1, 1
_LOAD, _EQUAL, _AT_LEAST, _RETURN = 0x20, 0x15, 0x35, 0x06
_ALLOW: Final = 0x7FFF0000
_REFUSE: Final = 0x00050000 | errno.EPERM
_OTHER_CONVENTION: Final = 0x40000000
"""First number of the second calling convention on x86-64 (x32)."""

_MACHINES: Final = {
    "x86_64": (0xC000003E, 317, {
        "socket": 41, "connect": 42, "sendto": 44, "sendmsg": 46, "bind": 49, "socketpair": 53, "kill": 62,
        "ptrace": 101,
        "rt_sigqueueinfo": 129, "pivot_root": 155, "chroot": 161, "mount": 165, "umount2": 166, "tkill": 200,
        "tgkill": 234, "add_key": 248,
        "request_key": 249, "keyctl": 250,
        "unshare": 272, "rt_tgsigqueueinfo": 297, "perf_event_open": 298, "open_by_handle_at": 304, "sendmmsg": 307,
        "setns": 308, "process_vm_readv": 310,
        "process_vm_writev": 311, "bpf": 321, "userfaultfd": 323,
    }),
    "aarch64": (0xC00000B7, 277, {
        "umount2": 39, "mount": 40, "pivot_root": 41, "chroot": 51, "unshare": 97, "ptrace": 117, "kill": 129,
        "tkill": 130, "tgkill": 131, "rt_sigqueueinfo": 138, "rt_tgsigqueueinfo": 240,
        "socket": 198, "socketpair": 199, "bind": 200, "connect": 203, "sendto": 206, "sendmsg": 211, "add_key": 217,
        "request_key": 218, "keyctl": 219, "perf_event_open": 241, "open_by_handle_at": 265, "setns": 268,
        "sendmmsg": 269, "process_vm_readv": 270,
        "process_vm_writev": 271, "bpf": 280, "userfaultfd": 282,
    }),
}  # fmt: skip
"""Machine -> (AUDIT_ARCH, number of seccomp, refused calls)."""
_EVERYWHERE: Final = {
    "pidfd_send_signal": 424, "io_uring_setup": 425, "open_tree": 428, "move_mount": 429, "fsopen": 430,
    "fsconfig": 431, "fsmount": 432, "fspick": 433, "pidfd_getfd": 438, "mount_setattr": 442,
}  # fmt: skip
"""Calls that have one number on all machines; io_uring would open sockets behind the filter's back."""


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("code", ctypes.c_char_p))


def enter() -> bool:
    """Refuse these calls to this process and all of its threads; False where it cannot be had."""
    machine = _MACHINES.get(platform.machine()) if sys.platform == "linux" else None
    if machine is None:
        return False
    architecture, seccomp, calls = machine
    code = program(architecture, sorted((calls | _EVERYWHERE).values()))
    libc = ctypes.CDLL(None, use_errno=True)
    filtered = _Program(len(code) // 8, code)
    if libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0) != 0:
        return False
    return int(libc.syscall(seccomp, _MODE_FILTER, _ALL_THREADS, ctypes.byref(filtered))) == 0


def program(architecture: int, refused: list[int]) -> bytes:
    """The filter as BPF: eight bytes an instruction."""
    steps = [(_LOAD, 0, 0, 4), (_EQUAL, 1, 0, architecture), (_RETURN, 0, 0, _REFUSE), (_LOAD, 0, 0, 0)]
    steps.append((_AT_LEAST, len(refused) + 1, 0, _OTHER_CONVENTION))
    for k, number in enumerate(refused):
        steps.append((_EQUAL, len(refused) - k, 0, number))
    steps += [(_RETURN, 0, 0, _ALLOW), (_RETURN, 0, 0, _REFUSE)]
    return b"".join(struct.pack("=HBBI", *step) for step in steps)
