"""Lost samples that repeat the one before: found where the joint moves too fast for a repeat by chance.

Each class of speed has its own share of repeats by chance: that of the baselines, or of surrogates of the case, whose
own noise is shifted in time and rounded to its converter's step again. Rows weigh by how seldom they repeat by chance,
so that fast sweeps decide and slow ones do no harm.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.columns import filled_in
from rig.gap.raw_tests.noise_levels import Measure, angles_of
from rig.gap.raw_tests.settings import (
    CHANCE_SPREAD,
    LEAST_LOST,
    LEAST_LOUDER,
    LEAST_MOVING,
    LEAST_REPEATING,
    LOST_CLEAR,
    LOST_JUMP,
    LOST_MORE,
    LOST_PLACE,
    MOST_LOST,
    MOST_REPEATING,
    MOVING_QUANTILE,
    MOVING_STEPS,
    SLOPE_ROWS,
    SPEED_CLASSES,
    SPEEDS_PER_DOUBLING,
    SURROGATES,
)
from rig.gap.raw_tests.signature import Signature, on_days
from rig.gap.raw_tests.statistics import about, by_chance
from rig.gap.records.cleaning.dropouts import Rows
from rig.record import Column, Record
from rig.smoothing import smoothed

Places = tuple[Column, "NDArray[np.int64]"]
"""Angles (deg) of some rows and their classes of speed, (n,) each."""


@dataclass(frozen=True)
class Repeats:
    """Rows that move, by class of speed; columns of shape (SPEED_CLASSES,)."""

    rows: Column
    repeated: Column
    onward: Column
    """Sum over the repeats: one each, but for the last of a run the steps by which the row after it goes on. After lost
    samples that is two a repeat, however many are lost in a row; in a dead spot one."""
    runs: int
    """Runs of repeats in a row."""
    moving: Places
    """Of all rows that move."""
    still: Places
    """Of the repeats."""

    @property
    def share(self) -> float:
        """Of the rows that move, 0 to 1."""
        return float(self.repeated.sum() / max(self.rows.sum(), 1.0))


@dataclass(frozen=True)
class Chance:
    """What repeats without any lost sample, by class of speed; columns of shape (SPEED_CLASSES,)."""

    share: Column
    onward: Column
    """Steps a repeat, see `Repeats.onward`."""

    @property
    def weight(self) -> Column:
        """(SPEED_CLASSES,) what a repeat counts: the more, the seldomer one is by chance."""
        weights: Column = 1.0 / np.maximum(self.share, LEAST_REPEATING)
        return weights


@dataclass(frozen=True)
class Excess:
    """What repeats more than by chance, rows weighted by how seldom they do by chance."""

    share: float
    """Of lost samples."""
    chance: float
    """Repeats by chance that the same weights would take for lost samples."""
    spread: float
    """Standard deviation of `share` by the number of rows."""
    jump: float
    """Steps a repeat, see `Repeats.onward`."""


def repeated_samples(
    cases: Sequence[Record],
    sessions: Sequence[Sequence[Record]],
    step_deg: float,
    finer: bool,
    level_of: Measure,
) -> Signature:
    """The test for lost samples. `step_deg` is the coarsest quantisation step of case and baselines; `finer`: the
    baselines have it too."""
    least = MOVING_STEPS * step_deg
    own = count(cases, least)
    if own.rows.sum() < LEAST_MOVING and finer:
        least, own = 0.0, count(cases, 0.0)
    usual = [count(session, least) for session in sessions]
    chance = by_chance_at_speed(usual, _in_surrogates(cases, sessions, step_deg, least, level_of))
    found = excess(own, chance)
    days = [excess(day, chance) for day in usual]
    between = float(np.std([day.share for day in days])) if len(days) > 1 else CHANCE_SPREAD * found.chance
    spread = float(np.hypot(found.spread, between))
    lost = _is_lost(own, found, spread, chance)
    base = float(np.mean([day.share for day in usual])) if usual else 0.0
    text = f"{100 * own.share:.2f} % of the moving rows repeat the row before exactly"
    text += on_days(f"{100 * base:.2f} %", bool(usual))
    p = float(np.clip(found.share, 0.0, MOST_LOST))
    run = own.repeated.sum() / max(own.runs, 1)
    size = about(p, float(np.sqrt(max(2.0 * run - 1.0, 1.0) * _variance(own, chance, p) + between**2)), 0.0, MOST_LOST)
    moved = float(np.mean([np.nanmean(np.diff(angle) ** 2) for angle in angles_of(cases)]))
    return Signature(
        "repeated samples",
        "lost_samples",
        lost,
        value=own.share,
        baseline=base,
        unit="1",
        text=text,
        sizes={"probability": size},
        p_value=by_chance(found.share, spread),
        variance_deg2=p * moved if lost else 0.0,
        taken_out_deg2=p * moved if lost else 0.0,
    )


def _in_surrogates(
    cases: Sequence[Record], sessions: Sequence[Sequence[Record]], step_deg: float, least: float, level_of: Measure
) -> list[Repeats]:
    """What repeats in each surrogate of the case. None where it has no step, or where its earlier days are as loud and
    show repeats by chance themselves."""
    if step_deg <= 0.0 or (sessions and not _is_louder(cases, sessions, level_of)):
        return []
    parts = _motion_and_noise(cases, step_deg)
    return [count(_surrogate(parts, step_deg, seed), least) for seed in range(SURROGATES)]


def _is_lost(own: Repeats, found: Excess, spread: float, chance: Chance) -> bool:
    """Whether samples are lost: plainly more repeats than by chance, each goes on as after a lost one, and they lie
    where the angle lies."""
    return bool(
        own.rows.sum() >= LEAST_MOVING
        and found.share > max(LOST_CLEAR * spread, LEAST_LOST, LOST_MORE * found.chance)
        and found.jump > LOST_JUMP
        and _apart(own, chance) < LOST_PLACE
    )


def count(records: Sequence[Record], least: float) -> Repeats:
    """Exact repeats among rows where the angle moves by more than `least` (deg a row), by class of speed."""
    unit = max(least, 1e-9)
    rows, repeated, onward, runs = np.zeros(SPEED_CLASSES), np.zeros(SPEED_CLASSES), np.zeros(SPEED_CLASSES), 0
    moved: list[Places] = []
    stood: list[Places] = []
    for angle in angles_of(records):
        slope = np.gradient(smoothed(filled_in(angle), SLOPE_ROWS, mirrored=True))[1:-1]
        steps = np.diff(angle)
        known = np.isfinite(steps[:-1]) & np.isfinite(steps[1:]) & ~_beside_holes(angle)[1:-1]
        if not known.any():
            continue
        slowest = float(np.quantile(np.abs(slope[known]), MOVING_QUANTILE))
        moving = known & (np.abs(slope) > max(least, slowest, 1e-9))
        still = (steps[:-1] == 0) & moving
        goes_on = np.where(steps[1:] == 0, 1.0, steps[1:] / np.where(still, slope, 1.0))
        speed = np.zeros(len(slope), dtype=np.int64)
        if least > 0.0:
            doublings = SPEEDS_PER_DOUBLING * np.log2(np.maximum(np.abs(slope), unit) / unit)
            speed = np.clip(doublings.astype(np.int64), 0, SPEED_CLASSES - 1)
        rows += np.bincount(speed[moving], minlength=SPEED_CLASSES)
        repeated += np.bincount(speed[still], minlength=SPEED_CLASSES)
        onward += np.bincount(speed[still], weights=goes_on[still], minlength=SPEED_CLASSES)
        runs += int(np.sum(still[1:] & ~still[:-1]) + still[0])
        moved.append((angle[1:-1][moving], speed[moving]))
        stood.append((angle[1:-1][still], speed[still]))
    return Repeats(rows, repeated, onward, runs, _together(moved), _together(stood))


def _beside_holes(angle: Column) -> Rows:
    """(n,) True where the slope is not the angle's own: it runs from before a hole to behind it."""
    reach = np.ones(round(2.0 * SLOPE_ROWS))
    missing = np.convolve(~np.isfinite(angle), reach, "valid") > len(reach) - 0.5  # a hole begins here
    inside = np.convolve(missing, reach) > 0.5
    beside: Rows = np.convolve(inside, np.ones(2 * len(reach) + 1), "same") > 0.5
    return beside


