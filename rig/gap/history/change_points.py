"""Where a series of days changes its level, at a false-alarm rate that holds for the whole series, and how it grows.

Binary segmentation on the largest standardised difference of means. Each change must be one by two tests: among
permutations of the days (Good, Permutation, Parametric and Bootstrap Tests, 3rd ed., 2005), which holds whatever the
days' distribution where they may come in any order; and, between the changes before and after it, among series without
a change in which a day remembers the day before as much as these may (autoregressive, of first order): such days wander
by themselves. The weakest goes first, until all that are left hold.
"""

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Final

import numpy as np
from scipy.special import ndtr

from rig.columns import NORMAL_95
from rig.record import Column

FEWEST_DAYS: Final = 3
"""On each side of a change."""
FEWEST_FOR_SLOPE: Final = 5
"""Dates for a slope. All slopes between three days have one sign in one of three orders of them, of four in one of
twelve, of five in one of sixty: fewer than five have no interval of 95 %."""
LEAST_SERIES: Final = 1999
"""Series that are drawn at least: the finest probability that is told is one in this many and one."""
EXPECTED_BEYOND: Final = 20
"""Series that are expected beyond the rate that is asked for, which sets how many are drawn: with fewer than one no
change could ever be told. Less: by chance a clear change is not."""
MEMORIES: Final = np.arange(0.0, 0.91, 0.1)
"""Correlations of a day with the day before that are tried."""
DOUBT: Final = 0.3
"""The memory that is believed is the largest beside which so small a share of series remembers as little as this one
seems to. Less: fewer false alarms of days that remember, and later and larger changes only."""
_FORGOTTEN: Final = 50
"""Days after which a series does not know any more how it began."""


def change_points(values: Column, rate: float, seed: int = 0) -> list[tuple[int, float]]:
    """Indices of `values` (days,) at which a new level begins, with their p-values, in order; `rate` is the chance of
    any in a series without a change."""
    trials = max(LEAST_SERIES, int(np.ceil(EXPECTED_BEYOND / rate)) - 1)
    found = _by_shuffling(values, rate, trials, np.random.default_rng(seed))
    while found:
        edges = [0, *sorted(found), len(values)]
        parts = zip(edges, edges[1:], edges[2:], strict=False)
        alone = {at: _remembering(values[start:end], trials) for start, at, end in parts}
        weakest = max(alone, key=lambda at: alone[at])
        if alone[weakest] <= rate:
            return sorted((at, max(p_value, alone[at])) for at, p_value in found.items())
        del found[weakest]
    return []


