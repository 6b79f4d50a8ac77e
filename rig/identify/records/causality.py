"""Whether what is measured comes before what causes it: columns of two clocks that were laid beside each other wrongly.

One sine does not tell: 0.3 s too early looks like the rest of its period too late. A record with more than one
frequency in it does, and so do the records of a session together.
"""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from rig.identify.records.monitors import FOLLOWED_S, LEAST_ROWS, LONGEST_LAG_S, correlations
from rig.record import MOST_ROWS, Column, Record

LONGEST_LATE_S: Final = 4.0
"""How late an effect may be, s, that is weighed against its being early. Less: of a slow sine whose quarter of a period
is early, as a velocity is, the rest of the period is not looked at."""
EARLY_SHARE: Final = 0.1
"""What is early, and nothing else, leaves less than this share of the motion unexplained by its cause at one lag. Rigs
leave 0.04 and less at their own lag. More: what leads the more, the faster it is, as a velocity, is called early."""
LATE_OVER_EARLY: Final = 4.0
"""... and what is late leaves so many times as much. Rigs leave five times as much early as late, and more, so that
either is told from the other. Less: where the two are alike, as with a single sine, one is chosen."""
LAGS_LEAVE: Final = 0.01
"""What lags FOLLOWED_S apart leave by themselves, as a share of the motion: half a lag of 3 Hz."""


def before_command(records: Sequence[Record]) -> str:
    """Which of the measured columns comes before its command, over all these records, and by how much, in words; empty
    where none does, or where they do not tell."""
    for what, column in (("the measured p1 - p2", "dp_mpa"), ("the angle", "angle_deg")):
        if early_s := _early_s([*_pairs(records, column, "dp_cmd_mpa")]):
            return (
                f"{what} comes {early_s:.2g} s before its command, which causes it: were columns of two clocks laid "
                "beside each other?"
            )
    return ""


def before_pressures(records: Sequence[Record]) -> str:
    """By how much the angle comes before the measured pressures, over all these records, in words; empty where it does
    not, or where they do not tell."""
    early_s = _early_s([*_pairs(records, "angle_deg", "dp_mpa")])
    return f"the angle comes {early_s:.2g} s before the measured p1 - p2, which causes it" if early_s else ""


def subject_of(records: Sequence[Record]) -> str:
    """How a note on these records begins: with the name of the only one, or how many they are."""
    return records[0].name if len(records) == 1 else f"the {len(records)} records"


def _pairs(records: Sequence[Record], name: str, cause: str) -> Iterator[tuple[Record, Column, Column]]:
    """The records that tell of a column and of its cause, with both (n,): in one that is shorter than two of the
    latenesses that are weighed, what is early may be the rest of a period late, and no half of it shows that."""
    for record in records:
        if "dp_mpa" in (name, cause) and not record.has_pressures:
            continue
        column, drive = getattr(record, name), getattr(record, cause)
        if column is None or min(np.isfinite(column).sum(), np.isfinite(drive).sum()) < LEAST_ROWS:
            continue
        if 2.0 * LONGEST_LATE_S < record.t_s[-1] - record.t_s[0] <= MOST_ROWS * FOLLOWED_S:
            yield record, column, drive


def _early_s(pairs: Sequence[tuple[Record, Column, Column]]) -> float | None:
    """By how many seconds all columns (n,) come before their causes (n,); None where they do not."""
    if not pairs:
        return None
    early = np.mean([_unexplained(one, cause, column, LONGEST_LAG_S) for one, column, cause in pairs], axis=0)
    at = int(np.argmin(early))
    if at == 0 or early[at] > EARLY_SHARE:
        return None
    late = np.mean([_unexplained(one, column, cause, LONGEST_LATE_S) for one, column, cause in pairs], axis=0)
    if LATE_OVER_EARLY * max(early[at], LAGS_LEAVE) > np.min(late):
        return None
    return at * FOLLOWED_S


def _unexplained(record: Record, later: Column, sooner: Column, longest_s: float) -> Column:
    """(lags,) shares of the motion of one column (n,) that the other, so much before it, does not explain; 1 where they
    run against each other. Lags from 0 on, FOLLOWED_S apart; beyond half of the record nothing is explained."""
    at = np.maximum(correlations(record, later, sooner, longest_s=longest_s), 0.0)
    shares = np.ones(round(longest_s / FOLLOWED_S))
    shares[: len(at)] = 1.0 - at[: len(shares)] ** 2
    return shares
