"""The zero of the angle: whether records show that the sensor's is not the joint's.

A rig whose two muscles are alike turns as far to one side as to the other under the mirrored drive. A constant beside
everything that is odd in the drive is the sensor's zero, which is set by hand when the sensor is mounted; a model
without one takes it for hysteresis and misses all else as well.
"""

from collections.abc import Sequence

import numpy as np

from rig.model.compiled.response import RESPONSE_TERMS, response_terms
from rig.model.driving import driving_pressures
from rig.model.parameters import Input
from rig.record import Column, Record

LEAST = 0.01
"""Of the angle's range: a smaller offset stays below what the model's class misses of a rig (1.5 % rms), and is not
worth another number."""
SHOWN = 0.05
"""Share of the mean square that a constant takes off what an odd description leaves; less: it may be creep or noise."""
BOTH_SIDES = 0.3
"""The drive goes to either side by this share of how far it goes to the other; else a constant is no sign of a zero."""
ODD = (1, 3, *range(4, 10), 11, *range(12, RESPONSE_TERMS))
"""Terms of the response model's bank that turn their sign with the drive: powers, low-passes and plays."""


def why_zero_is_free(records: Sequence[Record], drive: Input, p0_mpa: float, exponent: float) -> str:
    """Why the zero of the angle is identified, in one line; empty where the records do not call for it."""
    rows = [_rows(record, drive, p0_mpa, exponent) for record in records if record.angle_deg is not None]
    if not rows:
        return ""
    terms, angle = np.concatenate([one for one, _ in rows]), np.concatenate([one for _, one in rows])
    low, high = sorted((-float(terms[:, 0].min()), float(terms[:, 0].max())))
    if low < BOTH_SIDES * high:
        return ""
    odd = np.linalg.lstsq(terms, angle, rcond=None)[0]
    with_zero = np.column_stack([terms, np.ones(len(terms))])
    both = np.linalg.lstsq(with_zero, angle, rcond=None)[0]
    left, less = float(np.sum((angle - terms @ odd) ** 2)), float(np.sum((angle - with_zero @ both) ** 2))
    zero = float(both[-1])
    if less > (1.0 - SHOWN) * left or abs(zero) < LEAST * float(np.ptp(angle)):
        return ""
    return (
        f"zero of the angle: identified, it is some {zero:.2g} deg off what a rig of two equal muscles shows; "
        "--no-free-offset holds it at 0"
    )


def _rows(record: Record, drive: Input, p0_mpa: float, exponent: float) -> tuple[Column, Column]:
    """Odd terms (n, k) and the angle (n,), in rows that were measured."""
    p1, p2 = (column.copy() for column in driving_pressures(record, drive, p0_mpa))
    assert record.angle_deg is not None
    known = np.isfinite(p1) & np.isfinite(p2) & np.isfinite(record.angle_deg)
    p1, p2 = (np.interp(record.t_s, record.t_s[known], column[known]) for column in (p1, p2))
    terms = np.empty((len(p1), RESPONSE_TERMS))
    response_terms(p1, p2, p0_mpa, exponent, record.period_s, terms)
    return terms[known][:, ODD], record.angle_deg[known]
