"""An input that comes open: a cable breaks contact for some samples, and the converter's input runs away meanwhile.

It runs towards a rail, and from row to row a share of its distance to the rail is left: v = rail + kept (before -
rail). So a short fall does not reach the rail, and all samples that fall lie on one straight line over what was read
before them. Unlike behind a filter, the way back is abrupt.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.gap.records.cleaning.filtered import abrupt_step
from rig.gap.records.settings import (
    FEWEST_ABRUPT,
    OPEN_AGREE,
    OPEN_KEEPS_LEAST,
    OPEN_KEEPS_MOST,
    PASSED_TO,
    RETURNS,
)
from rig.record import Column

FITS = 4
"""How often the line is fitted anew to the falls that agree with it."""
Falls = list[tuple[int, int]]
"""First row of each fall and the row after its last."""


@dataclass(frozen=True)
class OpenInput:
    """Where it runs, in the column's unit, and what share of its distance it keeps from row to row."""

    rail: float
    kept: float

    def fallen(self, column: Column, longest: int) -> tuple[NDArray[np.bool_], int]:
        """(n,) True in falls of at most so many rows that run there, and how many falls there are."""
        out, near, count = np.zeros(len(column), dtype=bool), PASSED_TO * _range(column), 0
        for start, end in _excursions(column, longest):
            ahead = self.rail + self.kept * (column[start - 1 : end - 1] - self.rail)
            if np.all(np.abs(column[start:end] - ahead) < near):
                out[start:end] = True
                count += 1
        return out, count

    def visible(self, course: Column) -> NDArray[np.bool_]:
        """(n,) where the angle is far enough from the rail for a fall to be told from motion."""
        out: NDArray[np.bool_] = (1.0 - self.kept) * np.abs(course - self.rail) > abrupt_step(course)
        return out


def open_input(columns: Sequence[Column], longest: int) -> OpenInput | None:
    """Of the samples that leave these columns (n,) abruptly and come back; None where they do not run to one place, or
    are there at once."""
    starts = [(column[start - 1], column[start]) for column in columns for start, _ in _excursions(column, longest)]
    if len(starts) < FEWEST_ABRUPT:
        return None
    before, fallen = np.array(starts).T
    near, agree = PASSED_TO * max(map(_range, columns)), np.ones(len(before), dtype=bool)
    for _ in range(FITS):
        kept, offset = np.polyfit(before[agree], fallen[agree], 1) if np.ptp(before[agree]) > 0.0 else (1.0, 0.0)
        off = np.abs(fallen - kept * before - offset)
        agree = off < max(near, 2.0 * float(np.median(off)))
    if not OPEN_KEEPS_LEAST < kept < OPEN_KEEPS_MOST or np.mean(off < near) < OPEN_AGREE:
        return None
    return OpenInput(float(offset / (1.0 - kept)), float(kept))


def _excursions(column: Column, longest: int) -> Falls:
    """Stays of at most so many rows away from where the column was, that begin and end abruptly."""
    steps = np.diff(column)
    found: Falls = []
    free = 0
    for at in map(int, np.flatnonzero(np.abs(steps) > abrupt_step(column))):
        if at < free:
            continue
        depth = abs(steps[at])
        back = np.abs(column[at + 2 : at + 2 + longest] - column[at]) < RETURNS * depth
        if back.any():
            free = at + 2 + int(np.argmax(back))
            found.append((at + 1, free))
    return found


def _range(column: Column) -> float:
    return float(np.nanmax(column) - np.nanmin(column))
