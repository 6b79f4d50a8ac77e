"""A named block of memory that several processes map: the floor under the ring, the mailbox and the programs.

Blocks are files in /dev/shm (or the temporary folder where there is none). Each begins with a magic, the pid of its
maker, the session's id and the version of its layout, so that neither a stale one nor one of another pamrig is taken
for one's own. Whoever owns one holds a lock on its file, which the kernel lets go when he dies: a pid may be another's
by then, or of another container. Words of 8 bytes are stored and loaded whole.
"""

import errno
import fcntl
import mmap
import os
import stat
import struct
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final, Self

from rig.errors import LayoutError, StateError

KEPT_RING: Final = "-daemon-ring"
"""How the names of rings end that are not to be swept away before their black box is saved."""

_MAGIC: Final = int.from_bytes(b"PAMRIG\x00\x01", "little")
HEADER_WORDS: Final = 8
"""64-bit words before what a block holds, of which six are used: one cache line."""
_MAGIC_WORD, _PID_WORD, _SESSION_WORD, _SIZE_WORD, _LAYOUT_WORD, _MADE_WORD = range(6)
LAYOUT: Final = 4
"""Version of what lies in all blocks, samples among it; 0: made before there was any. Raise it when
`tests/unit/realtime/test_layout.py` asks for it, or when a word means something else than before."""
_LOCKED_SINCE: Final = 3
"""Owners of before hold no lock that is asked for here."""
_YOUNG_NS: Final = 60_000_000_000
"""A block so young may be about to get its owner (`adopt`)."""
_LOCK: Final = struct.Struct("hhqqi4x")
"""`struct flock` of fcntl(2): kind, whence, start, length (0: to the end) and pid."""


def folder() -> Path:
    """Where blocks live."""
    shm = Path("/dev/shm")
    return shm if os.access(shm, os.W_OK) else Path(tempfile.gettempdir())


