"""Records in two halves: one to fit to, the other to judge that fit by."""

from collections.abc import Sequence

import numpy as np

from rig.record import Column


def in_halves(used: Sequence[Column]) -> list[Column]:
    """The half, 0 or 1, of every row (n,) of each record whose measured rows are 1 in `used`: every other record; of a
    single one its first and its second measured half in time."""
    if len(used) > 1:
        return [np.full(len(rows), float(k % 2)) for k, rows in enumerate(used)]
    return [(np.cumsum(rows) > 0.5 * rows.sum()).astype(float) for rows in used]
