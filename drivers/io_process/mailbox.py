"""The mailbox between a device and its I/O process: one small file in shared memory, and the two notes that lie in it.

The owner (the loop) leaves an `OwnerOrder`, the I/O process leaves a `Report`; each note is published whole, the newest
replaces the one before, and neither side ever waits for the other. A third process (the supervisor) may raise the
alarm. Nothing here knows a wire or a device. Linux: the file lies in /dev/shm and lives as long as somebody holds its
lock.

A mailbox takes orders from its own user and from root. Every other user sees that somebody serves the wire, and who
(lookup.py).
"""

import contextlib
import fcntl
import mmap
import os
import stat
import struct
import time
import zlib
from collections.abc import Iterator
from enum import IntEnum
from pathlib import Path
from typing import Final, NamedTuple

from rig.errors import DeviceLost

MAILBOX_OUTPUTS: Final = 4
"""Places for set-points in a message; a rig drives two."""
MAX_VALUES: Final = 8
"""Places for readings in a message."""
_TEXT_BYTES: Final = 480
_START_NS: Final = 2_000_000_000
"""What the start of a process takes at most on a busy machine."""
_MAGIC: Final = b"PAMRIO03"


class OutputsMode(IntEnum):
    """What the owner wants of the outputs."""

    NONE = 0
    """Nothing was ordered yet: the outputs stay as they are."""
    DRIVE = 1
    """Write these outputs; if the owner falls silent, the safe ones."""
    SAFE = 2
    """Write these outputs, which are the safe ones; the owner may then go."""
    RELEASED = 3
    """The owner let go on purpose: outputs stay as they are."""


class LinkState(IntEnum):
    """How the I/O process stands with its device."""

    STARTING = 0
    UP = 1
    DOWN = 2
    """Lost after it was up; the I/O process tries again by itself."""
    REFUSED = 3
    """It never came up; the I/O process has ended."""
    ENDED = 4
    TRIPPED = 5
    """Refused to somebody who only looks: the device's own watchdog has most likely acted."""


class Trip(IntEnum):
    """Why the I/O process took the outputs to the safe values by itself; latched until it is started anew."""

    NONE = 0
    SILENCE = 1
    ORPHANED = 2
    OUTAGE = 3
    ALARM = 4


class OwnerOrder(NamedTuple):
    """From the owner: what to write, and when it last said so."""

    number: int = 0
    stamp_ns: int = 0
    mode: OutputsMode = OutputsMode.NONE
    outputs: tuple[float, ...] = ()


class Report(NamedTuple):
    """From the I/O process: what it did and what it measured. Values that were never measured have the stamp 0."""

    heartbeat_ns: int = 0
    state: LinkState = LinkState.STARTING
    trip: Trip = Trip.NONE
    order_done: int = 0
    """Number of the newest order that the device has confirmed."""
    alarm_done: int = 0
    """The alarm count that the device has confirmed with safe outputs."""
    sent_ns: int = 0
    exchanges: int = 0
    errors: int = 0
    reconnects: int = 0
    longest_ns: int = 0
    values: tuple[float, ...] = (0.0,) * MAX_VALUES
    stamps_ns: tuple[int, ...] = (0,) * MAX_VALUES
    holds_safe: bool = False
    """What the device has confirmed last are the safe outputs."""
    text: str = ""
    """Facts as `key=value` lines while the link is up, else the newest error."""


class _Note:
    """Two slots and a number: the writer fills the slot that is not current and then turns the number."""

    def __init__(self, view: memoryview, offset: int, layout: struct.Struct) -> None:
        self.view = view
        self.number = view[offset : offset + 8].cast("Q")
        self.layout = layout
        self.slots = offset + 8, offset + 8 + layout.size + 12

    def put(self, *fields: object) -> int:
        number = self.number[0] + 1
        at = self.slots[number & 1]
        self.layout.pack_into(self.view, at, *fields)
        check = zlib.crc32(self.view[at : at + self.layout.size], number & 0xFFFFFFFF)
        struct.pack_into("<QI", self.view, at + self.layout.size, number, check)
        self.number[0] = number
        return number

    def get(self) -> tuple[int, tuple[object, ...]] | None:
        """Number and fields; None when nothing was put yet, or when the writer overtook us eight times running."""
        for _ in range(8):
            number = self.number[0]
            at = self.slots[number & 1]
            data = bytes(self.view[at : at + self.layout.size + 12])
            found, check = struct.unpack_from("<QI", data, self.layout.size)
            if number and found == number and check == zlib.crc32(data[: self.layout.size], number & 0xFFFFFFFF):
                return number, self.layout.unpack_from(data)
        return None

    def release(self) -> None:
        self.number.release()


