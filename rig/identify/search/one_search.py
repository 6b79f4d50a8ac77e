"""One search: an optimiser and an objective brought together until the budget is spent, with the whole history."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from rig.identify.search.objective import Objective
from rig.identify.search.optimizers import Optimizer, Table, ThreadedOptimizer

Progress = Callable[[int, float], None]
"""Called with the evaluations so far and the best score so far."""


@dataclass(frozen=True)
class Budget:
    """When a search ends."""

    evaluations: int = 60_000
    """Table II: 60 particles x 1000 iterations."""
    patience: int | None = None
    """Early stop: end when so many rounds brought less than `gain`; None: never."""
    gain: float = 1e-4
    """Relative improvement that counts."""


@dataclass(frozen=True)
class Found:
    """Where a search ended."""

    point: Table
    score: float
    evaluations: int
    seconds: float
    history: list[tuple[int, float]] = field(repr=False)
    """(evaluations, best score) after every round: the convergence."""


def search(objective: Objective, optimizer: Optimizer, budget: Budget, report: Progress | None = None) -> Found:
    """Ask and tell until the optimiser is done or the budget is spent."""
    begun, spent, history = time.perf_counter(), 0, []
    marked, marked_round, early = np.inf, 0, False
    while not optimizer.done and spent < budget.evaluations and not early:
        points = optimizer.ask()
        residuals = isinstance(optimizer, ThreadedOptimizer) and optimizer.wants_residuals
        optimizer.tell(objective.residuals(points) if residuals else objective.scores(points))
        spent += len(points)
        history.append((spent, optimizer.best_score))
        if optimizer.best_score < marked * (1.0 - budget.gain):
            marked, marked_round = optimizer.best_score, len(history)
        early = budget.patience is not None and len(history) - marked_round >= budget.patience
        if report is not None:
            report(spent, optimizer.best_score)
    if isinstance(optimizer, ThreadedOptimizer):
        optimizer.close()
    return Found(optimizer.best.copy(), optimizer.best_score, spent, time.perf_counter() - begun, history)
