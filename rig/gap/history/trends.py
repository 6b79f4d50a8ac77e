"""A rig over many days: when its gap changed (`rig.gap.history.change_points`), when a cause appeared, and how it
grows, by the Theil-Sen slope."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

import numpy as np

from rig.channels import PNEUMATIC, Channels
from rig.gap.answer.result import Diagnosis, Interval
from rig.gap.history.change_points import change_points, slope
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.settings import FALSE_ALARM_RATE
from rig.model.effect_stages import EFFECT_STAGES
from rig.record import Column

GAP: Final = "gap_deg"
"""The quantity of a change in the gap itself; any other is an effect's size, see `size_of`."""
BY: Final = " by "
"""Between an effect and its number, in a quantity."""


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
    """Quantity -> the size of the effect that it belongs to, see `size_of`."""
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
    """As a quantity, see `size_of`."""
    first_day: str
    unit: str
    per_day: float
    low: float
    high: float
    """95 % interval of the slope, which holds for days that remember the day before, too."""


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
    named = (size_of(cause.effect, cause.parameters) for cause in diagnosis.causes)
    sizes = {quantity: size for one in named for quantity, size in one.items()}
    gap, floor, tags = diagnosis.gap.smoothed_deg, diagnosis.gap.floor_deg, diagnosis.evidence.said
    return Day(name, days, gap, floor, diagnosis.verdict.value, sizes, tags, diagnosis.channels)


def changes(days: Sequence[Day], seed: int = 0) -> list[Change]:
    """Where gap and sizes change, with the medians between one change and the next."""
    series = {GAP: (list(days), np.array([day.gap_deg for day in days]))}
    series |= {quantity: sizes_of(days, quantity) for quantity in _quantities(days)}
    found = []
    for quantity, (known, values) in series.items():
        points = change_points(values, FALSE_ALARM_RATE / len(series), seed)
        edges = [0, *(at for at, _ in points), len(values)]
        levels = [float(np.median(values[start:end])) for start, end in pairwise(edges)]
        for (at, p_value), (before, after) in zip(points, pairwise(levels), strict=True):
            found.append(Change(quantity, known[at].name, before, after, p_value))
    return found


def growth(days: Sequence[Day]) -> list[Growth]:
    """The slope of every size that is told on days enough (`change_points.slope`), from its first day on."""
    found = []
    for quantity in _quantities(days):
        named = [day for day in days if quantity in day.sizes]
        times = np.array([day.days for day in named])
        moves = slope(times, np.array([day.sizes[quantity].value for day in named]))
        if moves is not None:
            found.append(Growth(quantity, named[0].name, named[0].sizes[quantity].unit, *moves))
    return found


def _quantities(days: Sequence[Day]) -> list[str]:
    return list(dict.fromkeys(quantity for day in days for quantity in day.sizes))


def sizes_of(days: Sequence[Day], quantity: str) -> tuple[list[Day], Column]:
    """The days on which a size is known, and (d,) what it was: on those on which its effect is not named, what changes
    nothing. A day that tells the effect by another of its numbers says nothing of this one."""
    effect, nothing = quantity.partition(BY)[0], _neutral(quantity)
    others = {other for other in _quantities(days) if other.partition(BY)[0] == effect} - {quantity}
    known = [day for day in days if quantity in day.sizes or not others & day.sizes.keys()]
    return known, np.array([day.sizes[quantity].value if quantity in day.sizes else nothing for day in known])


def size_of(effect: str, parameters: Mapping[str, Interval]) -> dict[str, Interval]:
    """How large an effect is, by its quantity: the first number of the law by which it was found, named by the effect,
    and by the number where that is not the first law's (they have other units). None of an effect that is not known."""
    if effect not in LIBRARY:
        return {}
    names = list(dict.fromkeys(law.free[0] for law in LIBRARY[effect].laws))
    found = next((name for name in names if name in parameters), None)
    if found is None:
        return {}
    return {effect if found == names[0] else f"{effect}{BY}{found}": parameters[found]}


def _neutral(quantity: str) -> float:
    """The size that changes nothing."""
    effect, _, name = quantity.partition(BY)
    laws = LIBRARY[effect].laws
    law = next((law for law in laws if law.free[0] == name), laws[0])
    return EFFECT_STAGES[law.stage].neutral()[law.free[0]]
