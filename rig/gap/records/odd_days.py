"""Earlier days that disagree with the others: the rig had a fault on that day, or it was another rig.

Taken for healthy, such a day would make the rig's days differ by as much as the fault does, so that the same fault on
the day under test would stay within what days differ by. The records under test are not looked at here.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from statistics import median

import numpy as np

from rig.gap.records.alignment import on_clock_of
from rig.gap.records.partners import find_partner
from rig.gap.records.settings import ODD_CHANNELS, ODD_RATIO, TWO_APART
from rig.record import Column, Record

Day = Sequence[Record]
_Courses = Mapping[int, Mapping[str, Column]]
"""Day, by its number from 0 -> its channels (n,) under one command, all days' at the same times; missing where a day
did not run."""


def odd_days(days: Sequence[Day]) -> dict[int, str]:
    """Number (from 0) of each day that is farther from the others than those are from each other -> how far; none of
    less than three, where nobody can say which."""
    if len(days) < 3:
        return {}
    under = _by_command(days)
    between = {channel: _distances(channel, under, len(days)) for channel in ODD_CHANNELS}
    found = {}
    for number in range(len(days)):
        apart = [distance for channel in ODD_CHANNELS if (distance := _odd_in(channel, number, between[channel]))]
        if apart:
            found[number] = ", ".join(apart)
    return found


def two_apart(first: Day, second: Day) -> str:
    """How far two days are apart where that is more than a rig's days usually differ by; else nothing."""
    both = [one for one in _by_command([first, second]) if all("angle_deg" in one.get(day, ()) for day in (0, 1))]
    apart = _distances("angle_deg", both, 2)
    if not apart:
        return ""
    spread = median(float(np.nanstd(one[0]["angle_deg"])) for one in both)
    if apart[0, 1] <= max(TWO_APART * spread, ODD_CHANNELS["angle_deg"][0]):
        return ""
    return f"{apart[0, 1]:.2g} deg (rms), {100 * apart[0, 1] / spread:.0f} % of the angle's spread"


def _odd_in(channel: str, number: int, between: Mapping[tuple[int, int], float]) -> str:
    """How far that day is from the others in the channel, where that is too far; else nothing."""
    floor, unit = ODD_CHANNELS[channel]
    own = [distance for pair, distance in between.items() if number in pair]
    others = [distance for pair, distance in between.items() if number not in pair]
    if not own or not others or median(own) <= max(ODD_RATIO * median(others), floor):
        return ""
    usually = f"which are {median(others):.2g} {unit} from each other"
    return f"its {channel.rpartition('_')[0]} is {median(own):.2g} {unit} (rms) from theirs, {usually}"


def _distances(channel: str, under: Sequence[_Courses], days: int) -> dict[tuple[int, int], float]:
    """How far each two days are apart in that channel: rms after the mean, the median over the commands of both."""
    found = {}
    for both in combinations(range(days), 2):
        pairs = [(one[both[0]], one[both[1]]) for one in under if all(day in one for day in both)]
        shown = [a[channel] - b[channel] for a, b in pairs if channel in a and channel in b]
        apart = [float(np.nanstd(each)) for each in shown if np.isfinite(each).any()]
        if apart:
            found[both] = median(apart)
    return found


def _by_command(days: Sequence[Day]) -> Sequence[_Courses]:
    """What the days did under each command and condition, as a diagnosis pairs records."""
    commands: list[Record] = []
    under: list[dict[int, dict[str, Column]]] = []
    for number, day in enumerate(days):
        for record in day:
            partner, _ = find_partner(record, commands, number) if commands else (None, None)
            if partner is None:
                commands.append(record)
                under.append({number: _channels(record, record.t_s - record.t_s[0])})
                continue
            place = next(k for k, command in enumerate(commands) if command is partner.record)
            under[place].setdefault(number, _channels(record, on_clock_of(partner.record, partner.alignment)))
    return under


def _channels(record: Record, at_s: Column) -> dict[str, Column]:
    """The channels that it has, at times from its start; missing where it did not run."""
    columns = {channel: getattr(record, channel) for channel in ODD_CHANNELS}
    return {
        channel: np.interp(at_s, record.t_s - record.t_s[0], column, left=np.nan, right=np.nan)
        for channel, column in columns.items()
        if column is not None
    }
