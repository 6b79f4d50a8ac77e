"""A rig over many days: when its gap changed (`rig.gap.change_points`), when a cause appeared, and how it grows, by the
Theil-Sen slope."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.stats import theilslopes

from rig.channels import PNEUMATIC, Channels
from rig.gap.answer.result import Diagnosis, Interval
from rig.gap.change_points import FEWEST_DAYS, change_points
from rig.gap.hypotheses.library import LIBRARY
from rig.record import Column

GAP: Final = "gap_deg"
"""The quantity of a change in the gap itself; any other is an effect's name."""
FALSE_ALARM_RATE: Final = 0.01
"""Of a series without a change. Less: later and larger changes only."""


@dataclass(frozen=True)
class Day:
    """What one day's diagnosis says; numbers of a rig with a channel map are working values."""

    name: str
    days: float
    """Since the first."""
    gap_deg: float
    floor_deg: float
    verdict: str
    sizes: Mapping[str, Interval]
    """Effect -> its size."""
    said: Mapping[str, str] = field(default_factory=dict)
    """Tags and note of its records."""
    channels: Channels = PNEUMATIC
    """What input and output of the rig are."""


@dataclass(frozen=True)
class Change:
    """A day from which on a quantity is another."""

    quantity: str
    day: str
    """The first of the new level."""
    before: float
    after: float
    p_value: float


@dataclass(frozen=True)
class Growth:
    """How an effect's size moves with time."""

    effect: str
    first_day: str
    unit: str
    per_day: float
    low: float
    high: float
    """95 % interval of the slope."""


@dataclass(frozen=True)
class History:
    """Days in order of time, with what changed and what grows."""

    days: tuple[Day, ...]
    changes: tuple[Change, ...]
    growth: tuple[Growth, ...]

    @property
    def channels(self) -> Channels:
        """What input and output of the rig are."""
        return self.days[0].channels if self.days else PNEUMATIC


def look_back(days: Sequence[Day]) -> History:
    """What many days show together."""
    return History(tuple(days), tuple(changes(days)), tuple(growth(days)))


def day_of(name: str, days: float, diagnosis: Diagnosis) -> Day:
    """The day of a diagnosis."""
    sizes = {
        cause.effect: size
        for cause in diagnosis.causes
        if (size := size_of(cause.effect, cause.parameters)) is not None
    }
    said = diagnosis.evidence.said
    gap, floor = diagnosis.gap.rms_deg, diagnosis.gap.floor_deg
    return Day(name, days, gap, floor, diagnosis.verdict.value, sizes, said, diagnosis.channels)


def changes(days: Sequence[Day], seed: int = 0) -> list[Change]:
    """Where gap and sizes change, with the medians between one change and the next; a day on which an effect is not
    named has a size of 0."""
    effects = dict.fromkeys(effect for day in days for effect in day.sizes)
    series = {GAP: np.array([day.gap_deg for day in days])} | {effect: sizes_of(days, effect) for effect in effects}
    found = []
    for quantity, values in series.items():
        points = change_points(values, FALSE_ALARM_RATE / len(series), seed)
        edges = [0, *(at for at, _ in points), len(values)]
        levels = [float(np.median(values[start:end])) for start, end in pairwise(edges)]
        for (at, p_value), (before, after) in zip(points, pairwise(levels), strict=True):
            found.append(Change(quantity, days[at].name, before, after, p_value))
    return found


def growth(days: Sequence[Day]) -> list[Growth]:
    """The slope of every effect that is named on three days or more, from its first day on."""
    found = []
    for effect in dict.fromkeys(effect for day in days for effect in day.sizes):
        named = [day for day in days if effect in day.sizes]
        times = np.array([day.days for day in named])
        if len(named) < FEWEST_DAYS or np.ptp(times) == 0.0:
            continue
        slope, _, low, high = theilslopes([day.sizes[effect].value for day in named], times)
        unit = named[0].sizes[effect].unit
        found.append(Growth(effect, named[0].name, unit, float(slope), float(low), float(high)))
    return found


def sizes_of(days: Sequence[Day], effect: str) -> Column:
    """(d,) an effect's size on every day, 0 where it is not named."""
    return np.array([day.sizes[effect].value if effect in day.sizes else 0.0 for day in days])


def size_of(effect: str, parameters: Mapping[str, Interval]) -> Interval | None:
    """The number that says how large an effect is: the first that its laws fit."""
    if effect not in LIBRARY:
        return None
    sizes = [law.free[0] for law in LIBRARY[effect].laws]
    return next((parameters[name] for name in sizes if name in parameters), None)
