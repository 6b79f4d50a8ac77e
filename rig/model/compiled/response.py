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
Lags = tuple[float, float, float, float, float, float]
"""The bank's low-passes."""
Plays = tuple[float, float, float, float, float]
"""Its plays."""


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
def _keeps(dt_s: float) -> Lags:  # pragma: no cover
    """The bank's low-passes for one step."""
    step_s = dt_s / _steps(dt_s)
    return (
        1.0 - exp(-step_s / LAGS_S[0]), 1.0 - exp(-step_s / LAGS_S[1]), 1.0 - exp(-step_s / LAGS_S[2]),
        1.0 - exp(-step_s / LAGS_S[3]), 1.0 - exp(-step_s / LAGS_S[4]), 1.0 - exp(-step_s / LAGS_S[5]),
    )  # fmt: skip


@kernel(nogil=True)
def _at_rest(d: float) -> tuple[Lags, Plays]:  # pragma: no cover
    """The bank's state once it has settled under the drive d."""
    return (d, d, d, d, d, d), (d, d, d, d, d)


@kernel(nogil=True)
def _lag(d: float, at: float, keep: float) -> float:  # pragma: no cover
    return at + keep * (d - at)


@kernel(nogil=True)
def _play(slow: float, at: float, half: float) -> float:  # pragma: no cover
    return min(max(at, slow - half), slow + half)


@kernel(nogil=True)
def _step(d: float, keep: Lags, lags: Lags, plays: Plays) -> tuple[Lags, Plays]:  # pragma: no cover
    """The bank's state one step later under the drive d. In tuples it stays in registers: in arrays, each number that
    is written could be one of those yet to be read, and all of it takes half as long again."""
    lags = (
        _lag(d, lags[0], keep[0]), _lag(d, lags[1], keep[1]), _lag(d, lags[2], keep[2]),
        _lag(d, lags[3], keep[3]), _lag(d, lags[4], keep[4]), _lag(d, lags[5], keep[5]),
    )  # fmt: skip
    slow, half = lags[1], PLAYS_MPA
    plays = (
        _play(slow, plays[0], half[0]), _play(slow, plays[1], half[1]), _play(slow, plays[2], half[2]),
        _play(slow, plays[3], half[3]), _play(slow, plays[4], half[4]),
    )  # fmt: skip
    return lags, plays


@kernel(nogil=True)
def _to_next(
    last: float, d: float, steps: int, keep: Lags, lags: Lags, plays: Plays
) -> tuple[Lags, Plays]:  # pragma: no cover
    """The bank's state one row later, as the drive goes from `last` to d."""
    for k in range(1, steps):
        lags, plays = _step(last + (d - last) * k / steps, keep, lags, plays)
    return _step(d, keep, lags, plays)


@kernel(nogil=True)
def _terms(d: float, lags: Lags, plays: Plays, row: Column) -> None:  # pragma: no cover
    """What the bank shows (RESPONSE_TERMS,) under the drive d in this state."""
    slow = lags[1]
    row[0], row[1], row[2], row[3] = 1.0, d, d * d, d * d * d
    row[4], row[5], row[6], row[7], row[8], row[9] = lags
    row[10], row[11] = slow * slow, slow * slow * slow
    row[12], row[13], row[14], row[15], row[16] = plays


@kernel(nogil=True)
def _drives(p1: Column, p2: Column, p0: float, exponent: float) -> Column:  # pragma: no cover
    """The drive of every row; its power, a call, would have the bank's state put away and read again at each."""
    out = np.empty(len(p1))
    for i in range(len(p1)):
        out[i] = (p1[i] - p2[i]) * _factor(p1[i], p2[i], p0, exponent)
    return out


@kernel(nogil=True)
def response_terms(
    p1: Column, p2: Column, p0: float, exponent: float, dt_s: float, out: Column
) -> None:  # pragma: no cover
    """The bank under the drive of `rig.model.equations.drive`, by the pressures p1, p2 (n,) in MPa; fills out
    (n, RESPONSE_TERMS)."""
    keep, steps, drives = _keeps(dt_s), _steps(dt_s), _drives(p1, p2, p0, exponent)
    last = drives[0]
    lags, plays = _at_rest(last)
    for i in range(len(p1)):
        lags, plays = _to_next(last, drives[i], steps if i > 0 else 1, keep, lags, plays)
        last = drives[i]
        _terms(last, lags, plays, out[i])


@kernel(nogil=True)
def propagated(
    p1: Column, p2: Column, p0: float, exponent: float, dt_s: float, weights: Column
) -> Column:  # pragma: no cover
    """The angle (n,) of the bank under pressures: `response_terms` times weights, without storing them."""
    keep, steps, row, out = _keeps(dt_s), _steps(dt_s), np.empty(RESPONSE_TERMS), _drives(p1, p2, p0, exponent)
    last = out[0]
    lags, plays = _at_rest(last)
    for i in range(len(p1)):
        d = out[i]
        lags, plays = _to_next(last, d, steps if i > 0 else 1, keep, lags, plays)
        last = d
        _terms(d, lags, plays, row)
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