class SharedBlock:
    """`words` are the header and what follows as unsigned 64-bit words, `bytes` the whole block."""

    def __init__(self, path: Path, mapped: mmap.mmap) -> None:
        self.path = path
        self._mapped = mapped
        self.bytes = memoryview(mapped)
        self.words = self.bytes.cast("Q")

    @classmethod
    def create(cls, name: str, session: int, payload_bytes: int) -> Self:
        """A fresh block of zeros; StateError when the name is taken by a living process. A dead process's block is
        replaced."""
        path = folder() / f"pamrig-{name}"
        draft = path.with_name(
            f".{path.name}-{os.getpid()}"
        )  # gets its name when it is whole: nobody sees it without an owner
        draft.unlink(missing_ok=True)
        try:
            block = cls(path, _map_new(draft, HEADER_WORDS * 8 + (payload_bytes + 7) // 8 * 8))
            block.words[_PID_WORD] = os.getpid()
            block.words[_SESSION_WORD] = session
            block.words[_SIZE_WORD] = len(block.bytes)
            block.words[_LAYOUT_WORD] = LAYOUT
            block.words[_MADE_WORD] = time.monotonic_ns()
            block.words[_MAGIC_WORD] = _MAGIC
            _take_name(draft, path)
        except OSError as error:
            raise StateError(f"{path}: cannot be made: {error.strerror}") from None
        finally:
            draft.unlink(missing_ok=True)
        return block

    @classmethod
    def private(cls, payload_bytes: int) -> Self:
        """Zeros of this process alone, with the same layout, but without a name."""
        return cls(Path(), mmap.mmap(-1, HEADER_WORDS * 8 + (payload_bytes + 7) // 8 * 8))

    @classmethod
    def attach(cls, path: Path, session: int | None = None, *, own: bool = False) -> Self:
        """Map an existing block; StateError when it is missing, foreign, of another session, or (LayoutError) of
        another version. With `own` it is this process's as well, for as long as it is mapped."""
        try:
            descriptor = _open_own(path, os.O_RDWR)
        except OSError as error:
            raise StateError(f"{path}: no such shared memory ({error.strerror})") from None
        try:
            size = os.fstat(descriptor).st_size
            if size < HEADER_WORDS * 8:
                raise StateError(f"{path}: not a block of pamrig")
            if own:
                _hold(descriptor)
            block = cls(path, mmap.mmap(descriptor, size))
        finally:
            os.close(descriptor)
        if block.words[_MAGIC_WORD] != _MAGIC or block.words[_SIZE_WORD] != size:
            raise StateError(f"{path}: not a block of pamrig")
        if (layout := block.words[_LAYOUT_WORD]) != LAYOUT:
            raise LayoutError(
                f"{path}: made by another version of pamrig (layout {layout}, here {LAYOUT}), which alone can read it"
            )
        if session is not None and block.session != session:
            raise StateError(f"{path}: belongs to session {block.session:x}, not {session:x}: stale shared memory")
        return block

    @classmethod
    def adopt(cls, path: Path, session: int) -> Self:
        """Map a block that another process has made for this one, and be its owner from now on."""
        block = cls.attach(path, session, own=True)
        block.words[_PID_WORD] = os.getpid()
        return block

    @property
    def session(self) -> int:
        """Id of the session that made the block."""
        return self.words[_SESSION_WORD]

    def unlink(self) -> None:
        """Remove the name; processes that have it mapped keep it."""
        self.path.unlink(missing_ok=True)

    def close(self) -> None:
        """Unmap. Views handed out before become invalid."""
        self.words.release()
        self.bytes.release()
        self._mapped.close()


def _map_new(path: Path, size: int) -> mmap.mmap:
    """A new file of zeros, mapped. Its room is taken now: a full folder is an error here, not a SIGBUS at some later
    store. The mapping keeps a copy of the descriptor, and with it the lock."""
    descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600)
    try:
        _hold(descriptor)
        os.posix_fallocate(descriptor, 0, size)
        return mmap.mmap(descriptor, size)
    finally:
        os.close(descriptor)


def _take_name(draft: Path, path: Path) -> None:
    """Name the block, in place of a dead process's; StateError when a living one has the name."""
    try:
        os.link(draft, path)
    except FileExistsError:
        if owner := living_owner(path):
            raise StateError(f"{path}: in use by process {owner}") from None
        path.unlink(missing_ok=True)
        _take_name(draft, path)


def _open_own(path: Path, how: int) -> int:
    """Descriptor of a regular file of this user. The folder is everybody's: what lies there may be a pipe, a link or a
    trap.

    OSError, without ever waiting, when it is anything else.
    """
    descriptor = os.open(path, how | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC)
    found = os.fstat(descriptor)
    if stat.S_ISREG(found.st_mode) and found.st_uid == os.geteuid():
        return descriptor
    os.close(descriptor)
    raise OSError(errno.EPERM, f"is not a file of yours: mode {stat.filemode(found.st_mode)}, user {found.st_uid}")


def living_owner(path: Path) -> int:
    """Pid of the living process of this user that made the block at `path`; 0 when there is none."""
    return _living_owner(path) or 0


def _living_owner(path: Path) -> int | None:
    """None: what lies there is no block of this user, or one in the making, and not to be touched."""
    try:
        descriptor = _open_own(path, os.O_RDONLY)
    except OSError:
        return None
    try:
        header = os.read(descriptor, HEADER_WORDS * 8)
        held = _is_held(descriptor)
    finally:
        os.close(descriptor)
    words = memoryview(header).cast("Q") if len(header) == HEADER_WORDS * 8 else [0] * HEADER_WORDS
    pid = words[_PID_WORD]
    if held:
        return pid or None
    by_pid = words[_LAYOUT_WORD] < _LOCKED_SINCE or time.monotonic_ns() - words[_MADE_WORD] < _YOUNG_NS
    return pid if by_pid and pid and Path(f"/proc/{pid}").exists() else 0


def _hold(descriptor: int) -> None:
    """Be an owner of the file, beside others: until this descriptor and its copies are closed, a mapping's among
    them."""
    fcntl.fcntl(descriptor, fcntl.F_OFD_SETLK, _LOCK.pack(fcntl.F_RDLCK, os.SEEK_SET, 0, 0, 0))


def _is_held(descriptor: int) -> bool:
    """Somebody owns the file. Who asks takes no lock himself: two who ask at once would see each other."""
    found = fcntl.fcntl(descriptor, fcntl.F_OFD_GETLK, _LOCK.pack(fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0))
    return bool(_LOCK.unpack(found)[0] != fcntl.F_UNLCK)


def is_stale(path: Path) -> bool:
    """A file of this user whose maker is dead: what somebody else left in the folder is neither read nor removed."""
    return _living_owner(path) == 0


def sweep_stale(kept: str = "") -> list[Path]:
    """Remove this user's blocks of dead processes, but not those whose name ends with `kept`, and what of theirs never
    got its name; returns what was removed."""
    found = [path for path in folder().glob("pamrig-*") if not (kept and path.name.endswith(kept))]
    return [path for path in (*found, *_drafts()) if is_stale(path) and _removed(path)]


def _drafts() -> Iterator[Path]:
    """An empty one may have been made just now, and be locked in a moment."""
    for path in folder().glob(".pamrig-*"):
        with suppress(OSError):  # gone meanwhile
            if path.lstat().st_size:
                yield path


def _removed(path: Path) -> bool:
    try:
        path.unlink()
    except OSError:  # gone meanwhile, or another user's
        return False
    return True
