"""Outliers: up to three samples in a row that stand so far from both neighbours that the joint cannot have gone there
and come back. They are taken out before anything is computed, and reported.

A pulse on the sensor's line is one; samples that fall to the same rail again and again are drop-outs
(`rig.gap.records.cleaning.dropouts`), and many that scatter are noise, which is left as it is.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from rig.columns import usual_step
from rig.gap.records.cleaning.dropouts import Dropouts, Rows, without_dropouts
from rig.gap.records.settings import FAR_OUT, MOST_OUTLIERS, OUTLIER_ROWS, RETURNS, SPREAD_QUANTILE
from rig.number_text import counted
from rig.record import MEASURED_COLUMNS, Column, Record

IN_WORDS: Final = {
    "angle_deg": ("the angle", "deg"), "p1_mpa": ("the monitor of p1", "MPa"), "p2_mpa": ("the monitor of p2", "MPa")
}  # fmt: skip
"""Each measured column in words, and its unit."""


@dataclass(frozen=True)
class Cleaned:
    """The records of one day with fallen samples and outliers missing (NaN)."""

    records: list[Record]
    dropouts: list[tuple[Dropouts, ...]]
    """What fell in each record."""
    notes: list[str]
    """Which outliers were taken out."""


def without_falls(records: Sequence[Record], kind: str = "") -> Cleaned:
    """The records of one day without what no joint did; `kind`: what an earlier day's record is called in a note."""
    risen, dropouts = without_dropouts(records)
    found = [_without_outliers(record) for record in risen]
    notes = [f"{kind}{record.name}: {line}" for record, lines in found for line in lines]
    return Cleaned([record for record, _ in found], dropouts, notes)


def fall_notes(cleaned: Cleaned) -> list[str]:
    """A note for each column of each record in which samples fell to a rail."""
    return [
        f"{record.name}: {counted(int(one.fallen.sum()), 'sample')} of {IN_WORDS[one.column][0]} fell to a rail, which "
        f"reads {one.level:.4g} {IN_WORDS[one.column][1]}; left out"
        for record, mine in zip(cleaned.records, cleaned.dropouts, strict=True)
        for one in mine
    ]


def _without_outliers(record: Record) -> tuple[Record, list[str]]:
    """The record with outliers missing (NaN), and for each column in which some were what was taken out."""
    changed, taken_out = dict[str, Column](), list[str]()
    for name in MEASURED_COLUMNS:
        column = getattr(record, name)
        rows = None if column is None else outliers(column)
        if column is not None and rows is not None and rows.any():
            changed[name] = np.where(rows, np.nan, column)
            worst = float(column[rows][np.argmax(np.abs(column[rows] - np.nanmedian(column)))])
            count = int(rows.sum())
            what = "sample stands" if count == 1 else "samples stand"
            spoken, unit = IN_WORDS[name]
            taken_out.append(
                f"{count} {what} far from both neighbours in {spoken}, the farthest reads {worst:.4g} {unit}; left out"
            )
    return (replace(record, **changed) if changed else record), taken_out  # type: ignore[arg-type]


def outliers(column: Column) -> Rows:
    """(n,) True in the outliers of a column (n,); none where more than MOST_OUTLIERS of it stand out: that is noise."""
    out = np.zeros(len(column), dtype=bool)
    known = np.flatnonzero(np.isfinite(column))
    values = column[known]
    for width in range(1, OUTLIER_ROWS + 1):
        if len(values) > width + 1:
            out[known] |= _excursions(values, width)
    return out if out.sum() <= MOST_OUTLIERS * len(column) else np.zeros(len(column), dtype=bool)


def _excursions(values: Column, width: int) -> Rows:
    """(n,) True in runs of `width` samples that all lie on one side of both neighbours, by FAR_OUT times what the
    column usually does in that time, or of its converter's step."""
    before, after = values[: -width - 1], values[width + 1 :]
    middle, last = 0.5 * (before + after), len(before)
    off = np.array([values[1 + row : 1 + row + last] - middle for row in range(width)])
    lowest, highest = off.min(axis=0), off.max(axis=0)
    depth = np.maximum(lowest, -highest)
    sizes, rows = np.maximum(highest, -lowest), np.zeros(len(values), dtype=bool)
    reach = depth.max() / FAR_OUT
    if np.count_nonzero(sizes >= reach) >= last - math.floor(SPREAD_QUANTILE * (last - 1)):
        return rows  # most columns are done here: the quantile is at least that, and takes a sort
    usual = float(np.quantile(sizes, SPREAD_QUANTILE))
    if reach <= usual:
        return rows
    stands = (depth > FAR_OUT * max(usual, usual_step(values))) & (np.abs(after - before) < RETURNS * depth)
    for at in np.flatnonzero(stands):
        rows[at + 1 : at + 1 + width] = True
    return rows
