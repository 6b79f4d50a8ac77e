"""Bounded least squares for a handful of parameters: damped Gauss-Newton steps within the bounds, with differences for
derivatives."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.model.compiled.machine_code import kernel
from rig.record import Column

STANDS = 1e-4
"""A descent is over when a step betters the sum of squares by less than this share of it."""


DAMPING, LEAST_DAMPING = 1e-3, 1e-3
"""Levenberg-Marquardt damping at the start, and the least that is raised when a step was no good."""
MORE_DAMPING, LESS_DAMPING = 8.0, 0.2
"""Its factor after a step that was no good, and after one that was: the usual order of ten, a little less, for of the
handful of steps that a fit has none is to be lost."""
MOST_RAISED = 4
"""Steps that were no good, one after the other, after which the descent stands: the damping is then 4000-fold."""
_DIFFERENCE, _LEAST_DIFFERENCE = 0.01, 1e-4
"""Step of the difference quotients: share of the value, and at least this share of the range. The residuals of elements
that slip are not smooth in the small: a shorter step takes one corner for the slope."""


@kernel(nogil=True)
def square_sum(column: Column) -> float:  # pragma: no cover
    """Sum of squares. Not numpy's: a threaded BLAS costs more than it gives on columns of this length."""
    total = 0.0
    for i in range(len(column)):
        total += column[i] * column[i]
    return total


@kernel(nogil=True)
def normal(
    slopes: Column, residual: Column, parts: Column, count: int
) -> tuple[Column, Column, Column]:  # pragma: no cover
    """For each part of the rows: slopes' slopes (count, k, k), slopes' residual (count, k), residual's residual
    (count,)."""
    n, k = slopes.shape
    grams, pulls, costs = np.zeros((count, k, k)), np.zeros((count, k)), np.zeros(count)
    for i in range(n):
        part = int(parts[i])
        costs[part] += residual[i] * residual[i]
        for a in range(k):
            pulls[part, a] += slopes[i, a] * residual[i]
            for b in range(k):
                grams[part, a, b] += slopes[i, a] * slopes[i, b]
    return grams, pulls, costs


@dataclass(frozen=True)
class Descent:
    """Where a descent ended."""

    x: Column
    cost: float
    """Sum of the squared residuals."""
    residual: Column
    jacobian: Column
    """(n, k), by differences at x, or one last step that changed next to nothing before; columns of zeros for
    parameters held at a bound."""


def descend(residual: Callable[[Column], Column], start: Column, low: Column, high: Column, steps: int) -> Descent:
    """Minimise the sum of squares of `residual(x)` within low..high from `start` (all of shape (k,))."""
    x = np.clip(start, low, high)
    now = residual(x)
    cost = square_sum(now)
    damping = DAMPING
    slopes = _slopes(residual, x, now, low, high)
    one = np.zeros(len(now))
    for _ in range(steps):
        grams, pulls, _costs = normal(slopes, now, one, 1)
        gram, pull = grams[0], pulls[0]
        moved = False
        for _ in range(MOST_RAISED):
            lift = damping * np.diag(gram) + 1e-30
            trial = stepped(gram + np.diag(lift), pull, x, low, high)
            then = residual(trial)
            better = square_sum(then)
            if np.isfinite(better) and better < cost:
                moved = True
                break
            damping = max(damping, LEAST_DAMPING) * MORE_DAMPING
        if not moved:
            break
        gained = (cost - better) / max(cost, 1e-300)
        x, now, cost, damping = trial, then, better, damping * LESS_DAMPING
        if gained < STANDS:  # the slopes of where it came from are those of where it is
            break
        slopes = _slopes(residual, x, now, low, high)
    return Descent(x, cost, now, slopes)


def stepped(gram: Column, pull: Column, x: Column, low: Column, high: Column) -> Column:
    """The least of a square form within the box low..high, of which gram (k, k) is the Hessian and pull (k,) the slope
    at x (k,): a coordinate that would leave the box stays at its bound, and the others take what is left (the active
    set of Stark and Parker, Computational Statistics 10, 1995)."""
    there: Column = x - np.linalg.solve(gram, pull)
    if not ((there < low) | (there > high)).any():
        return there
    at, free = x.copy(), ~_outwards(pull, x, low, high)
    for _ in range(4 * len(x)):
        if free.any():
            held = ~free
            left = pull[free] + gram[np.ix_(free, held)] @ (at - x)[held]
            there = at.copy()
            there[free] = x[free] - np.linalg.solve(gram[np.ix_(free, free)], left)
            out = (there < low) | (there > high)
            if out.any():  # as far as the first bound on the way
                room = np.where(there < low, low - at, high - at)[out] / (there - at)[out]
                first = np.nonzero(out)[0][room <= np.min(room)]
                at += np.min(room) * (there - at)
                at[first] = np.where(there[first] < low[first], low[first], high[first])
                free[first] = False
                continue
            at = there
        slope = pull + gram @ (at - x)
        inwards = ~free & ~_outwards(slope, at, low, high)
        if not inwards.any():
            break
        free[np.argmax(np.where(inwards, np.abs(slope) / np.sqrt(np.diag(gram)), -1.0))] = True
    return np.clip(at, low, high)


def _outwards(slope: Column, at: Column, low: Column, high: Column) -> NDArray[np.bool_]:
    """Coordinates at a bound that would be better beyond it."""
    return ((at <= low) & (slope >= 0.0)) | ((at >= high) & (slope <= 0.0))


def _slopes(residual: Callable[[Column], Column], x: Column, now: Column, low: Column, high: Column) -> Column:
    """Derivatives by differences, inwards at a bound."""
    steps = difference_steps(x, low, high)
    slopes = np.zeros((len(now), len(x)))
    for k, there in enumerate(x + np.diag(steps)):
        slopes[:, k] = (residual(there) - now) / steps[k]
    return slopes if np.isfinite(slopes).all() else np.nan_to_num(slopes)  # the latter looks for each kind apart


def difference_steps(x: Column, low: Column, high: Column) -> Column:
    """(k,) steps from x over which its derivatives are taken, inwards at a bound."""
    steps = np.maximum(_DIFFERENCE * np.abs(x), _LEAST_DIFFERENCE * (high - low))
    return np.where(x + steps > high, -steps, steps)
