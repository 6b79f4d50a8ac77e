"""Records that each count the angle from where the joint rested before, as those of pamrig's own loop do.

Whatever turns the joint at rest is in none of them.
"""

from typing import Final

import numpy as np

from hil.reference.compiling import Array

REST_S: Final = 0.5
"""For how long the first set-points are held before a record: the mean angle of that time is its zero."""
ZERO: Final = "angle_zero_deg"
"""Column of what was taken for zero, the same in each row; named as the log's field is."""


def rest_rows(period_s: float) -> int:
    """Rows of that rest."""
    return max(1, round(REST_S / period_s))


def resting_before(set_point_mpa: Array, rows: int) -> Array:
    """The set-points (n,) with so many rows of the first one before them."""
    return np.concatenate([np.full(rows, set_point_mpa[0]), set_point_mpa])


def from_own_zero(columns: dict[str, Array], rows: int, period_s: float) -> dict[str, Array]:
    """The record after so many rows of rest, its angle counted from their mean."""
    zero_deg = float(np.mean(columns["angle_deg"][:rows]))
    record = {name: column[rows:] for name, column in columns.items()}
    return record | {
        "t_s": record["t_s"] - rows * period_s,
        "angle_deg": record["angle_deg"] - zero_deg,
        ZERO: np.full(len(record["t_s"]), zero_deg),
    }
