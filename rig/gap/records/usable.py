"""Which records the diagnosis can learn from: long enough, sampled, moved, in our units, and the right way round.

A record that fails is named with its reason, so that a wrong unit is never taken for an effect.
"""

import math
from collections.abc import Sequence

import numpy as np

from rig.columns import correlation
from rig.errors import ModelError, RecordError
from rig.gap.records.settings import (
    AGAINST,
    ALMOST,
    ANGLE_AGAINST,
    FARTHEST,
    HALF_TURN_DEG,
    LEAST_COMMAND_MPA,
    LEAST_MEASURED,
    LEAST_SAMPLED,
    LONGEST_BRIDGE_S,
    LONGEST_GAP_S,
    MOST_REASONS,
    SHORTEST_S,
    SPREAD_IN_RADIANS,
    STILL_DEG,
    STRANGE,
    UNIT_SHAPE,
)
from rig.identify.records.causality import before_command, subject_of
from rig.identify.records.data import strange_units
from rig.identify.records.monitors import (
    LEAST_ROWS,
    LONGEST_LAG_S,
    STILL_MPA,
    correlations,
    follows,
    nothing_answers,
)
from rig.number_text import counted
from rig.record import Column, Record

NOTHING_ANSWERS = (
    "neither the pressures nor the angle follow their command; is there air, and do the regulators get their "
    "set-points?"
)
NOT_FOLLOWED = (
    f"the angle does not follow its command at any lag up to {LONGEST_LAG_S:g} s; broken sensor or loose joint?"
)
SWAPPED = "the measured p1 - p2 runs against its command; are the two monitors, or the valves, swapped?"


def reasons(notes: Sequence[str]) -> str:
    """Why nothing can be used, in one line however many records there are."""
    more = f"; and {len(notes) - MOST_REASONS} more" if len(notes) > MOST_REASONS else ""
    return "; ".join(notes[:MOST_REASONS]) + more or "no record was given"


def usable(record: Record, notes: list[str], kind: str = "") -> bool:
    """Whether a record can be used. A note says why not, or that nothing answers, with which a record of the rig as it
    is now can still be used. `kind`: what an earlier day's record is called in a note; empty for the rig as it is
    now."""
    why, used = _badly_sampled(record) or _still(record), False
    angle = record.angle_deg
    if not why and angle is not None and not follows(record, angle, record.dp_cmd_mpa):
        used = nothing_answers(record) and not kind  # no earlier day on which nothing moved was a healthy one
        why = NOTHING_ANSWERS if used else NOT_FOLLOWED
    elif not why and _runs_against(record):
        why = SWAPPED
    if why:
        notes.append(f"{kind}{record.name}: {why}")
    return used or not why


def early(records: Sequence[Record]) -> str:
    """A note where the records of a day together have an effect before its cause; empty where they have not. Records
    whose rows are no course over time are left out."""
    read = [record for record in records if not _badly_sampled(record)]
    finding = before_command(read)
    return f"{subject_of(read)}: {finding}" if finding else ""


def _badly_sampled(record: Record) -> str:
    """Why a record's rows cannot be read as a course over time; empty where they can."""
    if strange := strange_units(record):
        return strange
    if record.angle_deg is None or np.isfinite(record.angle_deg).mean() < LEAST_MEASURED:
        return f"no angle was measured (at least {100 * LEAST_MEASURED:.0f} % of the rows are needed)"
    if len(record) < LEAST_ROWS or record.t_s[-1] - record.t_s[0] < SHORTEST_S:
        return _too_short(record)
    if np.any(np.diff(record.t_s) < 0):
        return "time runs backwards"
    if too_thin := _too_thin(record):
        return too_thin
    return "" if np.isfinite(record.dp_cmd_mpa).all() else "the command has holes"


def _still(record: Record) -> str:
    """Why a record shows no motion; empty where it does."""
    assert record.angle_deg is not None
    if np.ptp(record.dp_cmd_mpa) < LEAST_COMMAND_MPA:
        return (
            f"no excitation, the command moves by {1e3 * np.ptp(record.dp_cmd_mpa):.1f} kPa; at least "
            f"{1e3 * LEAST_COMMAND_MPA:.0f} kPa are needed"
        )
    if np.ptp(record.angle_deg[np.isfinite(record.angle_deg)]) < STILL_DEG:
        return "the angle never moves; broken sensor or stuck joint"
    return ""


def _too_short(record: Record) -> str:
    length = float(record.t_s[-1] - record.t_s[0]) if len(record) else 0.0
    return (
        f"too short, {counted(len(record), 'row')} in {length:.4g} s; needed: at least {LEAST_ROWS} rows and "
        f"{SHORTEST_S:g} s"
    )


def hole(record: Record, kind: str = "") -> str | None:
    """The longest stretch without an angle, in words, when it is long enough to be left out of every sum."""
    assert record.angle_deg is not None
    times = record.t_s[np.isfinite(record.angle_deg)]
    steps = np.diff(times)
    if not len(steps) or steps.max() <= max(LONGEST_BRIDGE_S, 3 * record.period_s):
        return None
    at = int(np.argmax(steps))
    return (
        f"{kind}{record.name}: {steps[at]:.3g} s without samples from {times[at]:.3g} s on; left out; what a delay "
        "or a slow effect did "
        "in it is not known"
    )


def _too_thin(record: Record) -> str:
    """Rows so far apart, or so much time without any, that nothing dynamic is left to see; empty where they are not."""
    length = float(record.t_s[-1] - record.t_s[0])
    if record.period_s > LONGEST_GAP_S:
        return f"sampled every {record.period_s:.3g} s, allowed: at most {LONGEST_GAP_S:g} s; is the time in ms?"
    if len(record) * record.period_s < LEAST_SAMPLED * length:
        return (
            f"{len(record)} rows every {1e3 * record.period_s:.3g} ms do not fill its {length:.4g} s; is a "
            "time stamp wrong?"
        )
    return ""


def _runs_against(record: Record) -> bool:
    """The pressures follow the command mirrored, at the lag at which they follow it at all: a regulator is late, and
    half a period later a sine looks right again."""
    if not record.has_pressures:
        return False
    known = np.isfinite(record.dp_mpa)
    if known.sum() < LEAST_ROWS or np.ptp(record.dp_mpa[known]) < LEAST_COMMAND_MPA:
        return False
    at = correlations(record, record.dp_mpa, record.dp_cmd_mpa)
    first = int(np.argmax(np.abs(at) > ALMOST * np.max(np.abs(at))))
    return bool(at[first] < AGAINST)


def check_reach(simulated: Sequence[Column], measured: Sequence[Column], pressure_ratio: float = 1.0) -> None:
    """ModelError when a model moves (deg, (n,) a record) so much more or less than the rig in all records together that
    it must be another rig's. One record alone is no sign: friction may hold a joint that is pushed little, while a
    wrong unit is the same in all. `pressure_ratio`: how many times as far as the rig's its pressures move (`farther`),
    which is allowed for, because a regulator that hardly fills is an effect."""
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


def farther(simulated: tuple[Column | None, Column | None], measured: tuple[Column | None, Column | None]) -> float:
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
