"""The swarm of Table II and its fellows behind ask and tell, on functions whose minimum is known."""

import numpy as np
import pytest

from rig.errors import ConfigError
from rig.identify.search.one_search import Budget, search
from rig.identify.search.optimizers import OPTIMIZERS, make_optimizer, polish
from rig.identify.search.swarm import Swarm, SwarmSettings

MINIMUM = np.array([0.3, 0.7, 0.55, 0.21])


class Bowl:
    """Distance from MINIMUM, with a curved valley along the first two coordinates."""

    evaluations = 0

    def residuals(self, points: np.ndarray) -> np.ndarray:
        moved = points - MINIMUM
        return np.column_stack([moved[:, 0] + 3.0 * moved[:, 1] ** 2, 0.3 * moved[:, 1], moved[:, 2], moved[:, 3]])

    def scores(self, points: np.ndarray) -> np.ndarray:
        return np.sqrt(np.mean(self.residuals(points) ** 2, axis=1))


def test_table_2_is_the_default() -> None:
    settings = SwarmSettings()
    assert (settings.particles, settings.iterations) == (60, 1000)
    assert (settings.inertia_start, settings.inertia_end, settings.own, settings.common) == (0.9, 0.2, 1.5, 2.5)
    assert settings.speed == 0.5, "V_max is half the range"


def test_one_step_of_the_swarm_is_the_papers() -> None:
    swarm = Swarm(2, 5, SwarmSettings(particles=3, iterations=10))
    before, speed = swarm.ask().copy(), swarm.speed.copy()
    scores = np.array([3.0, 1.0, 2.0])
    state = swarm.random.bit_generator.state
    swarm.tell(scores)
    draw = np.random.default_rng()
    draw.bit_generator.state = state
    r1, r2 = draw.random((2, 3, 2))
    wanted = np.clip(0.9 * speed + 1.5 * r1 * (before - before) + 2.5 * r2 * (before[1] - before), -0.5, 0.5)
    moved = before + wanted
    inside = (moved >= 0.0) & (moved <= 1.0)
    assert np.allclose(swarm.ask()[inside], moved[inside])
    assert np.all((swarm.ask() >= 0.0) & (swarm.ask() <= 1.0))
    assert np.all(swarm.speed[~inside] == 0.0)


@pytest.mark.parametrize("name", OPTIMIZERS)
def test_every_optimizer_finds_the_minimum(name: str) -> None:
    found = search(Bowl(), make_optimizer(name, 4, 1, SwarmSettings(iterations=200)), Budget(12_000))
    assert np.allclose(found.point, MINIMUM, atol=0.02)
    assert found.score < 5e-3
    spent = [evaluations for evaluations, _ in found.history]
    best = [score for _, score in found.history]
    assert spent == sorted(spent)
    assert best == sorted(best, reverse=True), "the best never gets worse"


@pytest.mark.parametrize("name", OPTIMIZERS)
def test_a_seed_gives_one_search(name: str) -> None:
    def run(seed: int) -> list[tuple[int, float]]:
        return search(Bowl(), make_optimizer(name, 4, seed, SwarmSettings(iterations=10)), Budget(600)).history

    assert run(7) == run(7)
    assert run(7) != run(8)


def test_the_polish_ends_in_the_minimum() -> None:
    found = search(Bowl(), polish(np.array([0.5, 0.5, 0.5, 0.5])), Budget())
    assert np.allclose(found.point, MINIMUM, atol=1e-5)
    assert found.evaluations < 200


def test_the_polish_keeps_inside_the_box() -> None:
    class Outside(Bowl):
        def residuals(self, points: np.ndarray) -> np.ndarray:
            return points - np.array([0.5, 1.5, 0.5, 0.5])

    found = search(Outside(), polish(np.full(4, 0.4)), Budget())
    assert np.allclose(found.point, [0.5, 1.0, 0.5, 0.5], atol=1e-3)


def test_early_stop_ends_a_search_that_gains_nothing() -> None:
    class Flat(Bowl):
        def scores(self, points: np.ndarray) -> np.ndarray:
            return np.ones(len(points))

    found = search(Flat(), Swarm(4, 1), Budget(patience=10))
    assert len(found.history) == 11, "the round that counts first, and ten that gained nothing"


def test_a_failing_objective_is_not_swallowed() -> None:
    class Broken(Bowl):
        def scores(self, points: np.ndarray) -> np.ndarray:
            raise RuntimeError("no such record")

    with pytest.raises(RuntimeError, match="no such record"):
        search(Broken(), make_optimizer("de", 4, 1, SwarmSettings()), Budget())


def test_an_unknown_optimizer_is_refused() -> None:
    with pytest.raises(ConfigError, match="did you mean 'pso'"):
        make_optimizer("psso", 4, 1, SwarmSettings())