def _together(parts: Sequence[Places]) -> Places:
    if not parts:
        return np.zeros(0), np.zeros(0, dtype=np.int64)
    return np.concatenate([angle for angle, _ in parts]), np.concatenate([speed for _, speed in parts])


def _apart(own: Repeats, chance: Chance) -> float:
    """How far the angles at which rows repeat are from those at which rows move, weighted as the shares are: the
    largest distance of their distributions (Kolmogorov). Lost samples know nothing of the angle; a dead spot is at
    one."""
    (every, speeds), (held, their_speeds) = own.moving, own.still
    if not len(held):
        return 0.0
    order, there = np.argsort(every), np.argsort(held)
    moved = np.cumsum(chance.weight[speeds[order]])
    stood = np.concatenate([[0.0], np.cumsum(chance.weight[their_speeds[there]])])
    at = stood[np.searchsorted(held[there], every[order], side="right")]
    return float(np.max(np.abs(at / stood[-1] - moved / moved[-1])))


def by_chance_at_speed(days: Sequence[Repeats], surrogates: Sequence[Repeats]) -> Chance:
    """What repeats by chance at each speed: as in the days, or as in the `surrogates` of the case where that is
    more."""
    usual = _chance(days)
    if not surrogates:
        return usual
    mine = _chance(surrogates)
    more = mine.share > usual.share
    return Chance(np.where(more, mine.share, usual.share), np.where(more, mine.onward, usual.onward))


