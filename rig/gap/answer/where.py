"""Where the gap lies for a person: over frequency, over the phase of the motion, over the operating region, over time.

Every breakdown is of the same mean square, so the shares of each add up to 1. Which effect causes it is decided
elsewhere.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from rig.columns import rms
from rig.gap.answer.facts import Band, OverFrequency, OverTime
from rig.gap.answer.settings import EXCITED_SHARE, SLOW_SHARE, STEP_SHARE
from rig.gap.records.pairs import Pair
from rig.record import Column

REGIONS = 5
"""Bands of the angle."""
MEAN_LINES = 2
"""Lines of a record's spectrum that are its mean: a Hann window spreads that over two."""
LINE_REACH = 2
"""Lines on either side that belong to one: no excitation has whole periods in a record."""
MOST_LINES = 60
"""Excited lines, or multiples, that are looked at; beyond it is the rest."""
STEP_EDGE = 10
"""Rows at either end of a record where a step is none: too few stand on one side of it."""


def frequency_shares(pairs: Sequence[Pair], gaps: Sequence[Column]) -> list[OverFrequency]:
    """For each record, of its gap (n,): the share of the mean square that is constant, at the excitation's lines, at
    odd and even multiples, and the rest."""
    return [_lines_of(pair, gap) for pair, gap in zip(pairs, gaps, strict=True)]


def _lines_of(pair: Pair, gap: Column) -> OverFrequency:
    n = len(gap)
    power = np.abs(np.fft.rfft(gap)) ** 2
    power[1:] *= 2.0
    command = np.abs(np.fft.rfft((pair.u1_mpa - pair.u2_mpa) * np.hanning(n)))
    command[:MEAN_LINES] = 0.0
    lines = np.flatnonzero(command > EXCITED_SHARE * command.max())
    kinds = {"constant": power[:MEAN_LINES].sum(), "excited": 0.0, "odd_multiples": 0.0, "even_multiples": 0.0}
    free = np.ones(len(power), dtype=bool)
    free[:MEAN_LINES] = False
    top = int(np.argmax(command))
    for name, places in (
        ("excited", list(lines)),
        ("odd_multiples", list(range(3 * top, len(power), 2 * top))),
        ("even_multiples", list(range(2 * top, len(power), 2 * top))),
    ):
        for place in places[:MOST_LINES]:
            rows = np.arange(max(place - LINE_REACH, MEAN_LINES), min(place + LINE_REACH + 1, len(power)))
            rows = rows[free[rows]]
            kinds[name] += float(power[rows].sum())
            free[rows] = False
    total = max(float(power.sum()), 1e-30)
    shares = {name: float(value) / total for name, value in kinds.items()}
    shares["rest"] = max(1.0 - sum(shares.values()), 0.0)
    return OverFrequency(pair.name, float(top / (n * pair.dt_s)), rms(gap, pair.used), shares)


def phase_shares(pairs: Sequence[Pair], healthy: Sequence[Column], gaps: Sequence[Column]) -> list[Band]:
    """Rising, falling, and at turning points (the slowest third of the `healthy` motion): share of the gap, rms and
    mean. Of each pair a column (n,) of both, in deg."""
    parts: dict[str, list[Column]] = {"rising": [], "falling": [], "turning": []}
    for pair, angle, gap in zip(pairs, healthy, gaps, strict=True):
        speed = np.gradient(angle, pair.dt_s)
        slow = np.abs(speed) < np.quantile(np.abs(speed), SLOW_SHARE)
        used = pair.used > 0
        parts["turning"].append(gap[slow & used])
        parts["rising"].append(gap[~slow & (speed > 0) & used])
        parts["falling"].append(gap[~slow & (speed < 0) & used])
    return _bands({name: np.concatenate(columns) for name, columns in parts.items()})


def region_shares(pairs: Sequence[Pair], healthy: Sequence[Column], gaps: Sequence[Column]) -> list[Band]:
    """Over the `healthy` angle (deg), in bands of equal width: share of the gap's mean square, rms and mean (deg). Of
    each pair (n,)."""
    angle, gap = np.concatenate(healthy), np.concatenate(gaps)
    used = np.concatenate([pair.used for pair in pairs]) > 0
    edges = np.linspace(angle[used].min(), angle[used].max() + 1e-9, REGIONS + 1)
    bands = {
        f"{low:.1f} to {high:.1f} deg": gap[used & (angle >= low) & (angle < high)] for low, high in pairwise(edges)
    }
    return _bands(bands)


def over_time(pairs: Sequence[Pair], gaps: Sequence[Column]) -> list[OverTime]:
    """For each record, by its measured rows: the gap (n,), in deg, in its first and last quarter, its drift, and a step
    when there is a plain one."""
    courses = []
    for pair, whole in zip(pairs, gaps, strict=True):
        measured = pair.used > 0
        t_s, gap = pair.t_s[measured], whole[measured]
        quarter = max(len(gap) // 4, 1)
        slope = np.polyfit(t_s, gap, 1)[0] if len(gap) > 2 else 0.0
        at, share = _step(gap)
        courses.append(
            OverTime(
                pair.name,
                first_quarter_rms_deg=rms(gap[:quarter]),
                last_quarter_rms_deg=rms(gap[-quarter:]),
                drift_deg_min=float(60.0 * slope),
                step_at_s=float(t_s[at]) if share > STEP_SHARE else None,
            )
        )
    return courses


def _step(gap: Column) -> tuple[int, float]:
    """Row of the best single step in the gap, and the share of the gap's variance that it explains."""
    n = len(gap)
    centred = gap - gap.mean()
    total = float(centred @ centred)
    if n < 2 * STEP_EDGE or total <= 0:
        return 0, 0.0
    rows = np.arange(STEP_EDGE, n - STEP_EDGE + 1)
    sums = np.cumsum(centred)[rows - 1]
    explained = sums**2 * (1.0 / rows + 1.0 / (n - rows))
    best = int(np.argmax(explained))
    return int(rows[best]), float(explained[best] / total)


def _bands(parts: Mapping[str, Column]) -> list[Band]:
    total = max(sum(float(column @ column) for column in parts.values()), 1e-30)
    return [
        Band(
            name,
            share=float(column @ column) / total,
            rms_deg=rms(column) if len(column) else 0.0,
            mean_deg=float(column.mean()) if len(column) else 0.0,
        )
        for name, column in parts.items()
    ]
