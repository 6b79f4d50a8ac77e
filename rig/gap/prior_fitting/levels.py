"""Fits the levels of a reference: how much healthy days differ from what it expects, by maximum likelihood.

What comes in are healthy days beside their reference, of many units; nothing of a case with an effect is looked at.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtri, stdtrit

from rig.gap.priors import BuildSpread, FactorLevels, Levels, Prior
from rig.gap.reference.expectation import Factor, Parts
from rig.gap.reference.monitors import OWN, misread
from rig.gap.settings import MISSED_STEPS, MOST_MISSED
from rig.record import Column

START = {
    "offset_mpa": 1e-3, "gain": 5e-3, "lag_s": 2e-3, "curvature_s2": 1e-4, "one_way_s": 1e-3, "bend": 5e-3,
    "regulators": 0.02, "one_way": 0.02,
    "offset": 3e-3,
    "loop": 0.05, "viscous_s": 2e-3,
    "monitor_mpa": 8e-4, "monitor_gain": 5e-3, "mean_law": 0.03, "drift": 1e-3, "warming": 2e-3,
    "bank": 3e-3,
}  # fmt: skip
"""Where the search begins, and what a level falls back to of which the days say nothing; units as in
`rig.gap.reference.patterns`."""
MOST = {"monitor_gain": 0.06}
"""Largest levels that physics allows: a monitor is at most 6 % of full scale off (data sheet). More: the gain of one
muscle is taken for its monitor's."""
START_SHARE, START_EVEN = 0.01, 0.003
"""Where the search begins: of a noise with the spectrum of the motion, as a share of that, and of one that is alike at
all frequencies, as a share of the span."""
LIKELY = 0.9
"""Mass at which a normal spread is made as wide as Student's. More: wider."""
PULL = 0.02
"""How firmly levels are held to the start, per squared factor e, in nats."""
LEVEL_ROUNDS = 20
"""Iterations of the search for levels at most."""
OFFSET_SHARES = (0.0, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Shares of the monitors' offsets that are tried."""


def fit_levels(families: Sequence[Sequence[Parts]], prior: Prior, *, of_days: bool = True) -> FactorLevels:
    """The levels of one factor for a rig of a build that is not among these, by a mean over families.

    A family is one draw of what builds differ by, however many days it brings. What differs from day to day (`of_days`)
    is the geometric mean, with the start, a guess about days, as one more draw: a level that one build hardly shows
    stays a doubt about the next. What a description misses is the root of the mean square. On families that were left
    out each was the likeliest of what it is used for (docs/decisions/0524, 0596).
    """
    found = [_of_family(days, prior) for days in families]
    floor = float(np.exp(np.mean([np.log(_floor(days)) for days in families])))
    names = _names(families[0])
    if of_days:
        return _levels(names, np.mean([_start(names), *found], axis=0), floor)
    return _levels(names, 0.5 * np.log(np.mean(np.exp(2.0 * np.array(found)), axis=0)), floor)


def of_another_build(levels: FactorLevels, builds: int) -> FactorLevels:
    """Levels of what rigs of one build differ by, for a build that is not among the `builds` that they were fitted
    on."""
    wider = wider_for_another(builds)
    return replace(levels, patterns={name: wider * value for name, value in levels.patterns.items()})


def wider_for_another(builds: int) -> float:
    """By how much wider a spread is for a build that is not among those that it is known from: from so few it is
    Student's, and a normal one is as wide at LIKELY (Gelman et al., Bayesian Data Analysis, 3.2)."""
    return float(stdtrit(builds, 0.5 + 0.5 * LIKELY) / ndtri(0.5 + 0.5 * LIKELY))


def fit_builds(families: Sequence[Sequence[Parts]], levels: FactorLevels, prior: Prior) -> BuildSpread:
    """By how much more or less than these levels each family's days are missed, as the spread of what builds are missed
    by: of each family the mean logarithm of the likeliest share of the variance's root, of all their rms."""
    found = [_mean([_log_missed(day.factor(levels, prior)) for day in days]) for days in families]
    return BuildSpread(float(np.sqrt(np.mean(np.square(found)))), float(len(found)))


def _log_missed(factor: Factor) -> float:
    """Logarithm of the likeliest share of the usual rms by which a day without a gap is missed."""
    logs, healthy = np.linspace(-MOST_MISSED, MOST_MISSED, 2 * MISSED_STEPS - 1), factor.healthy
    densities = [
        replace(healthy, variance=share * healthy.variance).log_density(factor.gap_lines) for share in np.exp(2 * logs)
    ]
    return float(logs[int(np.argmax(densities))])


def fit_monitors(
    families: Sequence[Sequence[tuple[Parts, Parts]]], pressures: FactorLevels, angle: FactorLevels, prior: Prior
) -> float:
    """The share of the monitors' offsets that is their own error (`Levels.monitors`), from pressures and angle of the
    same healthy days: the likeliest of OFFSET_SHARES, every family's mean day counting alike."""
    densities = [
        [_mean([_tied(*day, Levels(pressures, angle, 0.0, share), prior) for day in days]) for share in OFFSET_SHARES]
        for days in families
    ]
    return OFFSET_SHARES[int(np.argmax(np.sum(densities, axis=0)))]


def _tied(pressures: Parts, angle: Parts, levels: Levels, prior: Prior) -> float:
    """ln p of a healthy day's angle when its monitors misread what the pressures tell."""
    wrong = misread(pressures.factor(levels.pressures, prior), pressures.lines.of(pressures.gap), levels)
    first = angle.names.index(OWN)
    moved = angle.columns[:, [first, first + 1]] @ np.array(wrong.offset_mpa)
    healthy = angle.factor(wrong.levels(levels.angle), prior).healthy
    return healthy.log_density(angle.lines.of(angle.gap) + moved)


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values))


