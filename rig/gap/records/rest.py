"""The rest pressure P0 of records: commanded, or measured where nobody says."""

from collections.abc import Sequence

import numpy as np

from rig.conditions import commanded_rest
from rig.gap.records.conditions import measured_rest
from rig.gap.records.settings import LEAST_REST_MPA, SHIFTED_MPA
from rig.record import Record


def rest_pressure(records: Sequence[Record], p0_mpa: float, days: bool) -> float:
    """P0 of the records: from the set-points, or the facts; else, where earlier `days` stand for the rig, the middle of
    the measured pressures, and the model's where it does: gains of both regulators, or both pressures that are off,
    would pass for another P0."""
    means = [rest for record in records if (rest := commanded_rest(record)) is not None]
    if means:
        return float(np.median(means))
    measured = measured_rests(records)
    return max(float(np.round(np.median(measured), 2)), LEAST_REST_MPA) if measured and days else p0_mpa


def say_shift(records: Sequence[Record], partners: Sequence[Record], p0_mpa: float, notes: list[str]) -> bool:
    """Whether nobody says P0 and the measured one lies elsewhere than the earlier days', or without them than the
    model's; a note where it does."""
    mine, theirs = measured_rests(records), measured_rests(partners) if partners else [p0_mpa]
    said = any(commanded_rest(record) is not None for record in records)
    if said or not mine or not theirs or abs(np.median(mine) - np.median(theirs)) <= SHIFTED_MPA:
        return False
    usual = "in the baselines" if partners else "in the model"
    notes.append(
        f"P0 is {np.median(mine):.2f} MPa by the measured pressures, {np.median(theirs):.2f} MPa {usual}: recorded "
        "around another P0, or both pressures are shifted"
    )
    return True


def measured_rests(records: Sequence[Record]) -> list[float]:
    """The middle of both measured pressures of each record that has them, MPa."""
    return [rest for record in records if (rest := measured_rest(record)) is not None]
