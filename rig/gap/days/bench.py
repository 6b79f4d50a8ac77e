"""Where effects are tried: one side of the chain with everything that its response under causes needs.

What is tried there, and how it is ranked, is in `rig.gap.days.attribute`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rig.gap.days.side import Side
from rig.gap.days.trigger import Trigger, trigger
from rig.gap.hypotheses.propagate import (
    Applied,
    Ready,
    Track,
    angle_under,
    angle_with,
    pressures_with,
    ready,
    response_with,
)
from rig.gap.reference.nominal import Nominal
from rig.record import Column


@dataclass(frozen=True)
class Bench:
    """Where effects are tried: the tracks, the frozen rig, the side that is looked at, and what is already taken for
    granted."""

    tracks: Sequence[Track]
    nominal: Nominal
    side: Side
    driven: bool = False
    """The angle is judged under the case's own pressures, not under its commands."""
    beside: Side | None = None
    """The pressures' side where they were measured and show no plain gap: what is upstream must fit it, too."""
    accepted: tuple[Applied, ...] = ()

    def on(self, chosen: Sequence[int]) -> "Bench":
        """The same with only some of the records."""
        beside = None if self.beside is None else self.beside.on(chosen)
        return replace(self, tracks=[self.tracks[k] for k in chosen], side=self.side.on(chosen), beside=beside)

    def predicted(self, causes: Sequence[Applied]) -> Column:
        """(n,) what this side would have read with these causes."""
        everything = ready([*self.accepted, *causes], self.nominal)
        if self.side.name == "valve":
            both = [pressures_with(everything, track, self.nominal) for track in self.tracks]
            return np.concatenate([one[0] for one in both] + [one[1] for one in both])
        return np.concatenate([self._angle(everything, track) for track in self.tracks])

    @cached_property
    def valves(self) -> "Bench | None":
        """The same on the pressures' side, where upstream effects must fit as well."""
        return None if self.beside is None else Bench(self.tracks, self.nominal, self.beside, accepted=self.accepted)

    def ruled_out(self, causes: Sequence[Applied]) -> bool:
        """Whether the pressures speak against causes: they show no plain gap, and with these they would."""
        valves = self.valves
        if valves is None:
            return False
        left = (valves.measured - valves.predicted(causes)) * valves.used
        would = trigger(valves.side, left)
        return would.found and would.strength > valves.sign.strength

    @cached_property
    def sign(self) -> Trigger:
        """Whether the side has a gap at all, and by what."""
        return trigger(self.side)

    @cached_property
    def measured(self) -> Column:
        """(n,) what it did read; of the pressures, without what a joint that moves otherwise did to them."""
        if self.side.name == "valve":
            references = [track.reference for track in self.tracks]
            return (
                np.concatenate([one.p1_mpa for one in references] + [one.p2_mpa for one in references]) + self.side.gap
            )
        return np.concatenate([track.pair.case.angle_deg for track in self.tracks])

    @cached_property
    def used(self) -> Column:
        """(n,) 1 where the side was measured."""
        once = np.concatenate([track.pair.used for track in self.tracks])
        return np.tile(once, 2) if self.side.name == "valve" else once

    @cached_property
    def scales(self) -> dict[str, float]:
        """What the laws' grids count in, from the healthy rig's records."""
        return law_scales(self.tracks)

    def _angle(self, causes: Sequence[Ready], track: Track) -> Column:
        if self.driven:
            p1, p2 = case_pressures(track)
            return angle_with(causes, p1, p2, angle_under(p1, p2, track, self.nominal), track, self.nominal)
        return response_with(causes, track, self.nominal)[2]


def case_pressures(track: Track) -> tuple[Column, Column]:
    """The case's pressures: as measured, or what is known better (`Track.driven_by`)."""
    if track.driven_by is not None:
        return track.driven_by
    case = track.pair.case
    if case.p1_mpa is None or case.p2_mpa is None:
        raise ValueError(f"{track.pair.name}: no pressures")
    return case.p1_mpa, case.p2_mpa


def law_scales(tracks: Sequence[Track]) -> dict[str, float]:
    """What the laws' grids count in, from the expected courses of the records."""
    references = [track.reference for track in tracks]
    high = max(float(reference.angle_deg.max()) for reference in references)
    low = min(float(reference.angle_deg.min()) for reference in references)
    pressures = [column for reference in references for column in (reference.p1_mpa, reference.p2_mpa)]
    top, bottom = max(float(column.max()) for column in pressures), min(float(column.min()) for column in pressures)
    rates = np.concatenate([np.diff(column) / track.pair.dt_s for track in tracks for column in track.regulated])
    return {
        "one": 1.0,
        "span_deg": 0.5 * (high - low),
        "high_deg": high,
        "low_deg": low,
        "top_mpa": top,
        "swing_mpa": top - bottom,
        "rate_mpa_s": float(np.quantile(np.abs(rates), 0.998)) + 1e-9,
    }
