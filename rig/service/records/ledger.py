"""Which records this daemon made: a line each, kept in its state folder. Retention takes nothing that does not stand
here.

A record is known by its path and by its file's identity (device, inode, size, time of the last write), so that what
somebody renamed, replaced, wrote to, restored from a copy or reached through a link of his own is not ours any more.
A ledger that is broken is put aside: then nothing is ours.
"""

import json
import math
import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from rig.errors import RigError
from rig.service.records.durable_file import DurableFile

_ROUNDED_NS: Final = 2_000_000_000
"""FAT keeps the time of a write to 2 s, and forgets the rest once the file has left the cache."""
_NO_MORE: Final = frozenset({"boot", "up_s"})
"""Clocks that entries had once, beside the wall clock; nothing goes by them now."""


@dataclass(frozen=True)
class LedgerEntry:
    """One record that this daemon made."""

    path: str
    """As the daemon named it, with every link resolved."""
    device: int
    inode: int
    size: int
    recorded_s: float
    """Wall clock at its end, for a person; nothing goes by it, for it may have been wrong."""
    operating_s: float = 0.0
    """How long the daemon had run by then, over all its starts (operating_time.py); 0: before that was counted."""
    modified_ns: int = 0
    """The file's own time of its last write; 0: not known."""

    @property
    def session(self) -> str:
        """The folder of the sweep that it belongs to."""
        return os.path.dirname(self.path)

    @property
    def ours(self) -> bool:
        """The very file is still there, under the name that the daemon gave it."""
        with suppress(OSError):
            now = os.lstat(self.path)
            same = (now.st_dev, now.st_ino, now.st_size) == (self.device, self.inode, self.size)
            untouched = not self.modified_ns or abs(now.st_mtime_ns - self.modified_ns) <= _ROUNDED_NS
            return same and untouched and os.path.realpath(self.path) == self.path
        return False


class Ledger:
    """The file of entries; a line is on the disk when `add` returns. Any thread may call.

    Nothing is held in memory: a daemon that records for a month needs no more of it than one that has just begun.
    """

    def __init__(self, file: DurableFile, operating_s: Callable[[], float] = lambda: 0.0) -> None:
        """`operating_s`: how long the daemon has run, over all its starts; who only reads needs none."""
        self._file, self._operating_s = file, operating_s
        self._writing = threading.Lock()
        self._read()

    @property
    def entries(self) -> list[LedgerEntry]:
        """Every record that was ever written down and not forgotten, whether or not it is still there, in the order
        of recording."""
        with self._writing:
            return list(self._read().values())

    def add(self, file: Path) -> None:
        """Remember a record that is finished; one that is not there is no record. RigError when it cannot be written
        down."""
        try:
            path = file.resolve(strict=True)
            seen = path.stat()
        except FileNotFoundError:
            return
        except OSError as error:
            raise RigError(f"{file}: cannot be looked at, and is nobody's to remove: {error.strerror}") from None
        entry = LedgerEntry(
            str(path), seen.st_dev, seen.st_ino, seen.st_size, time.time(), self._operating_s(), seen.st_mtime_ns
        )
        with self._writing:
            self._file.append(_line(entry))

    def forget(self, paths: list[str]) -> None:
        """Leave out entries whose files are gone, and write the rest anew. RigError when that cannot be written."""
        with self._writing:
            kept = [entry for path, entry in self._read().items() if path not in set(paths)]
            self._file.replace("".join(map(_line, kept)))

    def _read(self) -> dict[str, LedgerEntry]:
        """By path, the last entry of each; none of a file that is not there, or is broken."""
        self._file.unreadable = False  # it may have been another's that lay here before
        try:
            lines = self._file.path.read_text(encoding="utf-8").splitlines()
            entries = [_entry(json.loads(line)) for line in lines]
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, TypeError, OverflowError, RecursionError):
            self._file.unreadable = True
            return {}
        last = {entry.path: number for number, entry in enumerate(entries)}
        return {entry.path: entry for number, entry in enumerate(entries) if last[entry.path] == number}


def _line(entry: LedgerEntry) -> str:
    return json.dumps(asdict(entry)) + "\n"


def _entry(raw: Any) -> LedgerEntry:
    if not isinstance(raw, dict):
        raise TypeError("an entry of another kind")
    entry = LedgerEntry(**{key: value for key, value in raw.items() if key not in _NO_MORE})
    numbers = (entry.device, entry.inode, entry.size, entry.recorded_s, entry.operating_s, entry.modified_ns)
    if not isinstance(entry.path, str) or not all(isinstance(number, int | float) for number in numbers):
        raise TypeError("an entry of another kind")
    if not (math.isfinite(entry.operating_s) and entry.operating_s >= 0.0):
        raise ValueError("a time that no daemon has run")  # it would be older than anything can be
    datetime.fromtimestamp(entry.recorded_s, UTC)  # ValueError, OverflowError or OSError for what is no time of day
    return entry