_ORDER = struct.Struct(f"<qBB{MAILBOX_OUTPUTS}d")
_REPORT = struct.Struct(f"<qBBQQqQQQq{MAX_VALUES}d{MAX_VALUES}q?H{_TEXT_BYTES}s")
_ORDER_AT: Final = 64
_REPORT_AT: Final = 512
_ALARM_AT: Final = 16
_SERVED_AT: Final = 24
_SIZE: Final = 4096
_LOOKED_AT_S: Final = 0.05
"""Who only asks whether somebody lives behind a mailbox, or removes it, has its lock so long at most, unless this
machine keeps him from his processor."""
_LOOK_S: Final = 0.001
_SEEN_BY_ALL: Final = 0o644
"""Who may not write may still see that the lock is held."""


class IoMailbox:
    """A mapped mailbox file. The lock on its file tells whether an I/O process lives behind it."""

    def __init__(self, descriptor: int) -> None:
        """Maps an open file. The mapping keeps a copy of the descriptor, and with it whatever lock that descriptor
        carries."""
        self._map = mmap.mmap(descriptor, _SIZE)
        self._uid = os.fstat(descriptor).st_uid
        self.view = memoryview(self._map)
        self._alarm = self.view[_ALARM_AT : _ALARM_AT + 8].cast("Q")
        self._served = self.view[_SERVED_AT : _SERVED_AT + 32].cast("Q")
        """Pid, after how long it is stuck, from when on that counts (ns), and whether it is the I/O process."""
        self.order_note = _Note(self.view, _ORDER_AT, _ORDER)
        self._report = _Note(self.view, _REPORT_AT, _REPORT)
        self._last_order, self._last_report = OwnerOrder(), Report()

    @property
    def valid(self) -> bool:
        """Whether this is a mailbox of this version at all."""
        return bytes(self.view[:8]) == _MAGIC

    def post_order(self, stamp_ns: int, mode: OutputsMode, outputs: tuple[float, ...]) -> int:
        """Replace the order; returns its number."""
        padded = (*outputs, *(0.0,) * (MAILBOX_OUTPUTS - len(outputs)))
        return self.order_note.put(stamp_ns, mode, len(outputs), *padded)

    def order(self) -> OwnerOrder:
        """The newest whole order."""
        if found := self.order_note.get():
            number, (stamp_ns, mode, count, *outputs) = found
            with contextlib.suppress(ValueError):  # a mode that no process of ours writes
                wanted = OutputsMode(_int(mode))
                self._last_order = OwnerOrder(number, _int(stamp_ns), wanted, tuple(outputs[: _int(count)]))  # type: ignore[arg-type]
        return self._last_order

    def post_report(self, report: Report) -> None:
        """Replace the report."""
        text = report.text.encode("utf-8", "replace")[:_TEXT_BYTES]
        self._report.put(*report[:10], *report.values, *report.stamps_ns, report.holds_safe, len(text), text)

    def report(self) -> Report:
        """The newest whole report."""
        if found := self._report.get():
            fields = found[1]
            head = [_int(field) for field in fields[:10]]
            values, stamps = fields[10 : 10 + MAX_VALUES], fields[10 + MAX_VALUES : 10 + 2 * MAX_VALUES]
            length, text = _int(fields[-2]), fields[-1]
            assert isinstance(text, bytes)
            trouble = text[:length].decode("utf-8", "replace")
            holds_safe = bool(fields[-3])
            with contextlib.suppress(ValueError):  # as above
                self._last_report = Report(
                    head[0], LinkState(head[1]), Trip(head[2]), *head[3:], values, stamps, holds_safe, trouble  # type: ignore[arg-type, call-arg]
                )  # fmt: skip
        return self._last_report

    def raise_alarm(self) -> int:
        """Ask for the safe outputs from outside; returns the count to wait for in `Report.alarm_done`."""
        self._alarm[0] += 1
        self._served[2] = time.monotonic_ns()
        return self._alarm[0]

    @property
    def alarm(self) -> int:
        """How often the alarm was raised."""
        return self._alarm[0]

    def served_by(self, pid: int, hang_ns: int) -> None:
        """Write down which process serves the wire, and after how long without a move it is stuck, for whoever comes
        later."""
        self._served[0], self._served[1], self._served[2], self._served[3] = pid, hang_ns, time.monotonic_ns(), 1

    @property
    def pid(self) -> int:
        """The I/O process; before there is one, the process that is about to start it."""
        return self._served[0]

    @contextlib.contextmanager
    def process(self) -> Iterator[int | None]:
        """A descriptor (pidfd_open(2)) of the process that is written down, as long as the block lasts; None when it
        has gone, or is not the mailbox's user's: a number that somebody forged is nobody to send signals to."""
        try:
            descriptor = os.pidfd_open(self.pid)
        except OSError:
            yield None
            return
        try:
            yield descriptor if _uid_of(self.pid) == self._uid else None
        finally:
            os.close(descriptor)

    @property
    def stuck(self) -> bool:
        """The I/O process has not moved for too long since it was started or told of an alarm."""
        _, hang_ns, since_ns, serves = self._served
        report = self.report()
        patience_ns = hang_ns + (_START_NS if report.state is LinkState.STARTING else 0)
        return bool(serves) and time.monotonic_ns() - max(report.heartbeat_ns, since_ns) > patience_ns

    @property
    def confirmed(self) -> bool:
        """The device has confirmed the safe outputs since they were asked for last, by an alarm or by the owner, and
        nothing else may follow."""
        order, report = self.order(), self.report()
        asked = report.trip is not Trip.NONE or (order.mode is OutputsMode.SAFE and report.order_done >= order.number)
        return report.holds_safe and asked and report.alarm_done >= self.alarm

    def close(self) -> None:
        """Unmap; the file stays."""
        for part in (self.order_note, self._report, self._alarm, self._served, self.view, self._map):
            part.close() if isinstance(part, mmap.mmap) else part.release()


