"""Where socket and locks lie, and whether what is found there may be trusted. Folders like /tmp belong to everybody on
the machine.

Nothing here blocks or follows a link: who may write to the folder could have put a pipe, a link or a process of his own
there.
"""

import contextlib
import errno
import fcntl
import logging
import os
import pwd
import socket
import stat
import struct
import tempfile
from pathlib import Path
from typing import Final

from rig.errors import StateError

SERVICE_SOCKET: Final = Path("/run/pamrig/pamrig.sock")
"""Of the daemon that the system starts."""
_CREDENTIALS: Final = struct.Struct("3i")  # struct ucred: pid, uid, gid (unix(7))
_OTHERS_WRITE: Final = stat.S_IWGRP | stat.S_IWOTH
OWN_MODE: Final = 0o755
"""At most, of a folder that holds what a daemon goes by: socket, locks, queue, ledger."""
_LOG: Final = logging.getLogger("pamrig")


def default_socket() -> Path:
    """Where the daemon listens: $PAMRIG_SOCKET, the service's folder under /run, the user's runtime folder, or one in
    /tmp."""
    if named := os.environ.get("PAMRIG_SOCKET"):
        return Path(named)
    if SERVICE_SOCKET.exists() or os.access(SERVICE_SOCKET.parent, os.W_OK):
        return SERVICE_SOCKET
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return (Path(runtime) if runtime else own_folder()) / "pamrig.sock"


def own_folder() -> Path:
    """The user's folder where the system gives him none, in /tmp; `check_folder` says whether it is his indeed."""
    return Path(tempfile.gettempdir()) / f"pamrig-{os.getuid()}"


def keep_others_out() -> None:
    """Nothing that this process makes from now on is anybody's to write to, whatever umask it was started with: cron
    jobs, containers and scripts have 000, and records are not to be deleted by everybody. The group may be meant."""
    os.umask(os.umask(0o022) | stat.S_IWOTH)


def user_name(uid: int) -> str:
    """What a person calls the user; the number where nobody has given it a name."""
    try:
        return f"{pwd.getpwuid(uid).pw_name} ({uid})"
    except KeyError:
        return str(uid)


def owned_by(path: Path) -> str:
    """For the end of a message on what was refused: whose it is, or the nearest folder on the way that can be seen;
    empty when it is one's own."""
    for place in (path, *path.parents):
        with contextlib.suppress(OSError):
            uid = os.stat(place).st_uid
            return f"; {place} is of user {user_name(uid)}" if uid != os.geteuid() else ""
    return ""


def check_folder(folder: Path, *, make: bool = False) -> None:
    """StateError when `folder` is `own_folder` and not a folder of this user alone. With `make`, a missing one is made
    (mode 700)."""
    if folder != own_folder():
        return
    if make:
        try:
            folder.mkdir(mode=0o700)
        except FileExistsError:
            pass
        except OSError as error:
            raise StateError(f"{folder}: cannot be made: {error.strerror}") from None
    try:
        found = os.lstat(folder)
    except FileNotFoundError:
        return  # then there is no socket either
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        found_as = f"mode {stat.S_IMODE(found.st_mode):o}, of user {user_name(found.st_uid)}"
        raise StateError(
            f"{folder}: is not a folder of yours alone ({found_as}): somebody else made it; set PAMRIG_SOCKET"
        )


def keep_others_from(folder: Path, holds: str, *, among_others: bool = False) -> None:
    """StateError for a folder that another user, or others beside this one, may write to: it `holds` what a daemon goes
    by. One of one's own is made `OWN_MODE` at most, which the log says.

    `among_others`: one such as /tmp will do, where everybody may put something and nobody remove another's.
    """
    found = os.stat(folder)
    mode, where = stat.S_IMODE(found.st_mode), f"{folder}: is to hold {holds}, and"
    if among_others and mode & stat.S_ISVTX:
        return
    if found.st_uid != os.geteuid():
        raise StateError(f"{where} is of user {user_name(found.st_uid)}; give a folder of your own")
    if not mode & _OTHERS_WRITE:
        return
    if mode & stat.S_ISVTX or (theirs := _of_others(folder)):
        what = "is meant for everybody" if mode & stat.S_ISVTX else f"others have put something there ({theirs})"
        raise StateError(f"{where} {what} (mode {mode:o}); give a folder of your own")
    tight = mode & ~_OTHERS_WRITE
    with contextlib.suppress(OSError):  # not every file system has modes
        folder.chmod(tight)
    if stat.S_IMODE(os.stat(folder).st_mode) & _OTHERS_WRITE:
        raise StateError(f"{where} others may write there (mode {mode:o}), which cannot be changed; give another")
    _LOG.warning("%s others could write there (mode %o): only you may now (mode %o)", where, mode, tight)


