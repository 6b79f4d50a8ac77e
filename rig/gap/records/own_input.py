"""A baseline at the case's own input: a measured input is never twice the same, and what it differs by is no gap.

The baseline's response to its input is fitted by a short linear response; what that says of the inputs' difference is
added.
"""

import numpy as np

from rig.gap.records.settings import ALIGNED, INPUT_RIDGE, INPUT_TAP_S, INPUT_TAPS
from rig.record import Column


def differs(mine: Column, theirs: Column) -> bool:
    """Whether two inputs (n,) on one grid differ by more than their reading from a file does: by more than ALIGNED of
    what the first moves, rms."""
    return bool(np.std(mine - theirs) > ALIGNED * np.std(mine))


def at_input(output: Column, own: Column, wanted: Column, dt_s: float) -> Column:
    """The output (n,) as it would have been under `wanted` instead of its `own` input; both on the output's grid."""
    taps = _delayed(own - own.mean(), dt_s)
    power = taps.T @ taps
    power += INPUT_RIDGE * max(float(np.trace(power)), 1e-30) * np.eye(len(power))
    response = np.linalg.solve(power, taps.T @ (output - output.mean()))
    moved: Column = output + _delayed(wanted - own, dt_s) @ response
    return moved


def _delayed(column: Column, dt_s: float) -> Column:
    """(n, INPUT_TAPS): the column later by each tap; before its start it stands at its first value."""
    rows = np.arange(len(column))
    each = max(1, round(INPUT_TAP_S / dt_s))
    delayed: Column = np.stack([column[np.maximum(rows - k * each, 0)] for k in range(INPUT_TAPS)], axis=1)
    return delayed
