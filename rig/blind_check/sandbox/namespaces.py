"""The kernel's layer of names: a file tree that holds the given places and nothing else, and a network without
interfaces.

What is not in the tree cannot be opened, listed, nor asked for its size and times. Needs user namespaces, which some
systems and most containers refuse; then there is no such layer. See user_namespaces(7), mount_namespaces(7),
pivot_root(2).
"""

import ctypes
import os
import stat
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

_NEW_MOUNTS, _NEW_IPC, _NEW_USER, _NEW_NETWORK = 0x00020000, 0x08000000, 0x10000000, 0x40000000
_BIND, _RECURSIVE, _PRIVATE = 4096, 16384, 1 << 18
_DETACH: Final = 2
_PIVOT_ROOT: Final = {"x86_64": 155, "aarch64": 41}
"""Machine -> number of the call; the C library has no name for it."""
_NEW_ROOT: Final = "/tmp"  # any folder that is there: the tree is laid over it, and seen by this process alone


def enter(readable: Sequence[Path], writable: Sequence[Path]) -> bool:
    """Leave this process with these places only, at their own names; False where the kernel does not allow it.

    OSError when it allows the half of it: half a tree is no place to work in.
    """
    if sys.platform != "linux" or os.uname().machine not in _PIVOT_ROOT:
        return False
    places, here = _names([*readable, *writable]), Path.cwd()
    libc = ctypes.CDLL(None, use_errno=True)
    if not _apart(libc, os.getuid(), os.getgid()):
        return False
    _move(libc, places)
    os.chdir(here if here.is_dir() else "/")
    return True


def _apart(libc: Any, user: int, group: int) -> bool:
    """Namespaces of our own, with ourselves in them; False when the system refuses them, or gives them without any
    rights."""
    if libc.unshare(_NEW_USER | _NEW_MOUNTS | _NEW_NETWORK | _NEW_IPC) != 0:
        return False
    try:
        _map_ids(user, group)
        _mount(libc, None, "/", None, _RECURSIVE | _PRIVATE)
    except OSError:
        return False
    return True


def _move(libc: Any, places: Sequence[Path]) -> None:
    """Put the places into a new tree and leave the old one. They are held before the new tree covers some of their
    names."""
    held = {path: os.open(path, os.O_PATH | os.O_CLOEXEC) for path in places if not path.is_symlink()}
    _mount(libc, "tmpfs", _NEW_ROOT, "tmpfs", 0)
    for path in places:
        _place(libc, path, held.get(path))
    for place in held.values():
        os.close(place)
    _call(libc.chdir(_NEW_ROOT.encode()), _NEW_ROOT)
    _call(libc.syscall(_PIVOT_ROOT[os.uname().machine], b".", b"."), "pivot_root")
    _call(libc.umount2(b".", _DETACH), "the old tree")


def _names(places: Sequence[Path]) -> list[Path]:
    """The places that are there by every name that leads to them, outer ones first and nothing inside of another."""
    names = {Path(os.path.abspath(path)) for path in places if path.exists()} | {
        path.resolve() for path in places if path.exists()
    }
    kept: list[Path] = []
    for path in sorted(names, key=lambda path: len(path.parts)):
        if not any(outer in path.parents and not outer.is_symlink() for outer in kept):
            kept.append(path)
    return kept


def _map_ids(user: int, group: int) -> None:
    Path("/proc/self/setgroups").write_text("deny")
    Path("/proc/self/uid_map").write_text(f"{user} {user} 1")
    Path("/proc/self/gid_map").write_text(f"{group} {group} 1")


def _place(libc: Any, path: Path, held: int | None) -> None:
    """The same name in the new tree: a link as a link, everything else as the thing itself."""
    target = Path(_NEW_ROOT + str(path))
    target.parent.mkdir(parents=True, exist_ok=True)
    if held is None:
        target.symlink_to(path.readlink())
        return
    if stat.S_ISDIR(os.fstat(held).st_mode):
        target.mkdir(exist_ok=True)
    else:
        target.touch()
    _mount(libc, f"/proc/self/fd/{held}", str(target), None, _BIND | _RECURSIVE)


def _mount(libc: Any, source: str | None, target: str, kind: str | None, flags: int) -> None:
    texts = [None if text is None else text.encode() for text in (source, target, kind)]
    _call(libc.mount(*texts, ctypes.c_ulong(flags), None), target)


def _call(outcome: int, what: str) -> None:
    if outcome != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"sandbox: {what}: {os.strerror(number)}")
