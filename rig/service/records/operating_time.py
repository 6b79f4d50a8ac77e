"""How long the daemon has run, over all its starts: the one measure by which its records grow old.

It is counted on the monotonic clock, which nobody can set. A wall clock that is years ahead (a dead battery, no
network) or that jumps makes nothing older; what the machine was switched off is not counted either.
"""

import json
import math
import time
from collections.abc import Callable
from pathlib import Path

from rig.service.records.durable_file import DurableFile


class OperatingTime:
    """An operating-hours counter, kept in a file of the daemon's state folder. Only the daemon `save`s."""

    def __init__(self, file: DurableFile, clock_s: Callable[[], float] = time.monotonic) -> None:
        """Begins where the file ends; at 0 when there is none, or it holds something else: then nothing is old."""
        self._file, self._clock_s = file, clock_s
        self._began_s = clock_s()
        before_s = _read(file.path)
        self._before_s, file.unreadable = before_s or 0.0, before_s is None

    def s(self) -> float:
        """Seconds so far. Any thread may ask."""
        return self._before_s + self._clock_s() - self._began_s

    def save(self) -> None:
        """Onto the disk, whole or not at all. RigError when the folder takes nothing."""
        self._file.replace(json.dumps({"operating_s": self.s()}))


def _read(path: Path) -> float | None:
    """Seconds by the file; 0 without one, None when it holds something else."""
    try:
        seconds = float(json.loads(path.read_text(encoding="utf-8"))["operating_s"])
    except FileNotFoundError:
        return 0.0
    except (OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError):
        return None
    return seconds if math.isfinite(seconds) and seconds >= 0.0 else None
