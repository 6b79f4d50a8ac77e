"""Columns that look exchanged, turned round or in another unit of time: what somebody at the rig should look at
first."""

from typing import Final

import numpy as np

from rig.columns import correlation
from rig.log.foreign.units import STEP_SIZES, unit_by_size
from rig.record import Column, Record

SLOWEST_S: Final = STEP_SIZES[0][0]
"""No record of a rig whose muscles answer within 0.1 s is sampled more slowly; what looks so is in another unit."""
MOVED_MPA: Final = 0.01
"""Pressures that differ by more than this were commanded: five times what a monitor's noise reaches."""
OPPOSED: Final = -0.7
"""Correlation from which on two columns run against each other; those that belong together reach +0.9 and more."""


def strange_clock(record: Record) -> str | None:
    """What no clock of this kind of rig shows, and the unit that the time may be in."""
    if len(record) < 2 or record.period_s <= SLOWEST_S:
        return None
    unit = unit_by_size(record.period_s, STEP_SIZES)
    return f"t_s rises by {record.period_s:.4g} a row, too slow for this kind of rig; is t_s in {unit}?"


def mix_ups(record: Record) -> list[str]:
    """Measured pressures that run against the command, or move without one, in words; the angle says which of the two
    is the wrong way round."""
    if record.p1_mpa is None or record.p2_mpa is None:
        return []
    commanded, moved = (_range(one) for one in (record.dp_cmd_mpa, record.dp_mpa))
    if commanded == 0.0 and moved > MOVED_MPA:
        return [
            f"{record.name}: dp_cmd_mpa stands still while the measured p1 - p2 moves by {moved:.2g} MPa: the "
            "regulators are not to be learnt from it; is that the right column?"
        ]
    against = correlation(record.dp_mpa, record.dp_cmd_mpa)
    if against > OPPOSED:
        return []
    measured = f"{record.name}: p1 - p2 as measured falls where dp_cmd_mpa rises (correlation {against:.2f})"
    if record.p1_cmd_mpa is not None and correlation(record.p1_mpa, record.p1_cmd_mpa) <= OPPOSED:
        return [f"{measured}: p1 and p2 look swapped; each follows the other's set-point"]
    turned = 0.0 if record.angle_deg is None else correlation(record.angle_deg, record.dp_cmd_mpa)
    if turned >= -OPPOSED:
        return [f"{measured}, and the angle follows the command: p1 and p2 look swapped"]
    if turned <= OPPOSED:
        return [f"{measured}, and so does the angle: dp_cmd_mpa has the other sign"]
    return [f"{measured}: p1 and p2 look swapped, or dp_cmd_mpa has the other sign"]


def _range(column: Column | None) -> float:
    known = np.zeros(1) if column is None else column[np.isfinite(column)]
    return float(np.ptp(known)) if len(known) else 0.0
