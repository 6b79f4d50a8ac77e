"""Rows that repeat the row before exactly, where samples are lost, and records without them."""

from dataclasses import replace

import numpy as np

from rig.gap.records.dropouts import Rows
from rig.record import Column, Record

Lost = tuple[Rows, Rows | None, Rows | None]
"""Rows of the angle, p1 and p2 that were lost, (n,) each."""


def lost_rows(record: Record) -> Lost:
    """Where each column repeats its row before exactly: a line may lose the sample of one sensor, or whole packets."""

    def repeats(column: Column) -> Rows:
        return np.concatenate([[False], np.diff(column) == 0])

    assert record.angle_deg is not None
    p1, p2 = (None if column is None else repeats(column) for column in (record.p1_mpa, record.p2_mpa))
    return repeats(record.angle_deg), p1, p2


def without_lost(record: Record, lost: Lost) -> Record:
    """The record with straight lines over lost samples.

    Done to the baselines in the same rows, it leaves no difference but the case's own. What is missing stays missing.
    """

    def over(column: Column | None, rows: Rows | None) -> Column | None:
        if column is None or rows is None:
            return column
        gone = np.pad(rows[: len(record)], (0, max(len(record) - len(rows), 0)))
        kept = ~gone & np.isfinite(column)
        return np.where(gone & np.isfinite(column), np.interp(record.t_s, record.t_s[kept], column[kept]), column)

    angle, p1, p2 = (over(*each) for each in zip((record.angle_deg, record.p1_mpa, record.p2_mpa), lost, strict=True))
    return replace(record, angle_deg=angle, p1_mpa=p1, p2_mpa=p2)
