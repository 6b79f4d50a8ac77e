"""What the loop follows: set-points by tick index, through settle, zero, ramp in, sweep and ramp out.

A program is a block of shared memory written by the process that commands the loop and mapped by the loop, so that
starting one costs the loop no copying. Phases come from the tick index; skipped periods are skipped here too.
"""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Final, NamedTuple, Self

from rig.errors import StateError
from rig.realtime.faults import Fault
from rig.realtime.shared import HEADER_WORDS, SharedBlock
from rig.sample import Phase

OPEN_LOOP: Final = 0
"""Kind of a program that follows its tables, whatever the angle; others are in `rig.realtime.closed_loop`."""
_FIELDS: Final = ("run", "settle_ticks", "zero_ticks", "ramp_in_ticks", "sweep_ticks", "ramp_out_ticks", "kind")
_SWEEP: Final = Phase.SWEEP  # by a name of this module: looking a member up in its class takes as long as a call
_FIRST: Final = HEADER_WORDS
_TABLE: Final = (HEADER_WORDS + 8) * 8


@dataclass(frozen=True)
class Program:
    """Set-points of one record. The sweep's tables have one entry a tick; the other phases are interpolated.

    Settle: from where the set-points stand, linearly over the first half to the rest pressures, then still. Zero:
    still, the angle is averaged. Ramp in: linearly to the first entry. Ramp out: linearly from the last set-points to
    the rest pressures.
    """

    run: int
    rest_p1_mpa: float
    rest_p2_mpa: float
    p1_cmd_mpa: Sequence[float]
    p2_cmd_mpa: Sequence[float]
    settle_ticks: int
    zero_ticks: int
    ramp_in_ticks: int
    ramp_out_ticks: int
    closed: ClassVar[bool] = False
    """Whether it looks at the angle."""

    @property
    def fault(self) -> Fault:
        """The fault that the program itself has found while it runs."""
        return Fault.NONE

    def wanted_deg(self, index: int) -> float:
        """The reference angle at a tick: NaN, an open loop has none."""
        return math.nan

    @cached_property
    def ticks(self) -> int:
        """Length of the whole program."""
        return self.sweep_start + len(self.p1_cmd_mpa) + self.ramp_out_ticks

    @cached_property
    def sweep_start(self) -> int:
        """Index of the first tick of the sweep."""
        return self.settle_ticks + self.zero_ticks + self.ramp_in_ticks

    def at(
        self,
        index: int,
        start: tuple[float, float],
        angle_deg: float = math.nan,
        flags: int = 0,
        standing: tuple[float, float] | None = None,
    ) -> tuple[Phase, float, float]:
        """Phase and set-points at a tick of the program that began with the set-points `start`.

        What was measured in the tick, its flags, and the set-points as the guard let them through in the last one are
        for programs that look at them (`rig.realtime.closed_loop`).
        """
        swept = index - self.sweep_start
        if 0 <= swept < len(self.p1_cmd_mpa):
            return _SWEEP, self.p1_cmd_mpa[swept], self.p2_cmd_mpa[swept]
        if swept >= 0:
            done = swept - len(self.p1_cmd_mpa) + 1
            return Phase.RAMP_OUT, *self._between(
                (self.p1_cmd_mpa[-1], self.p2_cmd_mpa[-1]), self._rest, done, self.ramp_out_ticks
            )
        if index < self.settle_ticks:
            return Phase.SETTLE, *self._between(start, self._rest, index * 2, self.settle_ticks)
        index -= self.settle_ticks
        if index < self.zero_ticks:
            return Phase.ZERO, self.rest_p1_mpa, self.rest_p2_mpa
        first = self.p1_cmd_mpa[0], self.p2_cmd_mpa[0]
        return Phase.RAMP_IN, *self._between(self._rest, first, index - self.zero_ticks, self.ramp_in_ticks)

    def way_out(self, ticks_left: int, start: tuple[float, float]) -> tuple[Phase, float, float]:
        """Set-points of an early ramp out that began at `start` and has `ticks_left` to go."""
        return Phase.RAMP_OUT, *self._between(start, self._rest, self.ramp_out_ticks - ticks_left, self.ramp_out_ticks)

    @property
    def _rest(self) -> tuple[float, float]:
        return self.rest_p1_mpa, self.rest_p2_mpa

    @staticmethod
    def _between(a: tuple[float, float], b: tuple[float, float], done: int, total: int) -> tuple[float, float]:
        if done >= total:
            return b
        share = done / total
        return a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share

    def publish(self, name: str, session: int) -> SharedBlock:
        """Write the program into a block of its own, for `attach` in the loop's process."""
        return self._write(name, session, OPEN_LOOP)

    def _write(self, name: str, session: int, kind: int, *more: Sequence[float]) -> SharedBlock:
        """A block with what all programs have, and the tables that this kind has besides."""
        tables = [
            array("d", part) for part in ((self.rest_p1_mpa, self.rest_p2_mpa), self.p1_cmd_mpa, self.p2_cmd_mpa, *more)
        ]
        block = SharedBlock.create(name, session, 8 * 8 + sum(8 * len(table) for table in tables))
        n = len(self.p1_cmd_mpa)
        counts = (self.run, self.settle_ticks, self.zero_ticks, self.ramp_in_ticks, n, self.ramp_out_ticks, kind)
        for word, value in enumerate(counts, _FIRST):
            block.words[word] = value
        place = _TABLE
        for table in tables:
            view = memoryview(table).cast("B")
            block.bytes[place : place + len(view)] = view
            place += len(view)
        return block

    @classmethod
    def attach(cls, path: Path, session: int) -> Self:
        """The program in the block at `path`; StateError when it is not one of this session."""
        return cls(**read_block(path, session).common)


class ProgramRead(NamedTuple):
    """A block as it was found."""

    kind: int
    common: dict[str, Any]
    """What every program has, by the names of its fields."""
    more: Sequence[float]
    """The numbers that its kind has besides."""


def read_block(path: Path, session: int) -> ProgramRead:
    """The block of a program; StateError when it is none of this session."""
    block = SharedBlock.attach(path, session)
    counts = dict(zip(_FIELDS, block.words[_FIRST : _FIRST + len(_FIELDS)], strict=True))
    n, kind = counts.pop("sweep_ticks"), counts.pop("kind")
    if n < 1 or _TABLE + (2 + 2 * n) * 8 > len(block.bytes):
        raise StateError(f"{path}: the program is cut short")
    table = block.bytes[_TABLE:].cast("d")
    own = {
        "rest_p1_mpa": table[0],
        "rest_p2_mpa": table[1],
        "p1_cmd_mpa": table[2 : 2 + n],
        "p2_cmd_mpa": table[2 + n : 2 + 2 * n],
    }
    return ProgramRead(kind, counts | own, table[2 + 2 * n :])
