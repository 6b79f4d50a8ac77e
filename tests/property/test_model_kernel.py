"""The swarm's kernel against the reference, and against the stage, on parameters and inputs that Hypothesis draws."""

import numpy as np
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rig.model.compiled.stages import compiled
from rig.model.compiled.swarm import (
    BLOCK,
    HOPELESS,
    lay_inputs,
    reference_errors,
    swarm_courses,
    swarm_errors,
    swarm_peaks,
)
from rig.model.equations.stages import modified_bouc_wen

ANYTHING = [
    (0.0, 1.2),
    (-0.2, 1.2),
    (-5.0, 5.0),
    (-50.0, 50.0),
    (-1.0, 1.0),
    (-5.0, 5.0),
    (-1.0, 1.0),
    (-5.0, 5.0),
    (-50.0, 50.0),
]
"""Far beyond what a search allows: most of it diverges."""
TAME = [
    (0.9, 1.0),
    (0.5, 1.0),
    (0.0, 0.5),
    (-2.0, 2.0),
    (0.002, 0.01),
    (0.0, 0.1),
    (-0.002, 0.002),
    (0.0, 0.0),
    (-5.0, 5.0),
]
DIVERGES = (1.0, 1.0, 0.0, 0.0, 0.00390625, 0.09765625, 0.0, 0.0, 0.0)
"""Tame, and beyond any number under an input that flips at every sample: infinite less infinite in the end."""


def particle(bounds: list[tuple[float, float]]) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*(st.floats(low, high) for low, high in bounds))


inputs = arrays(np.float64, st.integers(3, 700), elements=st.floats(-2.0, 2.0))


@settings(max_examples=60, deadline=None)
@given(st.lists(particle(TAME), min_size=1, max_size=20), inputs, st.integers(0, 50))
def test_kernel_and_reference_agree_to_rounding(particles: list[tuple[float, ...]], u: np.ndarray, skip: int) -> None:
    laid = lay_inputs([u, u[::-1].copy()], [10.0 * u, 5.0 * u[::-1]], 0.005, [min(skip, len(u) - 1), 0])
    sums = swarm_errors(np.array(particles).T, laid)
    for column, each in enumerate(particles):
        wanted = np.array(reference_errors(each, laid))
        usable = wanted < HOPELESS
        assert np.allclose(sums[usable, column], wanted[usable], rtol=1e-6, atol=1e-9)
        assert np.all(sums[~usable, column] == HOPELESS)


def test_the_reference_says_hopeless_of_what_diverges_beyond_all_numbers() -> None:
    u = np.tile([0.0, 2.0], 200)
    laid = lay_inputs([u], [np.ones(len(u))], 0.005, [0])
    assert reference_errors((1.0, 1.0, 0.0, 0.0, 0.0078125, 0.09375, 0.0, 0.0, 0.0), laid) == [HOPELESS]


@settings(max_examples=60, deadline=None)
@given(st.lists(particle(ANYTHING), min_size=1, max_size=BLOCK + 1), inputs)
def test_whatever_diverges_scores_large_and_finite(particles: list[tuple[float, ...]], u: np.ndarray) -> None:
    laid = lay_inputs([u], [u], 0.005, [0])
    table = np.array(particles).T
    for result in (swarm_errors(table, laid), swarm_peaks(table, laid)):
        assert result.shape == (1, len(particles))
        assert np.all(np.isfinite(result))
        assert np.all((result >= 0.0) & (result <= HOPELESS))


@settings(max_examples=40, deadline=None)
@given(particle(TAME), inputs)
def test_kernel_and_stage_run_the_same_model(each: tuple[float, ...], u: np.ndarray) -> None:
    """The errors against the stage's own output are rounding: one law, two implementations."""
    y, state = np.zeros(len(u)), np.zeros(3)
    params = np.array([*each[:8], 0.005, 1.0, 1.0, 0.0, 0.2])
    compiled(modified_bouc_wen)(u.copy(), np.zeros(len(u)), y, state, params, 0.005)
    assume(np.max(np.abs(y)) < 1e5)
    table = np.array([[*each[:8], 0.0]]).T
    error = swarm_errors(table, lay_inputs([u], [y], 0.005, [0]))[0, 0]
    assert error <= 1e-12 * (1.0 + float(np.sum(y**2)))
    peak = swarm_peaks(table, lay_inputs([u], [y], 0.005, [0]))[0, 0]
    assert np.isclose(peak, np.max(np.abs(y)), rtol=1e-6, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(st.lists(particle(TAME), min_size=1, max_size=BLOCK + 1), inputs, st.integers(0, 50), st.integers(1, 9))
@example([DIVERGES], np.tile([0.0, 2.0], 350), 0, 2)
def test_the_courses_are_those_that_the_errors_are_of(
    particles: list[tuple[float, ...]], u: np.ndarray, skip: int, thin: int
) -> None:
    laid = lay_inputs([u, u[::-1].copy()], [10.0 * u, 5.0 * u[::-1]], 0.005, [min(skip, len(u) - 1), 0])
    table, rows = np.array(particles).T, np.arange(laid.scored_from[0], laid.ends[-1])
    rows = rows[(rows < laid.ends[1]) | (rows >= laid.scored_from[1])]
    courses = swarm_courses(table, laid, rows)
    with np.errstate(over="ignore", invalid="ignore"):  # a course that diverges ends beyond any number
        sums = np.sum((laid.y[rows] - table[8][:, np.newaxis] - courses) ** 2, axis=1)
    sums[np.isnan(sums)] = HOPELESS
    assert np.allclose(np.minimum(sums, HOPELESS), np.minimum(np.sum(swarm_errors(table, laid), axis=0), HOPELESS))
    assert np.array_equal(swarm_courses(table, laid, rows[::thin]), courses[:, ::thin], equal_nan=True)


@settings(max_examples=30, deadline=None)
@given(particle(TAME), inputs, st.integers(1, 10))
def test_a_stage_gives_the_same_however_it_is_cut_into_blocks(
    each: tuple[float, ...], u: np.ndarray, pieces: int
) -> None:
    params = np.array([*each[:8], 0.005, 1.0, 1.0, 1.0, 0.2])
    run = compiled(modified_bouc_wen)
    whole, cut = np.zeros(len(u)), np.zeros(len(u))
    run(0.2 + u, np.full(len(u), 0.2), whole, np.zeros(3), params, 0.005)
    state = np.zeros(3)
    for rows in np.array_split(np.arange(len(u)), pieces):
        block = np.zeros(len(rows))
        if len(rows):
            run(0.2 + u[rows], np.full(len(rows), 0.2), block, state, params, 0.005)
        cut[rows] = block
    assert np.array_equal(whole, cut)


def test_particles_do_not_disturb_each_other() -> None:
    """A block with one diverging particle scores the others as if they were alone; so do two threads."""
    u = np.sin(np.arange(3000) * 0.02)
    laid = lay_inputs([u], [20.0 * u], 0.005, [0])
    rng = np.random.default_rng(1)
    table = np.array([rng.uniform(low, high, 100) for low, high in TAME])
    table[4, ::7] = -1.0
    together, threads = swarm_errors(table, laid), swarm_errors(table, laid, workers=2)
    alone = np.concatenate([swarm_errors(table[:, [i]], laid) for i in range(100)], axis=1)
    assert np.array_equal(together, alone)
    assert np.array_equal(together, threads)
    assert np.all(together[0, ::7] == HOPELESS)