def _chance(sources: Sequence[Repeats]) -> Chance:
    """Share of repeats and steps onward of all sources together; without any nothing repeats by chance."""
    rows, repeated, onward = (
        np.sum([np.zeros(SPEED_CLASSES), *(getattr(one, name) for one in sources)], axis=0)
        for name in ("rows", "repeated", "onward")
    )
    onward = np.where(repeated > 0.0, onward / np.maximum(repeated, 1.0), 1.0)
    return Chance(np.minimum(repeated / np.maximum(rows, 1.0), MOST_REPEATING), onward)


def excess(own: Repeats, chance: Chance) -> Excess:
    """The share of lost samples by the best linear estimate where few are lost: E[repeats] = p0 + share (1 - p0) in
    each class."""
    weight, p0 = chance.weight, chance.share
    free = max(float(np.sum(weight * own.rows * (1.0 - p0))), 1e-12)
    more = float(np.sum(weight * (own.repeated - p0 * own.rows)))
    further = float(np.sum(weight * (own.onward - p0 * own.rows * chance.onward)))
    by_rows = float(np.sqrt(_variance(own, chance, 0.0)))
    return Excess(
        more / free, float(np.sum(weight * own.rows * p0)) / free, by_rows, further / more if more > 0.0 else 0.0
    )


def _variance(own: Repeats, chance: Chance, share: float) -> float:
    """Of the estimate, where `share` of the samples are lost."""
    p = np.maximum(chance.share + share * (1.0 - chance.share), LEAST_REPEATING)
    free = max(float(np.sum(chance.weight * own.rows * (1.0 - chance.share))), 1e-12)
    return float(np.sum(chance.weight**2 * own.rows * p * (1.0 - p))) / free**2


def _is_louder(cases: Sequence[Record], sessions: Sequence[Sequence[Record]], level_of: Measure) -> bool:
    """Whether the case has so much more noise than the days that more repeats by chance than in them."""
    usual = [level_of(angles_of(session)) for session in sessions]
    return level_of(angles_of(cases)) > math.exp(LEAST_LOUDER) * max(usual)


def _motion_and_noise(records: Sequence[Record], step_deg: float) -> list[tuple[Record, Column, Column]]:
    """Each record with its motion and its own noise (n,), deg; without the step's own share in that."""
    parts = []
    for record, angle in zip(records, angles_of(records), strict=True):
        whole = filled_in(angle)
        smooth = smoothed(whole, SLOPE_ROWS, mirrored=True)
        noise = whole - smooth
        own = math.sqrt(max(1.0 - step_deg**2 / 12.0 / max(float(np.var(noise)), 1e-30), 0.0))
        parts.append((record, smooth, own * noise))
    return parts


def _surrogate(parts: Sequence[tuple[Record, Column, Column]], step_deg: float, seed: int) -> list[Record]:
    """The records (`_motion_and_noise`) with their own noise of another time, so that it keeps its colour, rounded to
    the converter's step again: what repeats in them does so by chance."""
    random = np.random.default_rng(seed)
    made = []
    for record, smooth, noise in parts:
        moved = np.roll(noise, int(random.integers(len(noise) // 4, 3 * len(noise) // 4 + 1)))
        made.append(replace(record, angle_deg=step_deg * np.round((smooth + moved) / step_deg)))
    return made
