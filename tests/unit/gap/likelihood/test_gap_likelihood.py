"""The likelihood: the Gaussian against a dense solve, lines, choice of the reference, shares along the chain."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.app.gap.baselines import logs_of_model, read_days
from rig.errors import ConfigError, RigError
from rig.gap.answer.chain import STAGES, chain
from rig.gap.answer.result import Cause
from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.lines import lines_of
from rig.gap.reference.kinds import AUTO, ReferenceKind, because, choose
from rig.model.parameters import load_model, save_model
from rig.record import Column

MODEL = ROOT / "configs" / "models" / "simulated.yaml"


def made(seed: int, lines: int, patterns: int) -> tuple[Gaussian, Column]:
    random = np.random.default_rng(seed)
    gaussian = Gaussian(random.uniform(0.1, 3.0, lines), random.standard_normal((lines, patterns)), float(lines), 1e9)
    return gaussian, random.standard_normal(lines)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 30), st.integers(1, 6))
def test_woodbury_is_the_dense_solve(seed: int, lines: int, patterns: int) -> None:
    gaussian, residual = made(seed, lines, patterns)
    dense = np.diag(gaussian.variance) + gaussian.patterns @ gaussian.patterns.T
    assert gaussian.chi_square(residual) == pytest.approx(residual @ np.linalg.solve(dense, residual))
    slopes = np.random.default_rng(seed + 1).normal(size=(lines, 2))
    gram, pull = gaussian.normal(slopes, residual)
    assert gram == pytest.approx(slopes.T @ np.linalg.solve(dense, slopes))
    assert pull == pytest.approx(slopes.T @ np.linalg.solve(dense, residual))
    assert gaussian.sizes(residual) == pytest.approx(gaussian.patterns.T @ np.linalg.solve(dense, residual))


def normal_density(expected: Gaussian, residual: Column, factor: float = 1.0) -> float:
    """ln p of a residual where the level is known, and the patterns of days are `factor` times as large."""
    from scipy.stats import multivariate_normal  # two thirds of a second to import

    patterns = expected.patterns * np.where(np.arange(expected.patterns.shape[1]) < expected.between_days, factor, 1.0)
    dense = np.diag(expected.variance) + patterns @ patterns.T
    return float(multivariate_normal(np.zeros(len(residual)), dense).logpdf(residual))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 30), st.integers(1, 6), st.integers(0, 6))
def test_with_a_level_surely_known_it_is_a_normal_density(seed: int, lines: int, patterns: int, days: int) -> None:
    one, residual = made(seed, lines, patterns)
    one = replace(one, between_days=min(days, patterns))
    other = replace(one, variance=2.0 * one.variance)
    expected = normal_density(one, residual) - normal_density(other, 0.5 * residual)
    assert one.log_density(residual) - other.log_density(0.5 * residual) == pytest.approx(expected, abs=1e-4)
    known, wider = one.log_densities(residual, np.array([1.0, 3.0]))
    expected = normal_density(one, residual, 3.0) - normal_density(one, residual)
    assert wider - known == pytest.approx(expected, abs=1e-4)


def test_what_days_may_differ_by_is_averaged_over() -> None:
    """Against the mean of many draws of the factor."""
    known, residual = made(7, 12, 4)
    unsure = replace(known, between_days=3, pattern_degrees=2.0)
    drawn = np.exp(np.random.default_rng(1).normal(0.0, 0.5, 4000))
    log_mean = np.logaddexp.reduce(unsure.log_densities(residual, drawn)) - np.log(len(drawn))
    assert unsure.log_density(residual) == pytest.approx(log_mean, abs=0.1)


@pytest.mark.parametrize(("at", "spared"), [(0, True), (1, False)])
def test_a_day_that_differs_more_than_usual_is_likelier_and_nothing_else_is(at: int, spared: bool) -> None:
    """Six standard deviations of what days differ in, or of what they do not."""
    patterns = np.zeros((40, 2))
    patterns[0, 0] = patterns[1, 1] = 10.0
    known = Gaussian(np.ones(40), patterns, 40.0, 1e9, between_days=1)
    unsure = replace(known, pattern_degrees=2.0)
    gained = unsure.log_density(6.0 * patterns[:, at]) - known.log_density(6.0 * patterns[:, at])
    assert (gained > 8.0) == spared
    assert spared or abs(gained) < 0.3


def test_a_level_that_is_hardly_known_has_heavier_tails() -> None:
    sure, residual = made(4, 12, 2)
    unsure = replace(sure, degrees=3.0)
    fall = [one.log_density(5.0 * residual) - one.log_density(residual) for one in (sure, unsure)]
    assert fall[1] > 0.6 * fall[0]


@pytest.mark.parametrize("log_chance", [-3.0, 0.0, 1.0])
def test_a_variance_that_may_be_more_as_well_is_a_mixture_of_both(log_chance: float) -> None:
    gaussian, residual = made(3, 12, 4)
    more = np.linspace(0.5, 4.0, 12)
    either = replace(gaussian, as_well=more, log_chance=log_chance).log_density(residual)
    chances = np.array([1.0, np.exp(log_chance)]) / (1.0 + np.exp(log_chance))
    each = [gaussian.log_density(residual), gaussian.with_variance(more).log_density(residual)]
    assert either == pytest.approx(np.logaddexp.reduce(each + np.log(chances)))


def test_more_patterns_and_more_variance_are_those_of_the_sum() -> None:
    gaussian, residual = made(5, 9, 2)
    more = np.ones((9, 1))
    dense = np.diag(gaussian.variance + 0.3) + gaussian.patterns @ gaussian.patterns.T + more @ more.T
    wider = gaussian.with_patterns(more).with_variance(np.full(9, 0.3))
    assert wider.chi_square(residual) == pytest.approx(residual @ np.linalg.solve(dense, residual))


def test_lines_keep_the_sum_of_squares_of_what_is_below_the_top() -> None:
    t = 0.01 * np.arange(1000)
    slow = np.cos(np.pi * 2.0 * (t + 0.005))
    lines = lines_of([1000], [0.01], [np.ones(1000)], 6.0)
    assert float(np.sum(lines.of(slow) ** 2)) == pytest.approx(float(slow @ slow), rel=1e-6)
    assert lines.frequency_hz[int(np.argmax(np.abs(lines.of(slow))))] == pytest.approx(1.0)
    assert float(np.sum(lines.of(np.cos(2 * np.pi * 20.0 * (t + 0.005))) ** 2)) < 1e-6


def test_the_power_is_kept_when_it_is_blurred() -> None:
    lines = lines_of([1000, 600], [0.01, 0.01], [np.ones(1000), np.ones(600)], 6.0)
    values = lines.of(np.sin(0.05 * np.arange(1600.0)))
    assert float(lines.envelope(values, 0.5, 0.1).sum()) == pytest.approx(float(np.sum(values**2)), rel=0.1)


def test_the_reference_is_the_best_there_is() -> None:
    model = load_model(MODEL)
    assert choose(AUTO, model, 3) is ReferenceKind.SESSIONS
    assert choose(AUTO, model, 1) is ReferenceKind.SESSION
    assert choose(AUTO, model, 0) is ReferenceKind.SIMULATOR
    assert choose("simulator", model, 3) is ReferenceKind.SIMULATOR
    assert choose("session", model, 3) is ReferenceKind.SESSION


@pytest.mark.parametrize(
    ("asked", "sessions", "words"),
    [("sessions", 1, "needs 2 earlier days"), ("session", 0, "needs 1 earlier day"), ("fingerprint", 2, "fingerprint")],
)
def test_a_reference_that_cannot_be_had_is_said(asked: str, sessions: int, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        choose(asked, load_model(MODEL), sessions)


def test_how_the_reference_was_chosen_is_said() -> None:
    model = load_model(MODEL)
    assert because(AUTO, ReferenceKind.SESSION, model, 1) == "because 1 was given by --baseline"
    assert because(AUTO, ReferenceKind.SESSIONS, model, 4) == "because 4 were given by --baseline"
    assert "no earlier day was given" in because(AUTO, ReferenceKind.SIMULATOR, model, 0)
    assert because("simulator", ReferenceKind.SIMULATOR, model, 2).startswith("as --reference simulator asks")


def test_a_model_without_its_logs_is_one_clear_line(tmp_path: Path) -> None:
    place = tmp_path / "bare.yaml"
    model = load_model(MODEL)
    save_model(replace(model, provenance=replace(model.provenance, logs=[])), place)
    with pytest.raises(RigError, match=r"--baseline model: .*bare.yaml does not say which logs"):
        logs_of_model(place)
    with pytest.raises(RigError, match="--baseline model"):
        read_days([Path("model")], place)


def cause(effect: str, stage: str, before: float, after: float) -> Cause:
    return Cause(effect, stage, "angle", None, {}, before, after, 0.5, (), 0.9)


@given(st.lists(st.tuples(st.sampled_from(STAGES), st.floats(0.0, 1.0)), max_size=4), st.booleans())
def test_the_shares_along_the_chain_add_up(found: list[tuple[str, float]], unknown: bool) -> None:
    causes = [cause("delay", stage, 1.0, after) for stage, after in found]
    causes += [cause("unknown", "joint", 1.0, 1.0)] if unknown else []
    shares = [line.share for line in chain(causes, 0.6, 0.1)]
    assert sum(shares) == pytest.approx(1.0 if causes else 0.0)
    assert min(shares) >= 0.0
