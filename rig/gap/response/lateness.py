"""Columns at another time: delayed by any part of a row, and how late one is behind another."""

import math

import numpy as np

from rig.model.kernels import compiled
from rig.model.slots import Values
from rig.record import Column

STEPS = 3
"""From no delay to that of a column. More: slower, and no other answer while it is below a quarter of a period."""
MOST_LATE_S = 1.0


def delayed(column: Column, rows: float) -> Column:
    """(n,) by so many rows later; between rows by the cubic through the nearest four (Lagrange), before its start at
    its first value."""
    out = np.empty(len(column))
    _shift(column, rows, out)
    return out


def displaced_s(moved: Column, usual: Column, dt_s: float) -> float:
    """By what time a column (n,) follows another (below 0: leads it), as far as it is that one at another time, and off
    by a constant: least squares, by Gauss and Newton."""
    most, rows = MOST_LATE_S / dt_s, 0.0
    at = np.ascontiguousarray(usual)
    for step in range(STEPS):
        if step > 0:
            at = delayed(usual, rows)
        rows = min(max(rows + _rows_behind(moved, at), -most), most)
    return rows * dt_s


def shift(column: Values, rows: float, out: Values) -> None:
    """`out` becomes the column, so many rows later."""
    whole = math.floor(rows)
    s = whole - rows
    ahead = s * (s + 1.0) * (s + 2.0) / 6.0
    here = -(s - 1.0) * (s + 1.0) * (s + 2.0) / 2.0
    behind = (s - 1.0) * s * (s + 2.0) / 2.0
    far = -(s - 1.0) * s * (s + 1.0) / 6.0
    last = len(column) - 1
    for i in range(len(column)):
        k = i - whole
        out[i] = (
            ahead * column[min(max(k + 1, 0), last)]
            + here * column[min(max(k, 0), last)]
            + behind * column[min(max(k - 1, 0), last)]
            + far * column[min(max(k - 2, 0), last)]
        )


def rows_behind(moved: Values, usual: Values) -> float:
    """One step: the difference's regression on the course's speed, both less their means."""
    last = len(usual) - 1
    speeds, squares, products, offs = 0.0, 0.0, 0.0, 0.0
    for i in range(last + 1):
        before, after = max(i - 1, 0), min(i + 1, last)
        speed = (usual[after] - usual[before]) / max(after - before, 1)
        off = moved[i] - usual[i]
        speeds += speed
        offs += off
        squares += speed * speed
        products += off * speed
    n = last + 1.0
    return -(products - offs * speeds / n) / max(squares - speeds * speeds / n, 1e-18)


_shift, _rows_behind = compiled(shift), compiled(rows_behind)
