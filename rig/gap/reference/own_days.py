"""What a rig's own days say of how surely their mean is known: the levels of the population, replaced as days come in.

K days differ in K - 1 independent contrasts, each as large as one day's deviation. So the variance from day to day of
each pattern, and of each line beside them, has an inverse-gamma posterior: the population's with the degrees of freedom
that it is worth, and one more for every contrast. A further day differs from the mean of K days by 1 + 1/K of that.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rig.columns import rms
from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.lines import Lines
from rig.gap.priors import FactorLevels, Prior
from rig.gap.reference.expectation import Factor, Parts
from rig.gap.response.propagate import RecordContext
from rig.gap.settings import DAY_DEGREES, ENVELOPE_EVEN, ENVELOPE_HZ, LINE_DEGREES, PATTERN_DEGREES, RIG_DEGREES
from rig.model.response.model import ResponseModel
from rig.record import Column

ROUNDS = 10
"""Steps of expectation and maximisation; the spreads stand still to a percent by then."""
LOG_SPREADS = np.linspace(-2.5, 4.5, 57)
"""Logarithms of a pattern's spread over the population's that are tried."""


def digamma(x: float) -> float:
    """Slope of the logarithm of the gamma function, to nine digits; SciPy's takes 0.15 s to import, for one number."""
    near = 1e-5 * x
    return (math.lgamma(x + near) - math.lgamma(x - near)) / (2.0 * near)


def usual_square(degrees: float) -> float:
    """Scale of the population's inverse chi-square of so many degrees of freedom: with it the logarithm of a spread of
    which nothing is known is 0 on average."""
    return math.exp(digamma(0.5 * degrees)) / (0.5 * degrees)


LEAST_UNSURE = 1e-12
"""Posterior variances of sizes, relative to the prior's, are kept this far from 0 and 1: rounding."""
BETWEEN_TWO_DAYS = 2.0
"""The population's levels are of what two days of a rig differ by: twice the variance of one."""


def pressure_days(contexts: Sequence[RecordContext]) -> Column:
    """(n, K) both monitors on each earlier day less what the reference's regulators give, valve 1 of every record and
    then valve 2; K is 0 without days."""
    first = _by_day(contexts, lambda k, context: _less(context.pair.days[k].p1_mpa, context.regulated[0]))
    second = _by_day(contexts, lambda k, context: _less(context.pair.days[k].p2_mpa, context.regulated[1]))
    return np.vstack([first, second])


def angle_days(
    contexts: Sequence[RecordContext],
    response: ResponseModel,
    driven: bool,
    misread_mpa: Sequence[tuple[float, float]] = (),
) -> Column:
    """(n, K) the angle on each earlier day less what its pressures do to it, its own ones when `driven`, without what
    their monitors `misread_mpa` on each day (K of them, where that is known)."""

    def beside_its_pressures(k: int, context: RecordContext) -> Column:
        day = context.pair.days[k]
        if not driven or day.p1_mpa is None or day.p2_mpa is None:
            return day.angle_deg - context.propagated
        one, other = misread_mpa[k] if misread_mpa else (0.0, 0.0)
        return day.angle_deg - response.angle(day.p1_mpa - one, day.p2_mpa - other, context.pair.dt_s)

    return _by_day(contexts, beside_its_pressures)


def _less(measured: Column | None, expected: Column) -> Column:
    assert measured is not None
    return measured - expected


def _by_day(contexts: Sequence[RecordContext], column: Callable[[int, RecordContext], Column]) -> Column:
    count = len(contexts[0].pair.days)
    days = [np.concatenate([column(k, context) for context in contexts]) for k in range(count)]
    return np.array(days).T if days else np.zeros((sum(len(context.pair) for context in contexts), 0))


def own_factor(parts: Parts, days: Column, levels: FactorLevels, prior: Prior) -> Factor:
    """The factor at the population's levels; with two and more earlier days (n, K) at the rig's own, as far as they
    tell them. Beside days the levels themselves are uncertain: the days of one rig differ more than those of
    another."""
    usual, count = parts.factor(levels, prior), days.shape[1]
    if count == 0:
        return usual
    pattern_degrees = RIG_DEGREES + count - 1.0
    if count == 1:
        return replace(usual, healthy=replace(usual.healthy, pattern_degrees=pattern_degrees))
    apart, further = days @ contrasts(count), 1.0 + 1.0 / count
    own = learnt(scaled(usual.healthy, 1.0 / BETWEEN_TWO_DAYS), parts.lines.of(apart), parts.lines)
    known = own.degrees + (count - 1.0) * own.effective
    degrees = 1.0 / (1.0 / DAY_DEGREES + 1.0 / known)
    healthy = replace(scaled(own, further), degrees=degrees, pattern_degrees=pattern_degrees)
    return replace(usual, healthy=healthy, floor=own_floor(usual.floor, days, parts.lines.used))


