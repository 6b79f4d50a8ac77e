"""`pamrig bench history`: how often a history of healthy days is said to have changed, and how often a change is found.

The false-alarm rate is promised for days that may come in any order; of days that remember each other it is measured
too.
"""

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.random import Generator

from rig.gap.history.trends import Day, changes
from rig.gap.settings import FALSE_ALARM_RATE
from rig.qualify.benchmarks import share
from rig.record import Column

SERIES: Final = 500
"""Histories of each kind."""
HISTORY_DAYS: Final = 20
"""Of a history: a month of working days."""
GAP_DEG: Final = 0.1
"""Of a healthy day, in the middle."""


def bench_history() -> dict[str, Any]:
    """False alarms of healthy histories, and changes found, in per cent with intervals."""
    kinds: dict[str, Callable[[Generator], Column]] = {
        "false alarms, normal days": lambda random: GAP_DEG + 0.02 * random.standard_normal(HISTORY_DAYS),
        "false alarms, log-normal days": lambda random: GAP_DEG * np.exp(0.5 * random.standard_normal(HISTORY_DAYS)),
        "false alarms, wild days (t, 2 degrees)": lambda random: GAP_DEG + 0.02 * random.standard_t(2, HISTORY_DAYS),
        "false alarms, 60 log-normal days": lambda random: (
            GAP_DEG * np.exp(0.5 * random.standard_normal(3 * HISTORY_DAYS))
        ),
        "false alarms, days that remember (correlation 0.5)": _remembering,
        "found: a step of 2 deviations": lambda random: _stepped(random, 2.0),
        "found: a step of 4 deviations": lambda random: _stepped(random, 4.0),
    }
    return {words: _changed(draw, false=words.startswith("false")) for words, draw in kinds.items()}


def _changed(draw: Callable[[Generator], Column], false: bool) -> dict[str, Any]:
    """Of how many histories a change is said, and whether that is a `false` one."""
    random = np.random.default_rng(17)
    changed = [bool(changes(_days(draw(random)), seed)) for seed in range(SERIES)]
    if false:
        return share(changed, better="lower", goal=100 * FALSE_ALARM_RATE, seeded=True, why="the rate is a promise")
    return share(changed, seeded=True, why="the size of the step is chosen here")


def _days(gaps_deg: Column) -> list[Day]:
    return [Day(f"day_{k}", float(k), float(gap), GAP_DEG, "none", {}) for k, gap in enumerate(gaps_deg)]


def _remembering(random: Generator) -> Column:
    """Each day half as far off as the day before, and half anew."""
    off = random.standard_normal(HISTORY_DAYS)
    for k in range(1, HISTORY_DAYS):
        off[k] = 0.5 * off[k - 1] + np.sqrt(0.75) * off[k]
    return GAP_DEG + 0.02 * off


def _stepped(random: Generator, deviations: float) -> Column:
    """From the middle on another level."""
    return GAP_DEG + 0.02 * (
        random.standard_normal(HISTORY_DAYS) + deviations * (np.arange(HISTORY_DAYS) >= HISTORY_DAYS // 2)
    )
