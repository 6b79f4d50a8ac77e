"""Log rotation: old records go when there are too many bytes or they are too old, never one that is still needed."""

import contextlib
import time
from collections.abc import Callable, Collection
from pathlib import Path

from rig.log.writer import PARTIAL_SUFFIX

_ENDINGS = (".mcap", ".mcap" + PARTIAL_SUFFIX)


def rotate(
    out: Path, keep_bytes: int, keep_s: float, current: Collection[Path] = (), now_s: Callable[[], float] = time.time
) -> list[Path]:
    """Remove records under `out` that are older than `keep_s`, then the oldest until at most `keep_bytes` are left.

    Files in `current` and everything else that is no record stay. Returns what was removed.
    """
    spared = {path.resolve() for path in current}
    files = []
    for path in out.rglob("*"):
        with contextlib.suppress(OSError):
            if path.name.endswith(_ENDINGS) and path.is_file() and path.resolve() not in spared:
                files.append((path.stat().st_mtime, path.stat().st_size, path))
    files.sort()
    total, oldest_s = sum(size for _, size, _ in files), now_s() - keep_s
    removed = []
    for modified_s, size, path in files:
        if modified_s >= oldest_s and total <= keep_bytes:
            break
        with contextlib.suppress(OSError):
            path.unlink()
            removed.append(path)
            total -= size
    _remove_empty({path.parent for path in removed}, out)
    return removed


def _remove_empty(folders: set[Path], out: Path) -> None:
    for folder in folders - {out}:
        with contextlib.suppress(OSError):
            folder.rmdir()  # refuses a folder that holds something