def own_floor(usual: float, days: Column, used: Column) -> float:
    """Rms by which a healthy day is off the mean of the earlier days (n, K): the population's `usual` value weighted
    with PATTERN_DEGREES degrees of freedom, and the rig's own with one for each contrast."""
    count = days.shape[1]
    if count < 2:
        return usual
    own = sum(rms(one, used) ** 2 for one in (days @ contrasts(count)).T)
    one_day = (PATTERN_DEGREES * usual**2 / BETWEEN_TWO_DAYS + own) / (PATTERN_DEGREES + count - 1.0)
    return float(np.sqrt((1.0 + 1.0 / count) * one_day))


def contrasts(count: int) -> Column:
    """(K, K - 1) orthonormal columns that are orthogonal to the mean (Helmert)."""
    made = np.zeros((count, count - 1))
    for k in range(1, count):
        made[:k, k - 1] = 1.0
        made[k, k - 1] = -float(k)
        made[:, k - 1] /= np.sqrt(k * (k + 1.0))
    return made


def scaled(expected: Gaussian, share: float) -> Gaussian:
    """The same with this share of all variance."""
    return replace(expected, variance=share * expected.variance, patterns=np.sqrt(share) * expected.patterns)


def learnt(population: Gaussian, own: Column, lines: Lines) -> Gaussian:
    """What is expected of one day of this rig: the population's, given its own days' deviations (l, K - 1), by
    expectation (the patterns' sizes in them) and maximisation (their spreads, and the lines' variances).

    How loud a rig is differs far more from build to build than what its spectrum looks like: the lines' common level is
    taken from all of them at once, their shape from each with its neighbours.
    """
    count, now = own.shape[1], population
    spread = np.ones(population.patterns.shape[1])
    for _ in range(ROUNDS):
        sizes, unsure = now.sizes_with_covariance(own)
        power = np.mean((own - now.patterns @ sizes) ** 2, axis=1) + now.power_of(unsure)
        spread = np.sqrt(
            spread * _likely_spreads(sizes, np.diag(unsure), spread)
        )  # half way: patterns share their causes
        variance = _levelled(population, _shape(population, power, count, lines), power, count)
        now = replace(population, variance=variance, patterns=population.patterns * spread)
    return now


def _likely_spreads(sizes: Column, unsure: Column, spread: Column) -> Column:
    """(m,) each pattern's spread from day to day, over the population's, beside the others as they stand: exp of what
    its logarithm is on average. Its sizes (m, k) and their variance `unsure` (m,) are in units of the `spread` taken so
    far. The likeliest spread would not do: where a day says little of a pattern there are two, one at the population's
    whose deviations the lines' variance takes, one at the rig's own, and a search finds the nearer."""
    known = np.clip(unsure, LEAST_UNSURE, 1.0 - LEAST_UNSURE)
    tells = ((1.0 / known - 1.0) / spread**2)[:, None]
    shown = np.sum((sizes / (spread * known)[:, None]) ** 2, axis=1)[:, None]
    squares = np.exp(2.0 * LOG_SPREADS)
    wider = 1.0 + squares * tells
    logs = -0.5 * sizes.shape[1] * np.log(wider) + 0.5 * squares * shown / wider
    logs -= 0.5 * PATTERN_DEGREES * (2.0 * LOG_SPREADS + usual_square(PATTERN_DEGREES) / squares)
    chance = np.exp(logs - np.max(logs, axis=1, keepdims=True))
    chance /= np.sum(chance, axis=1, keepdims=True)
    out: Column = np.exp(chance @ LOG_SPREADS)
    return out


def _shape(population: Gaussian, power: Column, count: int, lines: Lines) -> Column:
    """(l,) how the variance of the lines is spread: the population's at the level of the residual's `power` (l,) on
    `count` contrasts, and that itself, blurred."""
    worth = count * lines.beside(ENVELOPE_HZ) * population.effective / len(population.variance)
    usual = float(np.mean(power / population.variance)) * population.variance
    return (LINE_DEGREES * usual + worth * lines.blurred(power, ENVELOPE_HZ, ENVELOPE_EVEN)) / (LINE_DEGREES + worth)


def _levelled(population: Gaussian, shape: Column, power: Column, count: int) -> Column:
    """(l,) the shape at its likeliest level: the days' with one degree of freedom for each independent line of a
    contrast, the population's with those that it has."""
    seen, known = float(np.mean(power / shape)) * shape, count * population.effective
    return (population.degrees * population.variance + known * seen) / (population.degrees + known)
