"""In which direction of the records each effect acts: every law of the library at a usual size."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.gap.hypotheses.fit import runs_away
from rig.gap.hypotheses.inverse_problems import InverseProblem
from rig.gap.hypotheses.library import Effect, Law
from rig.gap.response.causes import Applied
from rig.model.effect_stages import EFFECT_STAGES
from rig.record import Column


@dataclass(frozen=True)
class Direction:
    """One law of an effect at one size, and what it changes in a factor's lines."""

    effect: Effect
    law: Law
    size: float
    """Of the law's first free number, in its unit."""
    moved: Column
    """(l,) spectral lines of all records together; the columns would take eight times the memory."""
    choices: int
    """From how many laws, signs and shapes this one was taken: what a fit pays for them."""


def unit_of(law: Law) -> str:
    """The unit of a law's size."""
    return next(number.unit for number in EFFECT_STAGES[law.stage].numbers if number.name == law.free[0])


@dataclass(frozen=True)
class _SizedLaw:
    """One law of an effect with its shape, at one size."""

    effect: Effect
    law: Law
    shape: Mapping[str, float]
    size: float
    choices: int
    """See `Direction`."""


def usual_directions(
    effects: Sequence[Effect], problem: InverseProblem, share: float, few: InverseProblem | None = None
) -> list[Direction]:
    """Every law, sign and shape of the effects that act on this factor, at the size of its grid whose change comes
    nearest to `share` of what moves anyhow, on the same factor under a `few` of the records where they are many. Laws
    that change nothing here, or run away, are left out."""
    found = []
    for one in _sized_laws(effects, few or problem, share):
        change = changed_at(one.law, one.shape, one.size, problem)
        if change is not None and change.any():
            moved = problem.forward.factor.lines.of(change)
            found.append(Direction(one.effect, one.law, one.size, moved, one.choices))
    return found


def _sized_laws(effects: Sequence[Effect], problem: InverseProblem, share: float) -> list[_SizedLaw]:
    """Every law, sign and shape at the size whose change comes nearest to `share` of what moves anyhow."""
    found = []
    for effect in effects:
        laws = [law for law in effect.laws if problem.shows(law)]
        choices = sum(len(law.signs) * len(law.shapes) for law in laws)
        every = (
            (law, shape, sign) for law in laws for shape in law.shapes_in(problem.forward.scales) for sign in law.signs
        )
        nearest = ((law, shape, _nearest(law, shape, sign, problem, share)) for law, shape, sign in every)
        found += [_SizedLaw(effect, law, shape, size, choices) for law, shape, size in nearest if size is not None]
    return found


def columns(directions: Sequence[Direction]) -> Column:
    """(l, m) what directions change, as lines."""
    return np.column_stack([one.moved for one in directions])


def changed_at(law: Law, shape: Mapping[str, float], size: float, problem: InverseProblem) -> Column | None:
    """(n,) what a law changes at a size; None where it runs away."""
    numbers = {number.name: number.neutral for number in EFFECT_STAGES[law.stage].numbers if number.name in law.free}
    values = law.with_tied(numbers | dict(shape) | {law.free[0]: size})
    change = problem.forward.changed_by(Applied(law.stage, values))
    return None if runs_away(change) else change


def ladder(law: Law, sign: float, problem: InverseProblem) -> list[float]:
    """The sizes of a law's grid in its own unit, finer than the grid and further down for those that may be arbitrarily
    small."""
    low, high = law.range_of(law.free[0], problem.forward.scales)
    grid = np.array(law.grid) * problem.forward.scales[law.scale] * sign
    fine = np.concatenate([grid, 0.5 * (grid[1:] + grid[:-1])])
    if law.grid[0] < law.grid[-1] and abs(_neutral(law)) == 0.0:
        fine = np.concatenate([grid[0] * np.array([0.003, 0.01, 0.03, 0.1, 0.3]), fine])
    return [float(size) for size in fine if low <= size <= high]


def _nearest(law: Law, shape: Mapping[str, float], sign: float, problem: InverseProblem, share: float) -> float | None:
    best, miss = None, np.inf
    for size in ladder(law, sign, problem):
        change = changed_at(law, shape, size, problem)
        if change is None:
            continue
        moved = problem.forward.factor.rms(change) / problem.forward.moving
        if moved > 0.0 and abs(np.log(moved / share)) < miss:
            best, miss = size, abs(float(np.log(moved / share)))
    return best


def _neutral(law: Law) -> float:
    return next(number.neutral for number in EFFECT_STAGES[law.stage].numbers if number.name == law.free[0])
