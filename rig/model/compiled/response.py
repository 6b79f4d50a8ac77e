"""Compiled inner loops of the response model: a regulator, the bank that answers to the drive, a Maxwell-slip
element."""

from math import exp, floor

import numpy as np

from rig.model.compiled.machine_code import kernel
from rig.model.compiled.stages import compiled
from rig.model.equations.drive import mean_pressure_factor
from rig.record import Column

LAGS_S = (0.02, 0.05, 0.12, 0.3, 1.0, 4.0)
"""Time constants of the bank's low-passes."""
PLAYS_MPA = (0.005, 0.015, 0.04, 0.08, 0.13)
"""Half widths of the bank's plays, which follow the second low-pass."""
RESPONSE_TERMS = 12 + len(PLAYS_MPA)
"""Constant and powers of the drive (4), low-passes (6), powers of the second (2), plays."""
STEP_S = 0.01
"""Longest step of the laws, s. A step takes its input as it is at its end, and so answers half a step early; rows that
are farther apart are gone between in as many steps as that takes, straight from one to the next."""
_factor = compiled(mean_pressure_factor)


@kernel(nogil=True)
def _steps(dt_s: float) -> int:  # pragma: no cover
    """Steps from one row to the next."""
    return max(1, int(floor(dt_s / STEP_S + 0.5)))  # noqa: RUF046 (numba's floor gives a float)


@kernel(nogil=True)
def regulated(u: Column, dead_s: float, fill_s: float, exhaust_s: float, dt_s: float) -> Column:  # pragma: no cover
    """A regulator's pressure under set-points u (n,): dead time, then a first-order lag, apart for filling and
    exhausting."""
    n, steps = len(u), _steps(dt_s)
    out = np.empty(n)
    state = u[0]
    step_s = dt_s / steps
    fill, exhaust = 1.0 - exp(-step_s / fill_s), 1.0 - exp(-step_s / exhaust_s)
    for i in range(n):
        for k in range(steps):
            at = i - (steps - 1 - k) / steps - dead_s / dt_s
            whole = int(floor(at))  # noqa: RUF046 (numba's floor gives a float)
            part = at - whole
            if whole < 0:
                goal = u[0]
            elif whole >= n - 1:
                goal = u[n - 1]
            else:
                goal = (1.0 - part) * u[whole] + part * u[whole + 1]
            state += (fill if goal > state else exhaust) * (goal - state)
        out[i] = state
    return out


@kernel(nogil=True)
def _bank(d: float, first: bool, keep: Column, row: Column) -> None:  # pragma: no cover
    """The bank one step later under the drive d: `row` (RESPONSE_TERMS,) holds its terms, which are its state as
    well."""
    if first:
        row[4:10] = d
        row[12:] = d
    row[0], row[1], row[2], row[3] = 1.0, d, d * d, d * d * d
    for j in range(6):
        row[4 + j] += keep[j] * (d - row[4 + j])
    slow = row[5]
    row[10], row[11] = slow * slow, slow * slow * slow
    for j in range(5):
        row[12 + j] = min(max(row[12 + j], slow - PLAYS_MPA[j]), slow + PLAYS_MPA[j])


@kernel(nogil=True)
def _keeps(dt_s: float) -> Column:  # pragma: no cover
    """The bank's low-passes for one step."""
    keep = np.empty(6)
    for j in range(6):
        keep[j] = 1.0 - exp(-dt_s / _steps(dt_s) / LAGS_S[j])
    return keep


@kernel(nogil=True)
def _drive(p1: float, p2: float, p0: float, exponent: float) -> float:  # pragma: no cover
    """The drive of one row."""
    factor: float = _factor(p1, p2, p0, exponent)
    return (p1 - p2) * factor


@kernel(nogil=True)
def _to_next(last: float, d: float, first: bool, steps: int, keep: Column, row: Column) -> None:  # pragma: no cover
    """The bank one row later, as the drive goes from `last` to d."""
    for k in range(1, steps):
        if not first:
            _bank(last + (d - last) * k / steps, False, keep, row)
    _bank(d, first, keep, row)


@kernel(nogil=True)
def response_terms(
    p1: Column, p2: Column, p0: float, exponent: float, dt_s: float, out: Column
) -> None:  # pragma: no cover
    """The bank under the drive of `rig.model.equations.drive`; fills out (n, RESPONSE_TERMS)."""
    keep, row, steps, last = _keeps(dt_s), np.empty(RESPONSE_TERMS), _steps(dt_s), 0.0
    for i in range(len(p1)):
        d = _drive(p1[i], p2[i], p0, exponent)
        _to_next(last, d, i == 0, steps, keep, row)
        out[i], last = row, d


@kernel(nogil=True)
def propagated(
    p1: Column, p2: Column, p0: float, exponent: float, dt_s: float, weights: Column
) -> Column:  # pragma: no cover
    """The angle (n,) of the bank under pressures: `response_terms` times weights, without storing them."""
    keep, row, steps, last = _keeps(dt_s), np.empty(RESPONSE_TERMS), _steps(dt_s), 0.0
    out = np.empty(len(p1))
    for i in range(len(p1)):
        d = _drive(p1[i], p2[i], p0, exponent)
        _to_next(last, d, i == 0, steps, keep, row)
        last = d
        angle = 0.0
        for j in range(RESPONSE_TERMS):
            angle += weights[j] * row[j]
        out[i] = angle
    return out


@kernel(nogil=True)
def stops(y: Column, radii: Column, shares: Column) -> Column:  # pragma: no cover
    """The deflection (n,) of a Maxwell-slip element whose parts, of these `shares` (k,), slip after `radii` (k,), moved
    along by y."""
    out = np.zeros(len(y))
    for k in range(len(radii)):
        state, last = 0.0, y[0]
        for i in range(len(y)):
            state = min(max(state + y[i] - last, -radii[k]), radii[k])
            last = y[i]
            out[i] += shares[k] * state
    return out
