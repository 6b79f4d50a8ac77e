"""Running means of columns, by numpy alone: what of SciPy a command needs takes a quarter of a second to import
(docs/decisions/0207-without-scipy-on-the-way-to-an-answer.md). SciPy judges them in the tests."""

from functools import lru_cache

import numpy as np

from rig.record import Column

_REACH = 4.0
"""Standard deviations at which the bell is cut off."""
_SINC_LOBES = 8
"""Of a windowed sinc on either side: within 1 % up to three quarters of the band."""


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


def through_parabolas(column: Column, rows: int) -> Column:
    """(n,) Savitzky-Golay smoothing of degree 2 over an odd number of rows; the ends lie on the parabolas of the first
    and the last rows. What scipy.signal.savgol_filter does, which takes half a second to import."""
    powers = np.vander(np.arange(rows) - rows // 2, 3).astype(float)
    fitted = powers @ np.linalg.pinv(powers)  # row k: what the rows give for the k-th of them
    middle = rows // 2
    inner = np.convolve(column, fitted[middle][::-1], "valid")
    return np.concatenate([fitted[:middle] @ column[:rows], inner, fitted[middle + 1 :] @ column[-rows:]])


def thinned(column: Column, rows: int) -> Column:
    """(-(-n // rows),) every so many rows of (n,), without what is too fast for them; beyond its ends it goes on as if
    turned about them."""
    sinc = _windowed_sinc(rows)
    return np.convolve(_turned_about_ends(column, len(sinc) // 2), sinc, "valid")[::rows]


def filled(column: Column, rows: int, length: int) -> Column:
    """(length,) a column that was `thinned` by so many rows, band-limited between them: its inverse for what is slow
    enough."""
    sinc, beyond = _windowed_sinc(rows), _SINC_LOBES + 1
    between, ones = np.zeros((2, (len(column) + 2 * beyond) * rows))
    between[::rows], ones[::rows] = _turned_about_ends(column, beyond), 1.0
    start = beyond * rows - len(sinc) // 2
    whole = np.convolve(between, sinc, "valid") / np.convolve(ones, sinc, "valid")  # a constant stays one
    return whole[start : start + length]


def running_median_at(column: Column, row: int, rows: int) -> float:
    """The (upper) median of so many rows of (n,) about one row (the odd one before it); beyond its ends it stays."""
    near = np.clip(np.arange(row - rows // 2, row - rows // 2 + rows), 0, len(column) - 1)
    return float(np.sort(column[near])[rows // 2])


@lru_cache
def _windowed_sinc(rows: int) -> Column:
    """Low-pass up to half of one in so many rows, under a Hann window."""
    reach = np.arange(-_SINC_LOBES * rows, _SINC_LOBES * rows + 1)
    sinc = np.sinc(reach / rows) * np.cos(0.5 * np.pi * reach / (reach[-1] + 1)) ** 2
    weights: Column = sinc / sinc.sum()
    weights.setflags(write=False)
    return weights


def _turned_about_ends(column: Column, rows: int) -> Column:
    return np.pad(column, rows, "reflect", reflect_type="odd")


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