def _uid_of(pid: int) -> int | None:
    """The user as whom a process acts; None when it has gone."""
    with contextlib.suppress(OSError):
        status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8", errors="replace")
        return int(status.partition("\nUid:")[2].split()[1])
    return None


def _int(value: object) -> int:
    assert isinstance(value, int)
    return value


def create(path: Path) -> int | None:
    """A fresh, locked mailbox file; returns its descriptor, which carries the lock to whoever inherits it. None: the
    wire is in use. DeviceLost when the file cannot be made."""
    deadline = time.monotonic() + _LOOKED_AT_S
    while True:
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, _SEEN_BY_ALL)
        except OSError as error:
            raise DeviceLost(f"{path}: the mailbox of an I/O process cannot be made: {error.strerror}") from None
        if os.fstat(descriptor).st_uid != os.geteuid():
            os.close(descriptor)
            raise DeviceLost(f"{path}: the mailbox of an I/O process cannot be made: another user's file is there")
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(descriptor)
            if time.monotonic() > deadline:
                return None
            time.sleep(_LOOK_S)
            continue
        if _is_at(descriptor, path):
            break
        os.close(descriptor)  # removed between open and lock
    try:
        os.fchmod(descriptor, _SEEN_BY_ALL)  # past the umask
        os.ftruncate(descriptor, 0)
        os.posix_fallocate(descriptor, 0, _SIZE)  # memory that is not there kills whoever writes to it
        os.pwrite(descriptor, struct.pack(f"<8s{_SERVED_AT - 8}xQ", _MAGIC, os.getpid()), 0)
    except OSError as error:
        path.unlink(missing_ok=True)
        os.close(descriptor)
        raise DeviceLost(f"{path}: the mailbox of an I/O process cannot be made: {error.strerror}") from None
    return descriptor


def mapped(path: Path) -> IoMailbox:
    """The mailbox at `path` by a descriptor of its own, which carries no lock: the owner's view of what its I/O process
    holds."""
    descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
    try:
        return IoMailbox(descriptor)
    finally:
        os.close(descriptor)


def attach(path: Path) -> IoMailbox | None:
    """The mailbox of a living I/O process; None when there is none. PermissionError for another user's."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
    except PermissionError:
        raise
    except OSError:  # none, or something that is no file
        return None
    try:
        if not is_held(descriptor) or os.fstat(descriptor).st_size != _SIZE:
            return None
        mailbox = IoMailbox(descriptor)
        return mailbox if mailbox.valid else None
    finally:
        os.close(descriptor)


def is_held(descriptor: int) -> bool:
    """Whether somebody lives behind an open mailbox file."""
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    return False


def remove_own(descriptor: int) -> None:
    """Delete the file whose lock `descriptor` carries: for an I/O process whose owner is no more."""
    path = Path(os.readlink(f"/proc/self/fd/{descriptor}"))
    if _is_at(descriptor, path):
        path.unlink()


def remove(path: Path) -> None:
    """Delete the file if it is a mailbox of this user's and nobody lives behind it."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return
    with contextlib.suppress(OSError):  # in use again, or gone: both are fine
        found = os.fstat(descriptor)
        if stat.S_ISREG(found.st_mode) and found.st_uid == os.geteuid():
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_at(descriptor, path):
                path.unlink()
    os.close(descriptor)


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.fstat(descriptor).st_ino == os.stat(path).st_ino
    except FileNotFoundError:
        return False