def _of_family(days: Sequence[Parts], prior: Prior) -> Column:
    """Logarithms of the likeliest levels over all days of one family, in the order of `_start`."""
    from scipy.optimize import minimize  # half a second to import

    names = _names(days)
    start = _start(names)
    residuals = [day.lines.of(day.gap) for day in days]

    def cost(x: Column) -> tuple[float, Column]:
        here = _levels(names, x, 0.0)
        slope, density = 2.0 * PULL * (x - start), -PULL * float(np.sum((x - start) ** 2))
        for day, gap in zip(days, residuals, strict=True):
            healthy = day.factor(here, prior).healthy
            density += healthy.log_density(gap)
            slope -= _slope(day, here, names, healthy.log_slopes(gap))
        return -density, slope

    largest = [float(np.log(MOST[name])) if name in MOST else None for name in names]
    bounds = [(None, most) for most in (*largest, None, None)]
    found: Column = minimize(
        cost, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": LEVEL_ROUNDS}
    ).x
    return found


def _slope(day: Parts, here: FactorLevels, names: Sequence[str], slopes: tuple[Column, Column]) -> Column:
    """Derivative of a day's log density by the logarithms of its levels."""
    by_pattern, by_line = slopes
    out = np.zeros(len(names) + 2)
    np.add.at(out, [names.index(name) for name in day.names], by_pattern)
    share, even = here.share**2 * day.envelope, (here.even * day.span) ** 2
    variance = share + even + day.noise
    out[-2:] = 2.0 * np.sum(by_line * share / variance), 2.0 * np.sum(by_line * even / variance)
    return out


def _names(days: Sequence[Parts]) -> list[str]:
    return list(dict.fromkeys(days[0].names))


def _start(names: Sequence[str]) -> Column:
    """Logarithms of the start: of each pattern, then of `share` and `even`."""
    return np.log([*(START[name] for name in names), START_SHARE, START_EVEN])


def _levels(names: Sequence[str], x: Column, floor: float) -> FactorLevels:
    values = np.exp(x).tolist()
    return FactorLevels(dict(zip(names, values, strict=False)), values[-2], values[-1], floor)


def _floor(days: Sequence[Parts]) -> float:
    """Rms of what the days differ from what is expected by, as a share of the span."""
    return float(np.sqrt(np.mean([(day.rms(day.gap) / day.span) ** 2 for day in days])))
