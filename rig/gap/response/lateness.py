"""Columns at another time: delayed by any part of a row, all along or more and more, and how late one is behind
another."""

import math
from dataclasses import dataclass

import numpy as np

from rig.model.compiled.stages import compiled
from rig.model.slots import Values
from rig.record import Column

STEPS = 3
"""From no delay to that of a column. More: slower, and no other answer while it is below a quarter of a period."""
MOST_LATE_S = 1.0
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

    def rms_s(self, length_s: float) -> float:
        """Over a record of this length."""
        end_s = self.start_s + self.growth * length_s
        return math.sqrt((self.start_s**2 + self.start_s * end_s + end_s**2) / 3.0)


IN_TIME = Lateness(0.0)


def delayed(column: Column, late: Lateness, dt_s: float) -> Column:
    """(n,) the column later by so much; between rows by the cubic through the nearest four (Lagrange), before its start
    at its first value, beyond its end, where it comes sooner, on by its last slope."""
    out = np.empty(len(column))
    _shift(column, late.start_s / dt_s, late.growth, out)
    return out


def displaced(moved: Column, usual: Column, dt_s: float) -> Lateness:
    """By what time a column (n,) follows another, as far as it is that one at another time, and off by a constant:
    least squares, by Gauss and Newton."""
    most = MOST_LATE_S / dt_s
    start, growth = 0.0, 0.0
    at = np.ascontiguousarray(usual)
    for step in range(STEPS):
        if step > 0:
            at = delayed(usual, Lateness(start * dt_s, growth), dt_s)
        further = _rows_behind(moved, at)
        start = min(max(start + further[0], -most), most)
        growth = min(max(growth + further[1], (-most - start) / len(usual)), (most - start) / len(usual))
    return Lateness(start * dt_s, growth)


def shift(column: Values, rows: float, growth: float, out: Values) -> None:
    """`out` becomes the column, so many rows later, and by `growth` more at each row."""
    last = len(column) - 1
    back = min(END_ROWS, last)
    slope = (column[last] - column[last - back]) / max(back, 1)
    for i in range(len(column)):
        late = rows + growth * i
        if i - late > last:
            out[i] = column[last] + (i - late - last) * slope
            continue
        whole = math.floor(late)
        s = whole - late
        k = i - int(whole)
        out[i] = (
            s * (s + 1.0) * (s + 2.0) / 6.0 * column[min(max(k + 1, 0), last)]
            - (s - 1.0) * (s + 1.0) * (s + 2.0) / 2.0 * column[min(max(k, 0), last)]
            + (s - 1.0) * s * (s + 2.0) / 2.0 * column[min(max(k - 1, 0), last)]
            - (s - 1.0) * s * (s + 1.0) / 6.0 * column[min(max(k - 2, 0), last)]
        )


def rows_behind(moved: Values, usual: Values) -> tuple[float, float]:
    """One step, rows and rows a row: the difference's regression on the course's speed and on that times the row, all
    less their means."""
    last = len(usual) - 1
    n = last + 1.0
    speeds, paces, offs = 0.0, 0.0, 0.0
    vv, vw, ww, ov, ow = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(last + 1):
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


_shift, _rows_behind = compiled(shift), compiled(rows_behind)
