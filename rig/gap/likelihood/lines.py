"""Columns over time as cosine lines of each record: where noise is nearly independent from line to line.

A record of n rows becomes its orthonormal DCT-II up to a top frequency: a record's start and end need not meet, as a
Fourier transform would ask. The transform runs over a few rows more, nothing measured there, where n itself has a large
prime factor: it would take up to twenty times as long (docs/decisions/0648). No statistics and no physics here.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from itertools import count as counted_from
from itertools import groupby

import numpy as np

from rig.model.compiled.machine_code import kernel
from rig.record import Column
from rig.smoothing import smoothed

Places = np.typing.NDArray[np.intp]
Spectra = np.typing.NDArray[np.complex128]


FAST_FACTORS = (2, 3, 5, 7, 11)
"""Prime factors of a length that numpy's transform is fast at: it has a routine for each."""


@kernel(nogil=True)
def measured(columns: Column, rows: Places, used: Column) -> Column:  # pragma: no cover
    """(r, m, n) these rows (r, n) of columns (m, all), zero where nothing was measured."""
    out = np.empty((rows.shape[0], columns.shape[0], rows.shape[1]))
    for r in range(rows.shape[0]):
        for m in range(columns.shape[0]):
            for i in range(rows.shape[1]):
                out[r, m, i] = columns[m, rows[r, i]] * used[r, i]
    return out


@kernel(nogil=True)
def turn(spectra: Spectra, rows: int, turns: Column, lines: Places, out: Column) -> None:  # pragma: no cover
    """Lines of the orthonormal DCT-II from the lower half of the spectra (r, m, h) of so many rows, of which the even
    ones came first and then the odd ones backwards; by `turns` (2, count)."""
    half = spectra.shape[2]
    for r in range(lines.shape[0]):
        for m in range(out.shape[1]):
            for k in range(lines.shape[1]):
                # the upper half of the spectrum is the lower one mirrored
                one = spectra[r, m, k] if k < half else np.conj(spectra[r, m, rows - k])
                out[lines[r, k], m] = one.real * turns[0, k] + one.imag * turns[1, k]


