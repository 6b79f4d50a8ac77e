"""Single equations of the chain on whole columns: the drive, and the joint's balance."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.model.compiled.stages import compiled, over_records
from rig.model.equations.drive import drives
from rig.model.equations.joint_balance import NOTHING_ADDED, STATE_SIZE, balanced_angles, equilibrium_angles
from rig.model.slots import StageFunction
from rig.record import Column

Ends = NDArray[np.intp] | None
"""(r,) the row after the last of each record; None for one record."""


def drive(p1_mpa: Column, p2_mpa: Column, p0_mpa: float, exponent: float) -> Column:
    """The drive d = (p1 - p2) (2 P0 / (p1 + p2))^exponent of every row (n,), MPa; see `rig.model.equations.drive`."""
    out = np.empty(len(p1_mpa))
    compiled(drives)(p1_mpa, p2_mpa, p0_mpa, exponent, out)
    return out


class Joint(NamedTuple):
    """The nominal joint of `rig.model.equations.joint_balance`."""

    viscous_s: float
    inertia_s: float
    weights: tuple[float, ...]
    """(5,) of its Maxwell-slip elements."""


def pulled_to(angle_deg: Column, joint: Joint, dt_s: float | Column, ends: Ends = None) -> Column:
    """The angle (n,) to which the muscles pull where the joint has these angles (n,); of several records where their
    `ends` and dt_s are given, as in `each_record`."""
    out = np.empty_like(angle_deg)
    _over(equilibrium_angles, angle_deg, out, out, joint, dt_s, ends)
    return out


def settled(
    angle_deg: Column, pulled_to_deg: Column, friction: Column, joint: Joint, dt_s: float | Column, ends: Ends = None
) -> Column:
    """The joint's angle (n,) when the muscles pull to other angles (n,) than where it has `angle_deg` (n,), and its
    friction counts `friction` times (n,); records as in `pulled_to`."""
    out = angle_deg.copy()
    _over(balanced_angles, out, pulled_to_deg, friction, joint, dt_s, ends)
    return out


def balanced(angle_deg: Column, offset_deg: Column, friction: Column, joint: Joint, dt_s: float) -> Column:
    """`settled` where the muscles pull `offset_deg` (n,) further than they do."""
    return settled(angle_deg, pulled_to(angle_deg, joint, dt_s) + offset_deg, friction, joint, dt_s)


def _over(
    function: StageFunction,
    first: Column,
    second: Column,
    third: Column,
    joint: Joint,
    dt_s: float | Column,
    ends: Ends,
) -> None:
    params = np.array([*NOTHING_ADDED, 0.0, joint.viscous_s, joint.inertia_s, *joint.weights])
    ends = np.array([len(first)]) if ends is None else ends
    each = np.full(len(ends), dt_s)
    over_records(function)(first, second, third, ends, np.zeros(STATE_SIZE), params, each, np.zeros(len(ends)))
