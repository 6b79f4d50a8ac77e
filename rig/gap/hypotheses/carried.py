"""What is unsure of a simulator's regulators, as it comes through a cause.

Rigs of one build differ by a third in how fast their regulators answer. Beside the commands a slower regulator and late
commands add up; a slower regulator whose commands come late is slower later, and taken as if it were not, a dead time
of 40 ms passes for a lag. Beside days of the rig itself the regulators are known to a percent, and it does not matter.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rig.gap.hypotheses.fit import Carried
from rig.gap.hypotheses.propagate import Ready, Track, pressures_with
from rig.gap.reference.expectation import REGULATOR_PATTERNS, REGULATOR_STEP, REGULATORS_VARIED
from rig.gap.reference.nominal import Reference
from rig.gap.settings import FactorLevels
from rig.model.response import Regulator, ResponseModel
from rig.record import Column


def carried_regulators(
    tracks: Sequence[Track], response: ResponseModel, names: Sequence[str], levels: FactorLevels
) -> Carried:
    """The patterns of the regulators of these tracks, by their names among the factor's."""
    varied = [_varied(tracks, response, times) for times in REGULATORS_VARIED]
    which = [names.index(name) for name in REGULATOR_PATTERNS]
    spread = np.array([levels.patterns[name] for name in REGULATOR_PATTERNS])
    plain = np.column_stack([one([]) for one in varied])

    def differs(causes: Sequence[Ready]) -> Column:
        return np.column_stack([one(causes) for one in varied]) - plain

    return Carried(which, spread, differs)


def _varied(
    tracks: Sequence[Track], response: ResponseModel, times: tuple[float, float]
) -> Callable[[Sequence[Ready]], Column]:
    """(n,) of both monitors, valve 1 of every record and then valve 2: what so many times the time constants of filling
    and exhausting change in them under causes, for a size of 1."""
    other = replace(response, regulators=tuple(_times(one, times) for one in response.regulators))
    both = [(track, _with_regulators(track, other)) for track in tracks]

    def change(causes: Sequence[Ready]) -> Column:
        pairs = [(pressures_with(causes, was, response), pressures_with(causes, now, other)) for was, now in both]
        first, second = ([now[valve] - was[valve] for was, now in pairs] for valve in (0, 1))
        out: Column = np.concatenate([*first, *second]) / REGULATOR_STEP
        return out

    return change


def _times(regulator: Regulator, times: tuple[float, float]) -> Regulator:
    dead_s, fill_s, exhaust_s = regulator
    return dead_s, times[0] * fill_s, times[1] * exhaust_s


def _with_regulators(track: Track, other: ResponseModel) -> Track:
    """The track as it would have been with other regulators."""
    pair, reference, was = track.pair, track.reference, track.regulated
    now = other.pressures(pair.u1_mpa, pair.u2_mpa, pair.dt_s)
    moved = Reference(reference.p1_mpa + now[0] - was[0], reference.p2_mpa + now[1] - was[1], reference.angle_deg)
    return replace(track, reference=moved, regulated=now)
