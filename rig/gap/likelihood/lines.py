"""Columns over time as cosine lines of each record: where noise is nearly independent from line to line.

A record of n rows becomes its orthonormal DCT-II up to a top frequency: a record's start and end need not meet, as a
Fourier transform would ask. No statistics and no physics here.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import groupby

import numpy as np

from rig.record import Column
from rig.smoothing import smoothed

Places = np.typing.NDArray[np.intp]


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
    def counts(self) -> tuple[int, ...]:
        """Lines of each record: the k-th lies at k / (2 T) of a record that lasts T."""
        return tuple(min(n, int(2.0 * n * dt * self.top_hz) + 1) for n, dt in zip(self.rows, self.dt_s, strict=True))

    @cached_property
    def frequency_hz(self) -> Column:
        """(l,) of every line."""
        return np.concatenate(
            [np.arange(count) / (2.0 * n * dt) for count, n, dt in zip(self.counts, self.rows, self.dt_s, strict=True)]
        )

    @cached_property
    def record(self) -> "np.typing.NDArray[np.intp]":
        """(l,) index of the record that each line belongs to."""
        return np.repeat(np.arange(len(self.rows)), self.counts)

    def beside(self, width_hz: float) -> float:
        """How many lines a blur of this width (Gaussian, standard deviation) averages over: 1 / sum of its squared
        weights."""
        seconds = float(np.mean([n * dt for n, dt in zip(self.rows, self.dt_s, strict=True)]))
        return 2.0 * float(np.sqrt(np.pi)) * max(2.0 * seconds * width_hz, 0.5)

    @cached_property
    def _alike(self) -> list[tuple[int, int, float, int]]:
        """How many records of one length follow one another, their rows, period and lines: one transform serves all."""
        return [
            (len(list(those)), *kind) for kind, those in groupby(zip(self.rows, self.dt_s, self.counts, strict=True))
        ]

    @cached_property
    def _places(self) -> list[tuple[Places, Column, Places]]:
        """For all records of one length and period: their rows (r, n), the even ones first and then the odd ones
        backwards, whether they were measured (r, n), and their lines (r, count)."""
        first_row, first_line = np.cumsum((0, *self.rows)), np.cumsum((0, *self.counts))
        found = []
        for n, count in dict.fromkeys(zip(self.rows, self.counts, strict=True)):
            own = [k for k, kind in enumerate(zip(self.rows, self.counts, strict=True)) if kind == (n, count)]
            order = np.concatenate([np.arange(0, n, 2), np.arange(1, n, 2)[::-1]])
            rows = first_row[own][:, None] + order
            found.append((rows, self.used[rows], first_line[own][:, None] + np.arange(count)))
        return found

    def of(self, columns: Column) -> Column:
        """(l,) or (l, m) lines of (n,) or (n, m) columns, zero where nothing was measured."""
        out = np.empty((sum(self.counts), *columns.shape[1:]))
        for rows, used, lines in self._places:
            measured = np.take(columns, rows, axis=0)
            measured *= used if columns.ndim == 1 else used[:, :, None]
            out[lines] = _cosines(measured, lines.shape[1])
        return out

    def envelope(self, lines: Column, width_hz: float, share_all: float) -> Column:
        """(l,) power of lines, blurred: what is unsure about a response is spread wider than the response itself.

        `share_all` of each record's power is spread evenly over its lines.
        """
        return self.blurred(lines**2, width_hz, share_all)

    def blurred(self, powers: Column, width_hz: float, share_all: float) -> Column:
        """`envelope` of (l,) powers."""
        parts, start = [], 0
        for records, n, dt, count in self._alike:
            power = powers[start : start + records * count].reshape(records, count)
            width = max(width_hz * 2.0 * n * dt, 0.5)
            near = np.array([smoothed(one, width) for one in power])
            parts.append(((1.0 - share_all) * near + share_all * power.mean(axis=1, keepdims=True)).ravel())
            start += records * count
        return np.concatenate(parts)


def _cosines(block: Column, count: int) -> Column:
    """(r, count, ...) the first lines of the orthonormal DCT-II of (r, n, ...) rows that stand in this order: the even
    ones, then the odd ones backwards. By one transform of n reals (Makhoul, IEEE Trans. ASSP 28, 1980)."""
    n = block.shape[1]
    found = np.fft.rfft(block, axis=1)
    low = found[:, :count]
    if count > found.shape[1]:  # the upper half of the spectrum is the lower one mirrored
        low = np.concatenate([found, found[:, 1 : n - found.shape[1] + 1][:, ::-1].conj()], axis=1)[:, :count]
    cosine, sine = (turn.reshape(1, count, *[1] * (block.ndim - 2)) for turn in _turns(n, count))
    lines: Column = low.real * cosine + low.imag * sine
    return lines


@lru_cache
def _turns(n: int, count: int) -> tuple[Column, Column]:
    """(count,) cosines and sines of k pi / 2n, scaled to orthonormal lines."""
    angle = 0.5 * np.pi * np.arange(count) / n
    scale = np.full(count, np.sqrt(2.0 / n))
    scale[0] = np.sqrt(1.0 / n)
    return scale * np.cos(angle), scale * np.sin(angle)


def lines_of(rows: Sequence[int], dt_s: Sequence[float], used: Sequence[Column], top_hz: float) -> Lines:
    """The transform for records of these lengths."""
    return Lines(tuple(rows), tuple(dt_s), np.concatenate(list(used)), top_hz)
