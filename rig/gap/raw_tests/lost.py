"""Noise and samples that were lost: rows that repeat the row before exactly, how many do so by chance, and what is put in their place."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from rig.record import Column, Record

Lost = tuple["np.typing.NDArray[np.bool_]", "np.typing.NDArray[np.bool_]"]


def angles_of(records: Sequence[Record]) -> list[Column]:
    return [record.angle_deg[np.isfinite(record.angle_deg)] for record in records if record.angle_deg is not None]


def high_rms(angle_deg: Column) -> float:
    """Rms of white noise (deg) that would have these second differences."""
    known = angle_deg[np.isfinite(angle_deg)]
    return float(np.sqrt(np.mean(np.diff(known, 2) ** 2) / 6.0))


def loudness(case: Column, healthy: Sequence[Column], change: Column) -> tuple[float, float, float]:
    """(G, E, F) of the noise's rms: case against healthy days, what is left with `change` (deg) added to them, and between them."""
    quiet = [high_rms(day) for day in healthy]
    base, now = float(np.mean(quiet)), high_rms(case)
    rows = min(len(change), *(len(day) for day in healthy))
    predicted = float(np.mean([high_rms(day[:rows] + change[:rows]) for day in healthy]))
    return (now - base) ** 2, (now - predicted) ** 2, float(np.var(quiet))


def repeat_share(records: Sequence[Record], least: float) -> tuple[float, float, int]:
    """Among rows where the angle moves by more than `least` a row: the share of exact repeats, by how many steps the row after
    them goes on, and how many rows there are. After a lost sample it goes on by two, in a dead spot or on a lattice by one."""
    still, onward, rows = 0, 0.0, 0
    for angle in angles_of(records):
        slope = np.gradient(gaussian_filter1d(angle, 6.0))[1:-1]
        moving = np.abs(slope) > max(least, float(np.quantile(np.abs(slope), 0.4)), 1e-9)
        steps = np.diff(angle)
        repeats = (steps[:-1] == 0) & moving
        still += int(repeats.sum())
        onward += float(np.sum(steps[1:][repeats] / slope[repeats]))
        rows += int(moving.sum())
    return still / max(rows, 1), onward / max(still, 1), rows


def share_by_chance(records: Sequence[Record], least: float, step: float) -> float:
    """Share of repeats among moving rows that the records' own noise and lattice give by chance: the same noise dealt anew."""
    if step <= 0.0:
        return 0.0
    random = np.random.default_rng(0)
    dealt = []
    for record, angle in zip(records, angles_of(records), strict=True):
        smooth = gaussian_filter1d(angle, 6.0)
        dealt.append(replace(record, angle_deg=step * np.round((smooth + random.permutation(angle - smooth)) / step)))
        dealt[-1] = replace(dealt[-1], t_s=record.t_s[: len(angle)])
    return repeat_share(dealt, least)[0]


def lost_rows(record: Record) -> Lost:
    """(n,) True where the angle repeats the row before exactly, and where the whole packet does."""
    assert record.angle_deg is not None
    lost = np.concatenate([[False], np.diff(record.angle_deg) == 0])
    packet = lost.copy()
    for column in (record.p1_mpa, record.p2_mpa):
        packet[1:] &= np.diff(column) == 0 if column is not None else False
    return lost, packet


def bridged(record: Record, lost: Lost) -> Record:
    """The record with straight lines over lost samples: of the angle, and of the pressures where the whole packet was lost.

    Done to the baselines in the same rows, it leaves no difference but the case's own.
    """
    rows = min(len(record), len(lost[0]))
    angle, packet = (np.pad(one[:rows], (0, len(record) - rows)) for one in lost)

    def over(column: Column | None, gone: "np.typing.NDArray[np.bool_]") -> Column | None:
        return None if column is None else np.where(gone, np.interp(record.t_s, record.t_s[~gone], column[~gone]), column)

    return replace(
        record,
        angle_deg=over(record.angle_deg, angle),
        p1_mpa=over(record.p1_mpa, packet),
        p2_mpa=over(record.p2_mpa, packet),
    )
