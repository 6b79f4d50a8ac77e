"""A file of the daemon's state folder that is written again and again, and must outlive a loss of power."""

import contextlib
import itertools
import logging
import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

from rig.errors import RigError
from rig.outputs import keep_names

_LOG: Final = logging.getLogger("pamrig")


class DurableFile:
    """One such file. Before each write it is asked whether its folder is still the daemon's (`StateFolder.check`), and
    what lay there and could not be read gives up its name: who merely looks changes nothing. Writers take turns by
    themselves."""

    def __init__(self, path: Path, check: Callable[[], None] = lambda: None) -> None:
        self.path, self._check = path, check
        self.unreadable = False
        """What lies there holds what no daemon wrote: the next write puts it aside."""

    def replace(self, text: str, problem: str = "cannot be written") -> None:
        """Onto the disk, whole or not at all. RigError, which says of the path what the `problem` is, when the folder
        takes nothing."""
        self._get_ready()
        fresh = self.path.with_suffix(".new")
        try:
            with fresh.open("w", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            fresh.replace(self.path)
            keep_names(self.path.parent)
        except OSError as error:
            with contextlib.suppress(OSError):
                fresh.unlink()
            raise RigError(f"{self.path}: {problem}: {error.strerror}") from None

    def append(self, line: str) -> None:
        """The whole line or nothing of it: half a line, on a disk that was full, would make all of it unreadable.
        RigError as above."""
        self._get_ready()
        whole = None
        try:
            with self.path.open("a", encoding="utf-8") as file:
                whole = self.path.stat().st_size
                file.write(line)
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            if whole is not None:
                with contextlib.suppress(OSError):
                    os.truncate(self.path, whole)
            raise RigError(f"{self.path}: cannot be written: {error.strerror}") from None

    def put_aside(self, why: str = "cannot be read") -> None:
        """What lies there gives up its name now, beside those that did before it, and the log says so. RigError when it
        cannot."""
        places = itertools.chain([".broken"], (f".broken{number}" for number in itertools.count(2)))
        place = next(free for suffix in places if not os.path.lexists(free := self.path.with_suffix(suffix)))
        try:
            self.path.rename(place)
        except OSError as error:
            raise RigError(f"{self.path}: {why}; it cannot be put aside: {error.strerror}") from None
        _LOG.error("%s: %s; it is kept as %s, and a new one begun", self.path, why, place.name)

    def _get_ready(self) -> None:
        self._check()
        if self.unreadable:
            self.put_aside()
            self.unreadable = False
