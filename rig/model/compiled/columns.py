"""Single equations of the chain on whole columns: the drive, and the joint's balance."""

import numpy as np
from numpy.typing import NDArray

from rig.model.compiled.stages import compiled, over_records
from rig.model.equations.drive import drives
from rig.model.equations.joint_balance import NOTHING_ADDED, STATE_SIZE, balanced_angles
from rig.record import Column


def drive(p1_mpa: Column, p2_mpa: Column, p0_mpa: float, exponent: float) -> Column:
    """The drive d = (p1 - p2) (2 P0 / (p1 + p2))^exponent of every row (n,), MPa; see `rig.model.equations.drive`."""
    out = np.empty(len(p1_mpa))
    compiled(drives)(p1_mpa, p2_mpa, p0_mpa, exponent, out)
    return out


def balanced(
    angle_deg: Column,
    offset_deg: Column,
    friction: Column,
    viscous_s: float,
    inertia_s: float,
    weights: Column,
    dt_s: float | Column,
    ends: NDArray[np.intp] | None = None,
) -> Column:
    """The joint's angle (n,) when the muscles pull `offset_deg` further and its friction counts `friction` times (both
    (n,)); of several records where their `ends` and dt_s are given, as in `each_record`.

    viscous_s, inertia_s and the Maxwell-slip weights (5,) are those of the nominal joint; see
    `rig.model.equations.joint_balance`.
    """
    out = angle_deg.copy()
    params = np.array([*NOTHING_ADDED, 0.0, viscous_s, inertia_s, *weights])
    ends = np.array([len(out)]) if ends is None else ends
    state, each_dt_s = np.zeros(STATE_SIZE), np.full(len(ends), dt_s)
    over_records(balanced_angles)(out, offset_deg, friction, ends, state, params, each_dt_s)
    return out
