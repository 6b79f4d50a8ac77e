"""Which I/O process serves a wire: where its mailbox lies, whose it is, and whether it is believed.

The mailboxes lie in a folder where everybody can put a file. One is believed that is this user's own, root's, or of
somebody who may open the wire: he needs no forged mailbox to drive it.
"""

import contextlib
import hashlib
import os
import pwd
import stat
import tempfile
from pathlib import Path
from typing import Final

from drivers.io_process.mailbox import IoMailbox, attach, is_held, remove
from rig.errors import DeviceLost

_ACCESS_LIST: Final = "system.posix_acl_access"


def path_for(resource: str) -> Path:
    """Where this user's mailbox of a wire lies: a file that a dead process of another user left is in nobody's way."""
    return folder() / f"pamrigio-{os.getuid()}-{_named(resource)}"


def remove_left() -> None:
    """Remove what I/O processes of this user, of whatever wire, left behind that were killed with their owners."""
    for path in folder().glob(f"pamrigio-{os.getuid()}-*"):
        remove(path)


def folder() -> Path:
    """Where the mailboxes of all users lie."""
    return Path("/dev/shm") if os.path.isdir("/dev/shm") else Path(tempfile.gettempdir())


def _named(resource: str) -> str:
    return hashlib.sha256(resource.encode()).hexdigest()[:16]


def find(resource: str) -> tuple[Path, IoMailbox] | None:
    """The mailbox of the living I/O process that serves a wire, whoever started it; None when there is none. DeviceLost
    when it takes no orders from us, because it is another user's."""
    own = path_for(resource)
    for path in sorted(folder().glob(f"pamrigio-*-{_named(resource)}"), key=lambda path: (path != own, path)):
        if not _is_believed(path, resource):
            continue
        try:
            mailbox = attach(path)
        except PermissionError:
            if _is_served(path):
                raise DeviceLost(
                    f"{resource}: served by an I/O process of {user_of(path)}, which takes no orders from "
                    f"{_user(os.getuid())}: ask that user's pamrig (`pamrig estop`), or call this as root"
                ) from None
            continue
        if mailbox is not None:
            return path, mailbox
    return None


def user_of(path: Path) -> str:
    """Whose a file is, in words."""
    try:
        return _user(path.stat().st_uid)
    except OSError:
        return "another user"


def _user(uid: int) -> str:
    with contextlib.suppress(KeyError):
        return f"user {pwd.getpwuid(uid).pw_name}"
    return f"user {uid}"


def _is_believed(path: Path, resource: str) -> bool:
    try:
        uid = os.lstat(path).st_uid
    except OSError:
        return False
    return uid in (0, os.getuid()) or _may_open(uid, resource)


def _may_open(uid: int, resource: str) -> bool:
    """Whether a user may read and write the file that a wire is, by its mode; what is no file, such as a host, is open
    to everybody. A list of access beside the mode is taken for a yes: not every user on it is worth looking up."""
    try:
        found = os.stat(resource)
        listed = _ACCESS_LIST in os.listxattr(resource)
    except OSError:
        return True
    mode, both = found.st_mode, 0o6
    if listed:
        return True
    if uid == found.st_uid:
        return stat.S_IMODE(mode) >> 6 & both == both
    if found.st_gid in _groups_of(uid):
        return stat.S_IMODE(mode) >> 3 & both == both
    return stat.S_IMODE(mode) & both == both


def _groups_of(uid: int) -> list[int]:
    with contextlib.suppress(KeyError):
        user = pwd.getpwuid(uid)
        return os.getgrouplist(user.pw_name, user.pw_gid)
    return []


def _is_served(path: Path) -> bool:
    """Whether somebody lives behind another user's mailbox, which may be looked at."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        return is_held(descriptor)
    finally:
        os.close(descriptor)