def fewest_days(rate: float) -> int:
    """Of fewer days no order is rare enough to be a change: two levels are the same two in 2 of n over n / 2 orders."""
    days = 2 * FEWEST_DAYS
    while 2.0 / math.comb(days, days // 2) > rate:
        days += 1
    return days


def _by_shuffling(values: Column, rate: float, trials: int, random: np.random.Generator) -> dict[int, float]:
    """Changes that hold among the orders of the days, each with its p-value."""
    found: dict[int, float] = {}
    open_parts = [(0, len(values))]
    while open_parts:
        start, end = open_parts.pop()
        part = values[start:end]
        if len(part) < 2 * FEWEST_DAYS or np.ptp(part) == 0.0:
            continue
        p_value = _shuffled(part, trials, random)
        if p_value <= rate:
            at = start + int(_strongest(part[None, :])[0][0])
            found[at] = p_value
            open_parts += [(start, at), (at, end)]
    return found


def _shuffled(part: Column, trials: int, random: np.random.Generator) -> float:
    """Share of the orders of the days that change as strongly as this one."""
    orders = random.permuted(np.tile(part, (trials, 1)), axis=1)
    return _beyond(_strongest(orders)[1], float(_strongest(part[None, :])[1][0]))


def _remembering(part: Column, trials: int) -> float:
    """Share of series without a change, of days that remember as much as these may, that change as strongly."""
    at, strength = _strongest(part[None, :])
    strengths, edges = _without_change(len(part), trials)
    memory = float(np.interp(_memory(part[None, :], at)[0], edges, MEMORIES))
    shares = [_beyond(known, float(strength[0])) for known in strengths]
    return float(np.interp(memory, MEMORIES, shares))


@lru_cache(maxsize=64)
def _without_change(days: int, trials: int) -> tuple[Column, Column]:
    """(m, t) how strongly series of so many days change by themselves, for each of MEMORIES; and (m,) the memory that
    they seem to have, of which only the share DOUBT seems to have less."""
    strengths, edges = [], []
    for series in _drawn(days, trials):
        at, strength = _strongest(series)
        strengths.append(strength)
        edges.append(float(np.quantile(_memory(series, at), DOUBT)))
    return np.array(strengths), np.maximum.accumulate(edges)


def _drawn(days: int, trials: int) -> Iterator[Column]:
    """(t, n) series without change or slope, for each of MEMORIES."""
    from scipy.signal import lfilter  # a third of a second to import

    fresh = np.random.default_rng(0).standard_normal((trials, days + _FORGOTTEN))
    for memory in MEMORIES:
        yield lfilter([1.0], [1.0, -memory], fresh, axis=1)[:, _FORGOTTEN:]


def _beyond(strengths: Column, strength: float) -> float:
    return (float(np.sum(strengths >= strength - 1e-12)) + 1.0) / (len(strengths) + 1.0)


def _strongest(series: Column) -> tuple[Column, Column]:
    """(t,) in which of (t, n) series two means differ most, and (t,) the share of their variation that this is."""
    days = series.shape[1]
    split = np.arange(FEWEST_DAYS, days - FEWEST_DAYS + 1)
    centred = series - series.mean(axis=1, keepdims=True)
    sums = np.cumsum(centred, axis=1)[:, split - 1]
    between = sums**2 * days / (split * (days - split))
    variation = np.maximum(np.sum(centred**2, axis=1), 1e-300)
    return FEWEST_DAYS + np.argmax(between, axis=1), between.max(axis=1) / variation


def _memory(series: Column, at: Column) -> Column:
    """(t,) correlation of a day with the day before, beside the change of level at the index `at` (t,)."""
    early = np.arange(series.shape[1]) < at[:, None]
    late = ~early
    before = np.sum(series * early, axis=1) / early.sum(axis=1)
    after = np.sum(series * late, axis=1) / late.sum(axis=1)
    return _correlation(series - np.where(early, before[:, None], after[:, None]))


def _correlation(left: Column) -> Column:
    """(t,) of a day with the day before, of what is left (t, n)."""
    power = np.maximum(np.sum(left**2, axis=1), 1e-300)
    out: Column = np.sum(left[:, 1:] * left[:, :-1], axis=1) / power
    return out


def slope(days: Column, values: Column) -> tuple[float, float, float] | None:
    """The Theil-Sen slope of `values` (n,) over `days` (n,), and its 95 % interval (Sen, J. Am. Stat. Assoc. 63, 1968,
    1379), for days that remember the day before as much as these may: the variance of Kendall's score grows by (1 +
    memory) / (1 - memory) (Hamed and Rao, J. Hydrol. 204, 1998, 182). None of fewer than FEWEST_FOR_SLOPE dates, which
    have no such interval."""
    if len(np.unique(days)) < FEWEST_FOR_SLOPE:
        return None
    from scipy.stats import theilslopes  # two thirds of a second to import

    edges = _without_slope(tuple(days.tolist()))
    memory = float(np.interp(_correlation(_beside_slope(days, values[None, :]))[0], edges, MEMORIES))
    beyond = 2.0 * float(ndtr(-NORMAL_95 * np.sqrt((1.0 + memory) / (1.0 - memory))))
    found, _, low, high = theilslopes(values, days, alpha=beyond)
    return float(found), float(low), float(high)


@lru_cache(maxsize=64)
def _without_slope(days: tuple[float, ...]) -> Column:
    """(m,) the memory that series of these days seem to have, of which only the share DOUBT seems to have less."""
    series = _drawn(len(days), LEAST_SERIES)
    seem = [np.quantile(_correlation(_beside_slope(np.array(days), some)), DOUBT) for some in series]
    return np.maximum.accumulate(seem)


def _beside_slope(days: Column, series: Column) -> Column:
    """(t, n) what is left of (t, n) series beside their straight lines."""
    centred, since = series - series.mean(axis=1, keepdims=True), days - days.mean()
    out: Column = centred - np.outer(centred @ since / (since @ since), since)
    return out
