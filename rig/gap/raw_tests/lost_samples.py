"""When samples were lost: rows that repeat the row before exactly; and records without them."""

from dataclasses import dataclass, replace

import numpy as np

from rig.gap.raw_tests.settings import GOES_WITH_LOST
from rig.gap.records.cleaning.dropouts import Rows
from rig.record import Column, Record


@dataclass(frozen=True)
class LostSamples:
    """When a record lost samples, on its own clock (s), (m,) for each column; None for one that was not measured. A
    line may lose the sample of one sensor, or whole packets."""

    angle_s: Column
    p1_s: Column | None
    p2_s: Column | None
    period_s: float

    def rows(self, t_s: Column, lost_s: Column) -> Rows:
        """(n,) which rows at these times go with the lost ones."""
        return np.abs(t_s - _nearest(lost_s, t_s)) < GOES_WITH_LOST * self.period_s


def lost_samples(record: Record) -> LostSamples:
    """Where each column repeats its row before exactly."""

    def repeats(column: Column) -> Column:
        times: Column = record.t_s[1:][np.diff(column) == 0]
        return times

    assert record.angle_deg is not None
    p1, p2 = (None if column is None else repeats(column) for column in (record.p1_mpa, record.p2_mpa))
    return LostSamples(repeats(record.angle_deg), p1, p2, record.period_s)


def without_lost(record: Record, lost: LostSamples) -> Record:
    """The record with straight lines over lost samples.

    Done to the baselines, which are on the same clock, at the same times, it leaves no difference but the case's own.
    What is missing stays missing.
    """

    def over(column: Column | None, lost_s: Column | None) -> Column | None:
        if column is None or lost_s is None or not len(lost_s):
            return column
        gone = lost.rows(record.t_s, lost_s)
        kept = ~gone & np.isfinite(column)
        return np.where(gone & np.isfinite(column), np.interp(record.t_s, record.t_s[kept], column[kept]), column)

    return replace(
        record,
        angle_deg=over(record.angle_deg, lost.angle_s),
        p1_mpa=over(record.p1_mpa, lost.p1_s),
        p2_mpa=over(record.p2_mpa, lost.p2_s),
    )


def _nearest(among: Column, t_s: Column) -> Column:
    """(n,) the nearest of some ordered times to each."""
    after = np.clip(np.searchsorted(among, t_s), 1, max(len(among) - 1, 1))
    before, later = among[after - 1], among[np.minimum(after, len(among) - 1)]
    return np.where(np.abs(t_s - before) <= np.abs(t_s - later), before, later)
