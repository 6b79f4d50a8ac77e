"""A law's likeliest numbers by what it leaves of a gap: damped Gauss-Newton steps within their bounds.

To say what a law changes takes most of the time. So slopes are those of what it changes, which hold however the rest is
judged; they are taken anew, by differences, only after a step that they did not foretell; and no step is tried that is
foreseen to better next to nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rig.gap.likelihood.gaussian import Gaussian
from rig.identify.response.descent import (
    DAMPING,
    LEAST_DAMPING,
    LESS_DAMPING,
    MORE_DAMPING,
    MOST_RAISED,
    STANDS,
    difference_steps,
    square_sum,
    stepped,
)
from rig.record import Column

Changed = Callable[[Column], Column]
"""(l,) what a law changes with these numbers (k,), as lines; not numbers where it runs away."""
FORESEEN = 3e-5
"""No step is tried that is foreseen to better chi-square by less than this share of it: a thousandth of a nat."""
FORETOLD = 0.02
"""Slopes that foretold what a step changes but for this share of it are not taken anew."""


@dataclass(frozen=True)
class Nearest:
    """Where a descent ended."""

    x: Column
    """(k,)"""
    chi_square: float
    """Of what the law leaves; not finite where it runs away from the start."""
    slopes: Column
    """(l, k) of what it changes."""


def nearest(
    changed: Changed,
    gap: Column,
    by: Gaussian,
    start: Column,
    bounds: tuple[Column, Column],
    steps: int,
    slopes: Column | None = None,
) -> Nearest:
    """The numbers (k,) within bounds (of (k,) each) that leave least of the gap (l,), by what is expected of what is
    left, from `start` in so many steps; `slopes` (l, k) there, where they are known."""
    x = np.clip(start, *bounds)
    now = changed(x)
    least = by.chi_square(gap - now)
    if not np.isfinite(least):
        return Nearest(x, np.inf, np.zeros((len(gap), len(x))))
    slopes = differences(changed, x, now, bounds) if slopes is None else slopes
    damping, taken, raised = DAMPING, 0, 0
    while taken < steps and raised < MOST_RAISED:
        gram, pull = by.normal(slopes, gap - now)
        there = stepped(gram + np.diag(damping * np.diag(gram) + 1e-30), -pull, x, *bounds)
        step = there - x
        if 2.0 * pull @ step - step @ gram @ step <= FORESEEN * least:
            break
        then = changed(there)
        chi_square = by.chi_square(gap - then)
        if not chi_square < least:
            damping, raised = max(damping, LEAST_DAMPING) * MORE_DAMPING, raised + 1
            continue
        gained, moved, foretold = (least - chi_square) / least, then - now, slopes @ step
        x, now, least, damping, taken, raised = there, then, chi_square, LESS_DAMPING * damping, taken + 1, 0
        if gained < STANDS:  # the slopes of where it came from are those of where it is
            break
        if square_sum(moved - foretold) < FORETOLD**2 * square_sum(moved):
            slopes = as_stepped(slopes, step, moved, bounds[1] - bounds[0])
        else:
            slopes = differences(changed, x, now, bounds)
    return Nearest(x, least, slopes)


def differences(changed: Changed, x: Column, now: Column, bounds: tuple[Column, Column]) -> Column:
    """(l, k) slopes at x (k,), where the law changes `now` (l,)."""
    steps = difference_steps(x, *bounds)
    found = np.column_stack(
        [(changed(there) - now) / step for there, step in zip(x + np.diag(steps), steps, strict=True)]
    )
    return found if np.isfinite(found).all() else np.nan_to_num(found)


def as_stepped(slopes: Column, step: Column, moved: Column, units: Column) -> Column:
    """The slopes (l, k) nearest to these by which a step (k,), each number in its unit (k,), has `moved` (l,) what it
    did (Broyden, Mathematics of Computation 19, 1965)."""
    towards = step / units**2
    out: Column = slopes + np.outer(moved - slopes @ step, towards / (step @ towards))
    return out
