"""A machine that stands still while a test reads the clock: noticed by a process that only sleeps (decision 0426)."""

import atexit
import mmap
import os
import struct
import subprocess
import sys
import tempfile
import time
from itertools import count
from pathlib import Path
from typing import Final, Protocol, Self

STOOD_S: Final = 0.02
"""A sleep longer by this is one of the machine: who has slept waits 9 to 17 ms for a processor where five processes
share two, and a driver waits 25 ms for the rest of a reply."""
STOOD_SHARE: Final = 0.002
"""Share of an attempt for which a standstill lasts at least where it may have been what failed it: whoever waits three
minutes for what never comes meets one of 20 ms by chance on any busy machine, and would never be judged."""
RERUNS: Final = 2
"""So often may a test be run again, whatever it failed by."""
STANDSTILLS: Final = 6
"""And so often, at most, because the machine stood still: after that it is not judged."""
PATIENCE_S: Final = 240.0
"""Nor is it judged when its attempts took longer than this together: others wait."""
NOT_JUDGED_AT_MOST: Final = 60
"""Tests, of the 540 that read the clock: with more the run has not passed."""
_LOOK_S: Final = 0.005
_KEPT: Final = 64
_SLOT: Final = struct.Struct("dd")


class Witness:
    """A process beside that of the tests, which it shares nothing with but the processors; it ends with it.

    What it saw stands in shared memory: when it looked last, then its latest oversleeps (end, length), in seconds.
    """

    def __init__(self) -> None:
        with tempfile.NamedTemporaryFile(prefix="standstill-", delete=False) as file:
            file.write(bytes(_SLOT.size * (_KEPT + 1)))
        self._seen = mmapped(Path(file.name))
        self._process = subprocess.Popen([sys.executable, "-S", "-E", __file__, file.name])
        atexit.register(self.end)
        while not self.looked_s and self._process.poll() is None:
            time.sleep(_LOOK_S)
        Path(file.name).unlink()

    @property
    def pid(self) -> int:
        return self._process.pid

    def end(self) -> None:
        self._process.kill()
        self._process.wait()

    def longest_s(self, since_s: float) -> float:
        """Of the standstills that ended after that moment of the monotonic clock, one that lasts yet among them."""
        ended = (_SLOT.unpack_from(self._seen, _SLOT.size * slot) for slot in range(1, _KEPT + 1))
        yet_s = time.monotonic() - self.looked_s - _LOOK_S
        return max([yet_s, *(length_s for end_s, length_s in ended if end_s > since_s)])

    @property
    def looked_s(self) -> float:
        """When it looked last, by the monotonic clock."""
        return float(_SLOT.unpack_from(self._seen, 0)[0])


def mmapped(path: Path) -> mmap.mmap:
    with path.open("r+b") as file:
        return mmap.mmap(file.fileno(), 0)


def watch(path: Path) -> None:
    """What the witness does, until whoever started it is gone."""
    seen, parent, slots, before_s = mmapped(path), os.getppid(), count(), time.monotonic()
    while os.getppid() == parent:
        time.sleep(_LOOK_S)
        now_s = time.monotonic()
        if (late_s := now_s - before_s - _LOOK_S) > STOOD_S:
            _SLOT.pack_into(seen, _SLOT.size * (1 + next(slots) % _KEPT), now_s, late_s)
        _SLOT.pack_into(seen, 0, now_s, 0.0)
        before_s = now_s


class Sees(Protocol):
    """Whoever can say how long the machine stood still at most since then."""

    def longest_s(self, since_s: float) -> float: ...


class Standstills:
    """Of the machine, around all attempts of one test."""

    def __init__(self, witness: Sees) -> None:
        self._witness = witness
        self._excused = 0
        self._first_s = self._begun_s = time.monotonic()

    def begin(self) -> Self:
        """Another attempt."""
        self._excused += self.stood
        self._begun_s = time.monotonic()
        return self

    @property
    def longest_s(self) -> float:
        """In this attempt."""
        return self._witness.longest_s(self._begun_s)

    @property
    def stood(self) -> bool:
        """In this attempt, for long enough to have failed it."""
        return self.longest_s > max(STOOD_S, STOOD_SHARE * (time.monotonic() - self._begun_s))

    def failed(self, attempts: int) -> bool:
        """After so many, all in vain: it is the test, since an attempt in which the machine stood still is none."""
        return attempts - self._excused - self.stood > RERUNS

    def given_up(self, attempts: int) -> bool:
        """After so many, all in vain: the machine stands still so often that nothing can be said of the test."""
        over = attempts > RERUNS + STANDSTILLS or time.monotonic() - self._first_s > PATIENCE_S
        return over and not self.failed(attempts) and self._excused + self.stood > 0


if __name__ == "__main__":
    watch(Path(sys.argv[1]))
