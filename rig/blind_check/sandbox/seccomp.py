"""The kernel's layer of system calls: no sockets, no signals, no other process's memory, no way back out of the other
layers, nothing kept for who answers the next question, and nobody else's limits, place in the scheduler or terminal.

A classic BPF program of four parts: another machine's calling convention is refused, then what is refused by an
argument, then each listed number, and the rest is allowed. Refused calls fail with EPERM. See seccomp(2).
"""

import ctypes
import errno
import platform
import struct
import sys
from collections.abc import Sequence
from typing import Final

_NO_NEW_PRIVILEGES: Final = 38
_MODE_FILTER, _ALL_THREADS = 1, 1
_LOAD, _EQUAL, _AT_LEAST, _RETURN = 0x20, 0x15, 0x35, 0x06
_ALLOW: Final = 0x7FFF0000
_REFUSE: Final = 0x00050000 | errno.EPERM
_ARGUMENTS: Final = 16
"""Where they begin in what the filter sees (struct seccomp_data), eight bytes each."""
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
        "shmget": 29, "shmat": 30, "shmctl": 31, "semget": 64, "semop": 65, "semctl": 66, "msgget": 68, "msgsnd": 69,
        "msgrcv": 70, "msgctl": 71, "semtimedop": 220, "mq_open": 240, "mq_unlink": 241,
        "chmod": 90, "fchmod": 91, "chown": 92, "fchown": 93, "lchown": 94, "utime": 132, "setxattr": 188,
        "lsetxattr": 189, "fsetxattr": 190, "removexattr": 197, "lremovexattr": 198, "fremovexattr": 199,
        "utimes": 235, "fchownat": 260, "futimesat": 261, "fchmodat": 268, "utimensat": 280,
        "setpriority": 141, "sched_setparam": 142, "sched_setscheduler": 144, "ioprio_set": 251,
        "sched_setattr": 314,
    }, {"ioctl": 16, "sched_setaffinity": 203, "prlimit64": 302}),
    "aarch64": (0xC00000B7, 277, {
        "umount2": 39, "mount": 40, "pivot_root": 41, "chroot": 51, "unshare": 97, "ptrace": 117, "kill": 129,
        "tkill": 130, "tgkill": 131, "rt_sigqueueinfo": 138, "rt_tgsigqueueinfo": 240,
        "socket": 198, "socketpair": 199, "bind": 200, "connect": 203, "sendto": 206, "sendmsg": 211, "add_key": 217,
        "request_key": 218, "keyctl": 219, "perf_event_open": 241, "open_by_handle_at": 265, "setns": 268,
        "sendmmsg": 269, "process_vm_readv": 270,
        "process_vm_writev": 271, "bpf": 280, "userfaultfd": 282,
        "mq_open": 180, "mq_unlink": 181, "msgget": 186, "msgctl": 187, "msgrcv": 188, "msgsnd": 189, "semget": 190,
        "semctl": 191, "semtimedop": 192, "semop": 193, "shmget": 194, "shmctl": 195, "shmat": 196,
        "setxattr": 5, "lsetxattr": 6, "fsetxattr": 7, "removexattr": 14, "lremovexattr": 15, "fremovexattr": 16,
        "fchmod": 52, "fchmodat": 53, "fchownat": 54, "fchown": 55, "utimensat": 88,
        "ioprio_set": 30, "sched_setparam": 118, "sched_setscheduler": 119, "setpriority": 140, "sched_setattr": 274,
    }, {"ioctl": 29, "sched_setaffinity": 122, "prlimit64": 261}),
}  # fmt: skip
"""Machine -> (AUDIT_ARCH, number of seccomp, refused calls, calls of `_BY_ARGUMENT`). Messages, modes, times and
attributes outlive the process, and the next one that answers could read them."""
_BY_ARGUMENT: Final = (
    ("prlimit64", 0, 0, False),  # a process that is not this one: a limit of processor time ends it
    ("sched_setaffinity", 0, 0, False),
    ("ioctl", 1, 0x5412, True),  # TIOCSTI and TIOCLINUX: keys that nobody pressed, at the terminal of who scores
    ("ioctl", 1, 0x541C, True),
)
"""Call, its argument's place, a value, and whether it is refused when the argument is that, or when it is not."""
_EVERYWHERE: Final = {
    "pidfd_send_signal": 424, "io_uring_setup": 425, "open_tree": 428, "move_mount": 429, "fsopen": 430,
    "fsconfig": 431, "fsmount": 432, "fspick": 433, "pidfd_getfd": 438, "mount_setattr": 442, "fchmodat2": 452,
    "setxattrat": 463, "removexattrat": 466,
}  # fmt: skip
"""Calls that have one number on all machines; io_uring would open sockets behind the filter's back."""


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("code", ctypes.c_char_p))


def enter() -> bool:
    """Refuse these calls to this process and all of its threads; False where it cannot be had."""
    machine = _MACHINES.get(platform.machine()) if sys.platform == "linux" else None
    if machine is None:
        return False
    architecture, seccomp, calls, looked_at = machine
    rules = [(looked_at[name], place, value, refuse) for name, place, value, refuse in _BY_ARGUMENT]
    code = program(architecture, sorted((calls | _EVERYWHERE).values()), rules)
    libc = ctypes.CDLL(None, use_errno=True)
    filtered = _Program(len(code) // 8, code)
    if libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0) != 0:
        return False
    return int(libc.syscall(seccomp, _MODE_FILTER, _ALL_THREADS, ctypes.byref(filtered))) == 0


def program(architecture: int, refused: list[int], rules: Sequence[tuple[int, int, int, bool]] = ()) -> bytes:
    """The filter as BPF: eight bytes an instruction. `rules`: number of a call, place of its argument, value, and
    whether it is refused at that value or at every other; the machines are little-endian, and the lower half is
    looked at."""
    steps = [(_LOAD, 0, 0, 4), (_EQUAL, 1, 0, architecture), (_RETURN, 0, 0, _REFUSE), (_LOAD, 0, 0, 0)]
    steps += [(_AT_LEAST, 0, 1, _OTHER_CONVENTION), (_RETURN, 0, 0, _REFUSE)]
    for number, place, value, refuse in rules:
        steps += [(_EQUAL, 0, 4, number), (_LOAD, 0, 0, _ARGUMENTS + 8 * place)]
        steps += [(_EQUAL, not refuse, refuse, value), (_RETURN, 0, 0, _REFUSE), (_LOAD, 0, 0, 0)]
    for k, number in enumerate(refused):
        steps.append((_EQUAL, len(refused) - k, 0, number))
    steps += [(_RETURN, 0, 0, _ALLOW), (_RETURN, 0, 0, _REFUSE)]
    return b"".join(struct.pack("=HBBI", *step) for step in steps)
