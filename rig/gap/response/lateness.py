"""Columns at another time: delayed by any part of a row, all along or more and more, and how late one is behind
another."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.model.compiled.stages import compiled
from rig.model.slots import Values
from rig.record import Column

LATENESS_STEPS = 3
"""From no delay to that of a column. More: slower, and no other answer while it is below a quarter of a period."""
MOST_LATE_S = 1.0
"""Largest delay that a column is moved by, s."""
WEIGHED_ROWS = 64
"""Rows that are weighed before any is moved."""
END_ROWS = 4
"""Over how many rows a column's last slope is read. More: less noise in what follows its end, and more of its bend."""


@dataclass(frozen=True)
class Lateness:
    """How much later a column comes than another, s; below 0 it comes sooner."""

    start_s: float
    """At its first row."""
    growth: float = 0.0
    """By how much more each second, as by a clock that runs off."""

    def __add__(self, other: "Lateness") -> "Lateness":
        return Lateness(self.start_s + other.start_s, self.growth + other.growth)

    def times(self, factor: float) -> "Lateness":
        """So many times as late."""
        return Lateness(factor * self.start_s, factor * self.growth)

    def since(self, begun_s: float) -> "Lateness":
        """The same of a record that begins so much later, where it grows on meanwhile."""
        return Lateness(self.start_s + self.growth * begun_s, self.growth)

    def rms_s(self, length_s: float) -> float:
        """Over a record of this length."""
        end_s = self.start_s + self.growth * length_s
        return math.sqrt((self.start_s**2 + self.start_s * end_s + end_s**2) / 3.0)


IN_TIME = Lateness(0.0)


def delayed(column: Column, late: Lateness, dt_s: float) -> Column:
    """(n,) the column later by so much; between rows by the cubic through the nearest four (Lagrange), before its start
    at its first value, beyond its end, where it comes sooner, on by its last slope."""
    out: Column = all_delayed(column[np.newaxis], late, dt_s)[0]
    return out


def all_delayed(columns: Column, late: Lateness, dt_s: float) -> Column:
    """(m, n) columns later by so much, each as in `delayed`."""
    out = np.empty(columns.shape)
    _shift(columns, late.start_s / dt_s, late.growth, out)
    return out


def displaced(moved: Column, usual: Column, dt_s: float) -> Lateness:
    """By what time a column (n,) follows another, as far as it is that one at another time, and off by a constant:
    least squares, by Gauss and Newton."""
    moved, usual = np.ascontiguousarray(moved), np.ascontiguousarray(usual)[np.newaxis]
    return Lateness(*_follows(moved, usual, np.empty_like(usual), dt_s))


def follows(moved: Values, usual: Any, at: Any, dt_s: float) -> tuple[float, float]:
    """Where a `Lateness` starts, s, and its growth; `usual` and `at`, which is overwritten, are (1, n)."""
    most, rows = MOST_LATE_S / dt_s, len(moved)
    start, growth = 0.0, 0.0
    for step in range(LATENESS_STEPS):
        if step > 0:
            shift(usual, start * dt_s / dt_s, growth, at)  # in seconds and back, to the last bit as `delayed` has it
        further = rows_behind(moved, at[0] if step > 0 else usual[0])
        start = min(max(start + further[0], -most), most)
        growth = min(max(growth + further[1], (-most - start) / rows), (most - start) / rows)
    return start * dt_s, growth


def weigh(rows: float, growth: float, first: int, count: int, whole: Any, weights: Any) -> None:
    """For so many rows from the first: by how many whole rows each is late, and the weights (4, count) of the four
    around it. Nothing is read from a column here, so that the processor does several rows at once."""
    for j in range(count):
        at = rows + growth * (first + j)
        whole[j] = math.floor(at)
        s = whole[j] - at
        weights[0, j] = s * (s + 1.0) * (s + 2.0) / 6.0
        weights[1, j] = (s - 1.0) * (s + 1.0) * (s + 2.0) / 2.0
        weights[2, j] = (s - 1.0) * s * (s + 2.0) / 2.0
        weights[3, j] = (s - 1.0) * s * (s + 1.0) / 6.0


def shift(columns: Any, rows: float, growth: float, out: Any) -> None:
    """`out` becomes the columns (m, n), so many rows later, and by `growth` more at each row."""
    last = columns.shape[1] - 1
    back = min(END_ROWS, last)
    whole, weights = np.empty(WEIGHED_ROWS), np.empty((4, WEIGHED_ROWS))
    for first in range(0, last + 1, WEIGHED_ROWS):
        count = min(WEIGHED_ROWS, last + 1 - first)
        weigh(rows, growth, first, count, whole, weights)
        for m in range(len(columns)):
            column = columns[m]
            for j in range(count):
                i = first + j
                k = i - int(whole[j])
                if 2 <= k < last:
                    ahead, here, before, behind = column[k + 1], column[k], column[k - 1], column[k - 2]
                elif i - (rows + growth * i) > last:
                    slope = (column[last] - column[last - back]) / max(back, 1)
                    out[m, i] = column[last] + (i - (rows + growth * i) - last) * slope
                    continue
                else:
                    ahead, here = column[min(max(k + 1, 0), last)], column[min(max(k, 0), last)]
                    before, behind = column[min(max(k - 1, 0), last)], column[min(max(k - 2, 0), last)]
                out[m, i] = (
                    weights[0, j] * ahead - weights[1, j] * here + weights[2, j] * before - weights[3, j] * behind
                )


def rows_behind(moved: Values, usual: Values) -> tuple[float, float]:
    """One step, rows and rows a row: the difference's regression on the course's speed and on that times the row, all
    less their means."""
    last = len(usual) - 1
    n = last + 1.0
    speeds, paces, offs = 0.0, 0.0, 0.0
    vv, vw, ww, ov, ow = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(last + 1):
        if 0 < i < last:
            speed = (usual[i + 1] - usual[i - 1]) / 2.0
        else:
            before, after = max(i - 1, 0), min(i + 1, last)
            speed = (usual[after] - usual[before]) / max(after - before, 1)
        pace = speed * (i / n - 0.5)
        off = moved[i] - usual[i]
        speeds += speed
        paces += pace
        offs += off
        vv += speed * speed
        vw += speed * pace
        ww += pace * pace
        ov += off * speed
        ow += off * pace
    vv -= speeds * speeds / n
    vw -= speeds * paces / n
    ww -= paces * paces / n
    ov -= offs * speeds / n
    ow -= offs * paces / n
    det = vv * ww - vw * vw
    if det <= 1e-9 * vv * ww:
        return -ov / max(vv, 1e-18), 0.0
    middle, ramp = -(ov * ww - ow * vw) / det, -(ow * vv - ov * vw) / det
    return middle - 0.5 * ramp, ramp / n


_shift, _follows = compiled(shift), compiled(follows)
