"""Earlier days that do not go with the others: the rig was not well then, or it was another rig.

Taken for healthy, such a day makes the rig's days differ by as much as its illness changes, and a rig that has it again
differs from them by no more than that. Nothing of the records under test is looked at here.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from statistics import median

import numpy as np

from rig.gap.records.alignment import on_clock_of
from rig.gap.records.partners import Partner, find_partner
from rig.gap.records.settings import ODD_CHANNELS, ODD_RATIO, TWO_APART
from rig.record import Record

Day = Sequence[Record]
_Pairs = Mapping[tuple[int, int], Sequence[tuple[Record, Partner]]]
"""Two days, by their numbers from 0 -> their records of one command under one condition."""


def odd_days(days: Sequence[Day]) -> dict[int, str]:
    """Number (from 0) of each day that is farther from the others than those are from each other -> how far; none of
    less than three, where nobody can say which."""
    if len(days) < 3:
        return {}
    pairs = {(k, m): list(_pairs(days[k], days[m])) for k, m in combinations(range(len(days)), 2)}
    between = {channel: _distances(channel, pairs) for channel in ODD_CHANNELS}
    found = {}
    for number in range(len(days)):
        apart = [said for channel in ODD_CHANNELS if (said := _odd_in(channel, number, between[channel]))]
        if apart:
            found[number] = ", ".join(apart)
    return found


def two_apart(first: Day, second: Day) -> str:
    """How far two days are apart where that is more than a rig's days usually differ by; else nothing."""
    pairs = list(_pairs(first, second))
    apart = [distance for a, b in pairs if (distance := _apart("angle_deg", a, b)) is not None]
    spreads = [float(np.nanstd(a.angle_deg)) for a, _ in pairs if a.angle_deg is not None]
    if not apart or median(apart) <= max(TWO_APART * median(spreads), ODD_CHANNELS["angle_deg"][0]):
        return ""
    return f"{median(apart):.2g} deg (rms), {100 * median(apart) / median(spreads):.0f} % of the angle's spread"


def _odd_in(channel: str, number: int, between: Mapping[tuple[int, int], float]) -> str:
    """How far that day is from the others in the channel, where that is too far; else nothing."""
    floor, unit = ODD_CHANNELS[channel]
    own = [distance for pair, distance in between.items() if number in pair]
    others = [distance for pair, distance in between.items() if number not in pair]
    if not own or not others or median(own) <= max(ODD_RATIO * median(others), floor):
        return ""
    usually = f"which are {median(others):.2g} {unit} from each other"
    return f"its {channel.rpartition('_')[0]} is {median(own):.2g} {unit} (rms) from theirs, {usually}"


def _distances(channel: str, pairs: _Pairs) -> dict[tuple[int, int], float]:
    """How far each two days are apart in that channel: the median over the records that both have."""
    found = {}
    for both, records in pairs.items():
        apart = [distance for a, b in records if (distance := _apart(channel, a, b)) is not None]
        if apart:
            found[both] = median(apart)
    return found


def _pairs(first: Day, second: Day) -> Iterator[tuple[Record, Partner]]:
    """What pairs with what, as a diagnosis pairs it."""
    for record in first if second else ():
        partner, _ = find_partner(record, second, 0)
        if partner is not None:
            yield record, partner


def _apart(channel: str, record: Record, partner: Partner) -> float | None:
    """rms of the difference after its mean, where both run; None where one lacks the channel."""
    mine, theirs = getattr(record, channel), getattr(partner.record, channel)
    if mine is None or theirs is None:
        return None
    clock = on_clock_of(partner.record, partner.alignment)
    difference = mine - np.interp(record.t_s - record.t_s[0], clock, theirs, left=np.nan, right=np.nan)
    return float(np.nanstd(difference)) if np.isfinite(difference).any() else None
