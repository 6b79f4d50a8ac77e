"""A file of the daemon's state folder that is written again and again, and must outlive a loss of power."""

import os
from pathlib import Path

from rig.errors import RigError
from rig.outputs import keep_names


def keep(path: Path, text: str, problem: str = "cannot be written") -> None:
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
        raise RigError(f"{path}: {problem}: {error.strerror}") from None
