"""A factor once one cause is known up to its numbers and its law's usual error: where a second one competes."""

from dataclasses import replace

import numpy as np

from rig.gap.hypotheses.fit import Fit, ForwardModel, number_spreads
from rig.gap.hypotheses.inverse_problems import InverseProblem
from rig.gap.hypotheses.law_errors import with_law
from rig.gap.response.causes import Applied, ready
from rig.gap.settings import FIRST_LAW_SHARE
from rig.record import Column

STEP = 0.02
"""Of a number, as a share of its value, for the slope of what it changes."""


def problem_given(problem: InverseProblem, first: Fit) -> InverseProblem:
    """The problem in which a second cause competes beside the first."""
    return replace(
        problem, forward=forward_given(first.forward, first), on_few=lambda: forward_given(problem.screening, first)
    )


def forward_given(forward: ForwardModel, first: Fit) -> ForwardModel:
    """The model with the first cause in what is expected; its numbers may still move as far as was thought of them
    beforehand."""
    change = forward.changed_by(first.applied)
    factor, lines = forward.factor, forward.factor.lines
    rho = FIRST_LAW_SHARE * first.effect.roughness(forward.prior, first.law)
    rough = replace(factor, healthy=with_law(factor.healthy, lines, lines.of(change), rho, forward.prior))
    cause = ready([first.applied], forward.response)
    return replace(
        forward,
        factor=replace(rough.doubting(_unsure(forward, first, change)), gap=factor.gap - change),
        change=lambda causes: forward.change([*cause, *causes]) - change,
        unsure=None,
    )


def _unsure(forward: ForwardModel, first: Fit, change: Column) -> Column:
    """(n, k) what one standard deviation of each of the first cause's numbers changes, by slopes at its fit."""
    columns = []
    for name, size, spread in zip(first.law.free, first.sizes, number_spreads(first, forward.prior), strict=True):
        step = STEP * max(abs(float(size)), STEP * spread)
        if step == 0.0:  # a cause of no size leaves nothing unsure
            continue
        moved = first.law.with_tied({**first.applied.numbers, name: float(size) + step})
        columns.append((forward.changed_by(Applied(first.applied.stage, moved)) - change) * (spread / step))
    columns = columns or [np.zeros_like(change)]
    slopes: Column = np.nan_to_num(np.column_stack(columns), nan=0.0, posinf=0.0, neginf=0.0)
    return slopes
