"""Whether angles move as far, and the same way round, as what they are compared with: a model, or earlier days. Where
they do not, it is another unit, a turned sign, another rig, or a model outside its range, and no effect.
"""

import math
from collections.abc import Sequence

import numpy as np

from rig.columns import correlation
from rig.errors import ModelError, RecordError
from rig.gap.records.settings import ANGLE_AGAINST, FARTHEST, HALF_TURN_DEG, SPREAD_IN_RADIANS, STRANGE, UNIT_SHAPE
from rig.identify.records.monitors import STILL_MPA
from rig.record import Column, Record


def check_reach(simulated: Sequence[Column], measured: Sequence[Column], pressure_ratio: float = 1.0) -> None:
    """ModelError when a model moves (deg, (n,) a record) so much more or less than the rig in all records together that
    it must be another rig's. One record alone is no sign: friction may hold a joint that is pushed little, while a
    wrong unit is the same in all. `pressure_ratio`: how many times as far as the rig's its pressures move
    (`pressure_reach_ratio`), which is allowed for, because a regulator that hardly fills is an effect."""
    ranges = [math.hypot(*(float(np.ptp(column)) for column in columns)) for columns in (simulated, measured)]
    times, usual = ranges[0] / max(ranges[1], 1e-9), max(pressure_ratio, 1.0)
    if not 1.0 / STRANGE < times < usual * STRANGE:
        raise ModelError(
            f"the model moves {times:.3g} times as far as the rig: other units, or outside its range; "
            f"allowed without a baseline: {1.0 / STRANGE:.2g} .. {usual * STRANGE:.3g} times"
        )


def is_held(simulated: Sequence[Column], measured: Sequence[Column]) -> bool:
    """Whether the joint moves so much less than a model (deg, (n,) a record) because something holds it. With another
    unit, or another rig, both courses have one shape in all records; a joint that is held has another. It counts where
    most records show it: in a single one the model may have left its range."""
    moves_deg = [float(np.ptp(column)) for column in simulated]
    times = [moves / max(float(np.ptp(column)), 1e-9) for moves, column in zip(moves_deg, measured, strict=True)]
    if np.median(times) <= STRANGE or max(moves_deg) >= HALF_TURN_DEG:
        return False
    together, own, other = np.zeros(2 * max(map(len, simulated))), 0.0, 0.0
    for one, two in zip(simulated, measured, strict=True):
        one, two = one - np.mean(one), two - np.mean(two)
        spectrum = np.fft.rfft(one, len(together)).conj() * np.fft.rfft(two, len(together))
        together += np.fft.irfft(spectrum, len(together))
        own, other = own + float(one @ one), other + float(two @ two)
    return float(np.max(np.abs(together))) < UNIT_SHAPE * float(np.sqrt(own * other))


def beyond_reach(name: str, simulated: Column, farthest_deg: float, pressure_ratio: float) -> str:
    """Why what a model says (deg, (n,)) of a record of this name is left out, in words: it moves much farther than the
    rig does in any of the records; else empty."""
    moves_deg = float(np.ptp(simulated))
    if moves_deg < STRANGE * max(pressure_ratio, 1.0) * farthest_deg:
        return ""
    return (
        f"{name}: the model moves by {moves_deg:.3g} deg, the rig by {farthest_deg:.3g} deg in any record: outside its "
        "range"
    )


def pressure_reach_ratio(
    simulated: tuple[Column | None, Column | None], measured: tuple[Column | None, Column | None]
) -> float:
    """How many times as far as the measured ones the pressures (n,) of a model move apart; 1 where either has none."""
    (p1, p2), (own1, own2) = simulated, measured
    if p1 is None or p2 is None or own1 is None or own2 is None:
        return 1.0
    return float(np.ptp(p1 - p2) / max(np.nanmax(own1 - own2) - np.nanmin(own1 - own2), STILL_MPA))


def runs_against(cases: Sequence[Column], expected: Sequence[Column]) -> bool:
    """Whether angles (n,) run against what is expected of them, over all records together: no lag and no friction of a
    rig does that."""
    centred = [(one - np.mean(one), other - np.mean(other)) for one, other in zip(cases, expected, strict=True)]
    case, other = (np.concatenate(columns) for columns in zip(*centred, strict=True))
    return correlation(case, other) < ANGLE_AGAINST


def check_direction(cases: Sequence[Column], expected: Sequence[Column], whose: str) -> None:
    """RecordError when the angles (n,) run against what is expected of them."""
    if runs_against(cases, expected):
        raise RecordError(
            f"the angle runs against {whose}: is its sign turned, or are the muscles or their commands swapped?"
        )


def check_scale(record: Record, partners: Sequence[Record | None]) -> None:
    """RecordError when the angle is that of the baselines in radians, or another rig's."""
    assert record.angle_deg is not None
    spreads = [
        np.nanstd(partner.angle_deg) for partner in partners if partner is not None and partner.angle_deg is not None
    ]
    share = float(np.nanstd(record.angle_deg) / np.median(spreads)) if spreads else 1.0
    if SPREAD_IN_RADIANS[0] < share < SPREAD_IN_RADIANS[1]:
        raise RecordError(
            f"{record.name}: the angle moves {1 / share:.3g} times less than in the baselines; is it in radians? "
            "`pamrig log import` converts units"
        )
    if share > FARTHEST:
        raise RecordError(
            f"{record.name}: the angle moves {share:.3g} times as far as in the baselines, allowed: {FARTHEST:g}; "
            "another rig, or another unit?"
        )
