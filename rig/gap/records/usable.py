"""Which records the diagnosis can learn from, each by itself: long enough, sampled, moved, and following its command.

A record that fails is named with its reason, so that a wrong unit is never taken for an effect. Whether it is of one
scale with what it is compared with is asked in `rig.gap.records.reach`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rig.gap.records.settings import (
    AGAINST,
    ALMOST,
    LEAST_COMMAND_MPA,
    LEAST_MEASURED,
    LEAST_SAMPLED,
    LONGEST_BRIDGE_S,
    LONGEST_GAP_S,
    MOST_REASONS,
    SHORTEST_S,
    STILL_DEG,
)
from rig.identify.records.causality import before_command, subject_of
from rig.identify.records.data import strange_units
from rig.identify.records.monitors import (
    LEAST_ROWS,
    LONGEST_LAG_S,
    correlations,
    follows,
    nothing_answers,
)
from rig.number_text import counted
from rig.record import Record

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


class Usability(NamedTuple):
    """Whether a record can be used, and what whoever reads the answer has to know of it: why not, or of one that can be
    used all the same that nothing answers; else empty."""

    usable: bool
    note: str = ""


def usability(record: Record, kind: str = "") -> Usability:
    """Of a record of the rig as it is now; `kind`: what an earlier day's record is called in a note."""
    why = _badly_sampled(record) or _still(record)
    angle = record.angle_deg
    if not why and angle is not None and not follows(record, angle, record.dp_cmd_mpa):
        if nothing_answers(record) and not kind:  # no earlier day on which nothing moved was a healthy one
            return Usability(True, f"{record.name}: {NOTHING_ANSWERS}")
        why = NOT_FOLLOWED
    elif not why and _runs_against(record):
        why = SWAPPED
    return Usability(False, f"{kind}{record.name}: {why}") if why else Usability(True)


def usable_of(records: Sequence[Record], kind: str = "") -> tuple[list[Record], list[str]]:
    """The records that can be used, and the notes on all of them (`usability`)."""
    judged = [(record, usability(record, kind)) for record in records]
    return [record for record, one in judged if one.usable], [one.note for _, one in judged if one.note]


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
