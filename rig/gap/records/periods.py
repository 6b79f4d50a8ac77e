"""The period of a command that repeats itself."""

import numpy as np

from rig.gap.records.settings import FEWEST_PERIODS, PERIOD_PAST, PERIODIC
from rig.record import Column


def period_rows(command: Column) -> int | None:
    """Rows of the period of a column (n,), when it has one that fits FEWEST_PERIODS times; from its autocorrelation."""
    overlap = _autocorrelation(command - command.mean())
    searched = overlap[: 2 * len(command) // FEWEST_PERIODS]
    past = np.flatnonzero(searched < PERIOD_PAST)
    if not len(past):
        return None
    tail = searched[past[0] :]
    if tail.max() < PERIODIC:
        return None
    rows = int(past[0] + np.argmax(tail > PERIODIC * tail.max()))
    rows += int(np.argmax(overlap[rows : rows + max(rows // 10, 2)]))
    rows = _closest(command, rows)
    return rows if FEWEST_PERIODS * rows <= len(command) else None


def _closest(command: Column, rows: int) -> int:
    """The period nearby after which the command differs least: an autocorrelation of few periods peaks a little beside
    it."""
    near = range(max(rows - max(rows // 20, 3), 2), min(rows + max(rows // 20, 3), len(command) - 2) + 1)
    return min(near, key=lambda k: float(np.mean((command[k:] - command[:-k]) ** 2)))


def whole_periods(command: Column) -> int:
    """How many rows from the start of the command (n,) make whole periods; n where it has none."""
    rows = period_rows(command)
    return len(command) if rows is None else len(command) // rows * rows


def _autocorrelation(column: Column) -> Column:
    """(n,) at each lag, by the rows that overlap, 1 at lag 0."""
    spectrum = np.fft.rfft(column, 2 * len(column))
    sums = np.fft.irfft(np.abs(spectrum) ** 2)[: len(column)]
    each: Column = sums / np.maximum(np.arange(len(column), 0, -1), 1)
    return each / max(float(each[0]), 1e-30)