def _of_others(folder: Path) -> str:
    """Something in it that is neither this user's nor root's; empty for nothing."""
    with os.scandir(folder) as entries:
        for entry in entries:
            uid = entry.stat(follow_symlinks=False).st_uid
            if uid not in (0, os.geteuid()):
                return f"{entry.name}, of user {user_name(uid)}"
    return ""


def remove_stale_socket(path: Path) -> None:
    """Remove a stale socket (or an empty file) at `path`; StateError for anything else: it is not ours to remove, and
    least of all the socket of somebody who still listens there."""
    try:
        found = os.lstat(path)
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(found.st_mode) and not (stat.S_ISREG(found.st_mode) and found.st_size == 0):
        raise StateError(f"{path}: is there already and is no socket; give another place with --socket")
    if stat.S_ISSOCK(found.st_mode) and _somebody_listens(path):
        raise StateError(f"{path}: another daemon is running, though its lock file is gone; see `pamrig status`")
    path.unlink(missing_ok=True)


def _somebody_listens(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as probe:
        probe.setblocking(False)
        try:
            probe.connect(str(path))
        except OSError as error:
            return error.errno == errno.EAGAIN  # so many wait there that there is no room
        return True


def take_lock(path: Path, taken: str) -> int:
    """The lock file at `path`, made where it is missing; returns its descriptor. StateError, with the words `taken`,
    when it is held."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o600)
    except OSError as error:
        why = "it is a symbolic link" if error.errno == errno.ELOOP else error.strerror
        raise StateError(f"{path}: cannot be made: {why}{owned_by(path)}") from None
    try:
        _check_lock(path, os.fstat(descriptor))
        _lock(descriptor, taken)
    except (OSError, StateError):
        os.close(descriptor)
        raise
    return descriptor


def lock_folder(folder: Path, taken: str) -> int | None:
    """The same for a folder as such, which nobody can delete as long as something lies in it, unlike a lock file; None
    where its file system has no locks for folders."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        _lock(descriptor, taken)
    except StateError:
        os.close(descriptor)
        raise
    except OSError:
        os.close(descriptor)
        return None
    return descriptor


def _lock(descriptor: int, taken: str) -> None:
    """StateError, with the words `taken`, when somebody else holds it; OSError where there are no such locks."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise StateError(taken) from None


def _check_lock(path: Path, found: os.stat_result) -> None:
    if not stat.S_ISREG(found.st_mode):
        raise StateError(f"{path}: is no regular file, as a lock is")
    if found.st_uid != os.geteuid() and found.st_uid != _owner(path.parent):
        raise StateError(f"{path}: belongs to user {user_name(found.st_uid)}, not to you")


def _owner(folder: Path) -> int | None:
    """User whose folder it is; None where others may write too."""
    found = os.stat(folder)
    return None if found.st_mode & _OTHERS_WRITE else found.st_uid


def peer_uid(connection: socket.socket) -> int:
    """User of the process at the other end of a Unix socket, as the kernel knows it (SO_PEERCRED)."""
    credentials = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    return int(_CREDENTIALS.unpack(credentials)[1])


def check_daemon(path: Path, connection: socket.socket) -> None:
    """StateError when who listens at `path` is neither this user, root, nor the one whose folder it is: its "ok" would
    mean nothing."""
    uid = peer_uid(connection)
    if uid not in (0, os.getuid(), _owner(path.parent)):
        raise StateError(
            f"{path}: who listens there is user {user_name(uid)}, neither you nor root: not a daemon to rely on"
        )


def may_command(connection: socket.socket, group: str) -> bool:
    """A client may command: this user's, root's, or one whom the permissions for `group` have let in."""
    return bool(group) or peer_uid(connection) in (0, os.getuid())
