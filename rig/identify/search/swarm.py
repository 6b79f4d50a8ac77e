"""Particle swarm optimisation as the paper runs it (Table II), by ask and tell in the unit box.

It knows neither models nor records; `rig.identify.search.one_search` brings it together with an objective.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.fields import bounded
from rig.model.compiled.machine_code import kernel

Table = NDArray[np.float64]


@dataclass(frozen=True)
class SwarmSettings:
    """Table II of the paper."""

    particles: int = bounded(2, 100_000, default=60)
    iterations: int = bounded(1, 1_000_000, default=1000)
    inertia_start: float = bounded(0.0, 2.0, default=0.9)
    inertia_end: float = bounded(0.0, 2.0, default=0.2)
    own: float = bounded(0.0, 10.0, default=1.5)
    """p1: pull towards a particle's own best."""
    common: float = bounded(0.0, 10.0, default=2.5)
    """p2: pull towards the swarm's best."""
    speed: float = bounded(0.001, 10.0, default=0.5)
    """V_max as a share of the range."""


class Swarm:
    """v <- I_w v + p1 r1 (Pb - x) + p2 r2 (Gb - x), |v| <= V_max; x <- x + v; I_w falls evenly over the iterations.

    The paper does not say what happens at the edge of the search space: here a particle stops there and loses its speed
    across it. The same seed gives the same search, bit by bit.
    """

    def __init__(self, dimension: int, seed: int, settings: SwarmSettings | None = None) -> None:
        self._settings = settings or SwarmSettings()
        self.random = np.random.default_rng(seed)
        shape = (self._settings.particles, dimension)
        self._at: Table = self.random.random(shape)
        self.speed = (2.0 * self.random.random(shape) - 1.0) * self._settings.speed
        self._own_best, self._own_score = self._at.copy(), np.full(shape[0], np.inf)
        self._common_best, self.best_score = self._at[0].copy(), np.inf
        self._iteration = 0

    @property
    def best(self) -> Table:
        """The best point so far, shape (d,)."""
        return np.asarray(self._common_best)

    @property
    def done(self) -> bool:
        """All iterations of Table II are told."""
        return self._iteration >= self._settings.iterations

    def ask(self) -> Table:
        """The points to score next, shape (particles, d), each coordinate in 0..1."""
        return self._at

    def tell(self, scores: Table) -> None:
        """The scores of those points, shape (particles,), finite; lower is better. The swarm then moves."""
        first = _remember(self._at, scores, self._own_best, self._own_score)
        if self._own_score[first] < self.best_score:
            self._common_best, self.best_score = self._own_best[first].copy(), float(self._own_score[first])
        settings = self._settings
        share = self._iteration / max(settings.iterations - 1, 1)
        inertia = settings.inertia_start + (settings.inertia_end - settings.inertia_start) * share
        draws = self.random.random((2, *self._at.shape))
        _move(
            self._at,
            self.speed,
            self._own_best,
            self._common_best,
            draws,
            inertia,
            settings.own,
            settings.common,
            settings.speed,
        )
        self._iteration += 1


@kernel()
def _remember(at: Table, scores: Table, own_best: Table, own_score: Table) -> int:
    """Where and how well each particle has been best so far, in place; the best of them all. Compiled as `_move` is."""
    first = 0
    for i in range(len(scores)):
        if scores[i] < own_score[i]:
            own_score[i] = scores[i]
            own_best[i] = at[i]
        if own_score[i] < own_score[first]:
            first = i
    return first


@kernel()
def _move(
    at: Table,
    speed: Table,
    own_best: Table,
    common_best: Table,
    draws: Table,
    inertia: float,
    own: float,
    common: float,
    limit: float,
) -> None:
    """One step of all particles in place; compiled because numpy's calls would cost as much as the kernel."""
    for i in range(at.shape[0]):
        for j in range(at.shape[1]):
            x = at[i, j]
            v = (
                inertia * speed[i, j]
                + own * draws[0, i, j] * (own_best[i, j] - x)
                + common * draws[1, i, j] * (common_best[j] - x)
            )
            v = min(max(v, -limit), limit)
            x += v
            if x < 0.0 or x > 1.0:
                x, v = min(max(x, 0.0), 1.0), 0.0
            at[i, j], speed[i, j] = x, v
