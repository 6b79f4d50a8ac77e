"""Running means of columns, by numpy alone: what of SciPy a command needs takes a quarter of a second to import
(docs/decisions/0207-without-scipy-on-the-way-to-an-answer.md). SciPy judges them in the tests."""

from functools import lru_cache

import numpy as np

from rig.record import Column

_REACH = 4.0
"""Standard deviations at which the bell is cut off."""


def smoothed(column: Column, deviation_rows: float, *, mirrored: bool = False) -> Column:
    """(n,) under a Gaussian of this standard deviation; beyond its ends it stays, or is `mirrored` there."""
    bell = _bell(deviation_rows)
    return np.convolve(_extended(column, len(bell) // 2, len(bell) // 2, mirrored), bell, "valid")


def response_of_smoothing(deviation_rows: float, per_row: Column) -> Column:
    """(k,) what `smoothed` leaves of sines of these frequencies, in periods a row (k,)."""
    bell = _bell(deviation_rows)
    rows = np.arange(len(bell)) - len(bell) // 2
    return np.asarray(np.cos(2.0 * np.pi * np.outer(per_row, rows)) @ bell)


def running_mean(column: Column, rows: int) -> Column:
    """(n,) mean of so many rows about each (the odd one before it), mirrored at the ends."""
    before = rows // 2
    return np.convolve(_extended(column, before, rows - 1 - before, True), np.full(rows, 1.0 / rows), "valid")


def running_median_at(column: Column, row: int, rows: int) -> float:
    """The (upper) median of so many rows of (n,) about one row (the odd one before it); beyond its ends it stays."""
    near = np.clip(np.arange(row - rows // 2, row - rows // 2 + rows), 0, len(column) - 1)
    return float(np.sort(column[near])[rows // 2])


@lru_cache
def _bell(deviation_rows: float) -> Column:
    reach = int(_REACH * deviation_rows + 0.5)
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / deviation_rows) ** 2)
    weights: Column = bell / bell.sum()
    weights.setflags(write=False)  # whoever asks again gets the same
    return weights


def _extended(column: Column, before: int, after: int, mirrored: bool) -> Column:
    if mirrored:
        return np.pad(column, (before, after), "symmetric")
    return np.concatenate([np.full(before, column[0]), column, np.full(after, column[-1])])
