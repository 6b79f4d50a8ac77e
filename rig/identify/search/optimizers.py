"""Every optimiser behind one ask and tell: the swarm of the paper, CMA-ES, differential evolution, a least-squares
polish.

CMA-ES is the package cmaes, differential evolution and least squares are scipy's. All work in the unit box; scores are
lower-is-better and finite.
"""

import queue
import threading
from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.config import suggest
from rig.errors import ConfigError
from rig.identify.search.space import slopes
from rig.identify.search.swarm import Swarm, SwarmSettings

Table = NDArray[np.float64]

_FIRST_SPREAD = 0.3
"""Standard deviation that CMA-ES starts with, as a share of each parameter's range: Hansen, The CMA Evolution Strategy:
A Tutorial, asks for 0.3 of the range in which the optimum lies. Less finds the nearest valley, more the bounds."""
_POPULATION = 64
"""Members of a generation of differential evolution, about as many as the paper's swarm has particles."""


class Optimizer(Protocol):
    """Asks for points and is told how good they are."""

    @property
    def best(self) -> Table:
        """The best point so far, shape (d,)."""

    @property
    def best_score(self) -> float: ...

    @property
    def done(self) -> bool:
        """It will not get better: do not ask any more."""

    def ask(self) -> Table:
        """Points to try, shape (n, d), in 0..1."""

    def tell(self, scores: Table) -> None:
        """Their scores, shape (n,)."""


class _Best:
    """Remembers the best point told."""

    def __init__(self, dimension: int) -> None:
        self.best: Table = np.full(dimension, 0.5)
        self.best_score = float("inf")
        self.done = False

    def _remember(self, points: Table, scores: Table) -> None:
        first = int(np.argmin(scores))
        if scores[first] < self.best_score:
            self.best, self.best_score = points[first].copy(), float(scores[first])


class CmaEs(_Best):
    """CMA-ES with box bounds; when it has converged it starts again with twice the population (IPOP)."""

    def __init__(self, dimension: int, seed: int) -> None:
        super().__init__(dimension)
        self._random = np.random.default_rng(seed)
        self._dimension = dimension
        self._population = 16  # fills one block of the kernel
        self._start(self._population)

    def _start(self, population: int) -> None:
        from cmaes import CMA

        mean, box = self._random.random(self._dimension), np.tile([0.0, 1.0], (self._dimension, 1))
        self._engine = CMA(
            mean=mean,
            sigma=_FIRST_SPREAD,
            bounds=box,
            seed=int(self._random.integers(2**31)),
            population_size=population,
        )

    def ask(self) -> Table:
        self._asked = np.array([self._engine.ask() for _ in range(self._engine.population_size)])
        return self._asked

    def tell(self, scores: Table) -> None:
        self._remember(self._asked, scores)
        with np.errstate(over="ignore"):  # a step that grows without end is one of its reasons to stop
            self._engine.tell([(point, float(score)) for point, score in zip(self._asked, scores, strict=True)])
        if self._engine.should_stop():
            self._population *= 2
            self._start(self._population)


class _Stopped(Exception):
    """The search is over: leave the library's loop."""


Ask = Callable[[Table], Table]


class ThreadedOptimizer(_Best):
    """A library that calls its objective, turned into ask and tell: it runs in a thread that waits for each answer."""

    def __init__(self, dimension: int, library: Callable[[Ask], object], wants_residuals: bool = False) -> None:
        """`library(answer)` runs to its end; what it must know about points (n, d) it gets from `answer(points)`."""
        super().__init__(dimension)
        self.wants_residuals = wants_residuals
        self._library = library
        self._questions: queue.Queue[Table | None] = queue.Queue(1)
        self._answers: queue.Queue[Table | None] = queue.Queue(1)
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self._next()

    def ask(self) -> Table:
        return self._asked

    def tell(self, answers: Table) -> None:
        """Scores (n,), or residuals (n, m) where `wants_residuals`."""
        self._remember(self._asked, np.sqrt(np.mean(answers**2, axis=1)) if self.wants_residuals else answers)
        if not self.done:
            self._answers.put(answers)
            self._next()

    def close(self) -> None:
        """End the library's thread."""
        if not self.done:
            self._answers.put(None)
            self._thread.join()
            self.done = True

    def _answer(self, points: Table) -> Table:
        self._questions.put(points)
        answer = self._answers.get()
        if answer is None:
            raise _Stopped
        return answer

    def _run(self) -> None:
        try:
            self._library(self._answer)
        except _Stopped:
            return
        except Exception as error:  # noqa: BLE001 - raised again in the thread that asks
            self._failure = error
        self._questions.put(None)

    def _next(self) -> None:
        points = self._questions.get()
        if self._failure is not None:
            raise self._failure
        self.done = points is None
        self._asked = self.best[np.newaxis] if points is None else points


def differential_evolution(dimension: int, seed: int) -> ThreadedOptimizer:
    """scipy's differential evolution (best1bin), a generation at an ask; it ends when its population has converged."""

    def library(answer: Ask) -> object:
        from scipy import optimize

        return optimize.differential_evolution(
            lambda columns: answer(columns.T.copy()),
            [(0.0, 1.0)] * dimension,
            popsize=max(1, _POPULATION // dimension),
            maxiter=10**6,
            rng=np.random.default_rng(seed),
            polish=False,
            vectorized=True,
            updating="deferred",
        )

    return ThreadedOptimizer(dimension, library)


def polish(start: Table, most_rounds: int = 60) -> ThreadedOptimizer:
    """scipy's bounded least squares (trust region) from `start`; each Jacobian is one ask of 2 d points."""

    def library(answer: Ask) -> object:
        from scipy import optimize

        inside = np.clip(start, 1e-9, 1.0 - 1e-9)
        return optimize.least_squares(
            lambda at: answer(at[np.newaxis])[0],
            inside,
            lambda at: slopes(answer, at),
            bounds=(0.0, 1.0),
            x_scale="jac",
            max_nfev=most_rounds,
        )

    return ThreadedOptimizer(len(start), library, wants_residuals=True)


def make_optimizer(name: str, dimension: int, seed: int, settings: SwarmSettings) -> Optimizer:
    """The optimiser of that name; ConfigError lists them."""
    makers: dict[str, Callable[[], Optimizer]] = {
        "pso": lambda: Swarm(dimension, seed, settings),
        "cma-es": lambda: CmaEs(dimension, seed),
        "de": lambda: differential_evolution(dimension, seed),
    }
    if name not in makers:
        raise ConfigError(f"optimizer {name!r}: {suggest(name, list(makers))}")
    return makers[name]()


OPTIMIZERS = ("pso", "cma-es", "de")
"""The names that `make_optimizer` knows; the paper's particle swarm first."""
