"""A file of the daemon's state folder that is written again and again, and must outlive a loss of power."""

import contextlib
import itertools
import logging
import os
from pathlib import Path
from typing import Final

from rig.errors import RigError
from rig.outputs import keep_names

_LOG: Final = logging.getLogger("pamrig")


def anywhere() -> None:
    """Asked before each write whether the folder is still the daemon's (`StateFolder.check`): it is, as nobody moves
    it."""


def write_durably(path: Path, text: str, problem: str = "cannot be written") -> None:
    """Onto the disk, whole or not at all. RigError, which says of the path what the `problem` is, when the folder takes
    nothing."""
    fresh = path.with_suffix(".new")
    try:
        with fresh.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
        keep_names(path.parent)
    except OSError as error:
        with contextlib.suppress(OSError):
            fresh.unlink()
        raise RigError(f"{path}: {problem}: {error.strerror}") from None


def put_aside(path: Path, why: str = "cannot be read") -> None:
    """A file that cannot be read, or holds what no daemon wrote, gives up its name, beside those that did before it,
    and the log says so. RigError when it cannot."""
    places = itertools.chain([".broken"], (f".broken{number}" for number in itertools.count(2)))
    place = next(free for suffix in places if not os.path.lexists(free := path.with_suffix(suffix)))
    try:
        path.rename(place)
    except OSError as error:
        raise RigError(f"{path}: {why}; it cannot be put aside: {error.strerror}") from None
    _LOG.error("%s: %s; it is kept as %s, and a new one begun", path, why, place.name)