@dataclass(frozen=True)
class Lines:
    """The transform of columns that run over several records, one after the other."""

    rows: tuple[int, ...]
    """Rows of each record."""
    dt_s: tuple[float, ...]
    used: Column
    """(n,) 1 where something was measured, 0 elsewhere."""
    top_hz: float

    @cached_property
    def _lengths(self) -> tuple[int, ...]:
        """Rows of each record's transform."""
        return tuple(fast_length(n) for n in self.rows)

    @cached_property
    def _seconds(self) -> tuple[float, ...]:
        """What each of these transforms spans."""
        return tuple(n * dt for n, dt in zip(self._lengths, self.dt_s, strict=True))

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """Lines of each record: the k-th lies at k / (2 T) of a transform that spans T."""
        each = zip(self._lengths, self._seconds, strict=True)
        return tuple(min(n, int(2.0 * seconds * self.top_hz) + 1) for n, seconds in each)

    @cached_property
    def frequency_hz(self) -> Column:
        """(l,) of every line."""
        each = zip(self.counts, self._seconds, strict=True)
        return np.concatenate([np.arange(count) / (2.0 * seconds) for count, seconds in each])

    @cached_property
    def record(self) -> "np.typing.NDArray[np.intp]":
        """(l,) index of the record that each line belongs to."""
        return np.repeat(np.arange(len(self.rows)), self.counts)

    @cached_property
    def ends(self) -> Places:
        """(r + 1,) the first line of each record, and how many lines there are."""
        return np.cumsum((0, *self.counts))

    def beside(self, width_hz: float) -> float:
        """How many lines a blur of this width (Gaussian, standard deviation) averages over: 1 / sum of its squared
        weights."""
        seconds = float(np.mean(self._seconds))
        return 2.0 * float(np.sqrt(np.pi)) * max(2.0 * seconds * width_hz, 0.5)

    @cached_property
    def _alike(self) -> list[tuple[int, float, int]]:
        """How many records that span the same seconds follow one another, those, and their lines: one blur serves
        all."""
        return [(len(list(those)), *kind) for kind, those in groupby(zip(self._seconds, self.counts, strict=True))]

    @cached_property
    def _places(self) -> list[tuple[Places, Column, Places, Column]]:
        """For all records of one transform and as many lines: that transform's rows (r, n), the even ones first and
        then the odd ones backwards, whether they were measured (r, n), their lines (r, count) and what makes those of a
        transform."""
        first_row, first_line, has = np.cumsum((0, *self.rows)), self.ends, np.array(self.rows)
        kinds, found = list(zip(self._lengths, self.counts, strict=True)), []
        for n, count in dict.fromkeys(kinds):
            own = [k for k, other in enumerate(kinds) if other == (n, count)]
            order = np.concatenate([np.arange(0, n, 2), np.arange(1, n, 2)[::-1]])
            rows = first_row[own][:, None] + np.minimum(order, has[own][:, None] - 1)
            used = self.used[rows] * (order < has[own][:, None])
            found.append((rows, used, first_line[own][:, None] + np.arange(count), _turns(n, count)))
        return found

    def of(self, columns: Column) -> Column:
        """(l,) or (l, m) lines of (n,) or (n, m) columns, zero where nothing was measured. By one transform of n reals
        for each record (Makhoul, IEEE Trans. ASSP 28, 1980)."""
        out = np.empty((self._count, *columns.shape[1:]))
        each, found = np.ascontiguousarray(columns.reshape(len(columns), -1).T), out.reshape(self._count, -1)
        for rows, used, lines, turns in self._places:
            turn(np.fft.rfft(measured(each, rows, used)), rows.shape[1], turns, lines, found)
        return out

    @cached_property
    def _count(self) -> int:
        return sum(self.counts)

    def envelope(self, lines: Column, width_hz: float, share_all: float) -> Column:
        """(l,) power of lines, blurred: what is unsure about a response is spread wider than the response itself.

        `share_all` of each record's power is spread evenly over its lines.
        """
        return self.blurred(lines**2, width_hz, share_all)

    def blurred(self, powers: Column, width_hz: float, share_all: float) -> Column:
        """`envelope` of (l,) powers."""
        parts, start = [], 0
        for records, seconds, count in self._alike:
            power = powers[start : start + records * count].reshape(records, count)
            parts.append((power @ _blur(count, max(width_hz * 2.0 * seconds, 0.5), share_all)).ravel())
            start += records * count
        return np.concatenate(parts)


@lru_cache(maxsize=256)
def _blur(count: int, width: float, share_all: float) -> Column:
    """(count, count) what each line's power becomes of every line."""
    near = np.column_stack([smoothed(one, width) for one in np.eye(count)])
    blur: Column = (1.0 - share_all) * near.T + share_all / count
    return blur


@cache
def fast_length(rows: int) -> int:
    """The least length of at least so many rows whose prime factors are all of FAST_FACTORS."""
    return next(n for n in counted_from(rows) if _beyond_fast(n) == 1)


def _beyond_fast(n: int) -> int:
    """What is left of n without its FAST_FACTORS."""
    for factor in FAST_FACTORS:
        while n % factor == 0:
            n //= factor
    return n


@lru_cache
def _turns(n: int, count: int) -> Column:
    """(2, count) cosines and sines of k pi / 2n, scaled to orthonormal lines."""
    angle = 0.5 * np.pi * np.arange(count) / n
    scale = np.full(count, np.sqrt(2.0 / n))
    scale[0] = np.sqrt(1.0 / n)
    return np.array([scale * np.cos(angle), scale * np.sin(angle)])


def lines_of(rows: Sequence[int], dt_s: Sequence[float], used: Sequence[Column], top_hz: float) -> Lines:
    """The cosine lines up to `top_hz` (Hz) of records of so many rows each, with their periods (s) and their weights
    `used`, (n,) a record."""
    return Lines(tuple(rows), tuple(dt_s), np.concatenate(list(used)), top_hz)
