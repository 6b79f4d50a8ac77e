"""The rest pressure P0 of records: commanded, or measured where nobody says."""

from collections.abc import Sequence

import numpy as np

from rig.gap.records.conditions import commanded_rest, measured_rest
from rig.gap.records.settings import SHIFTED_MPA
from rig.record import Record

OTHER_THAN_MODEL_MPA = 0.02
"""A measured P0 this far from the model's is said; also the least P0 that is believed."""


def rest_pressure(records: Sequence[Record], p0_mpa: float, notes: list[str]) -> float:
    """P0 of the records: from the set-points, or the facts, or the start of the measured pressures, or else the
    model's."""
    means = [rest for record in records if (rest := commanded_rest(record)) is not None]
    if means:
        return float(np.median(means))
    measured = measured_rests(records)
    if not measured:
        return p0_mpa
    rest = float(np.round(np.median(measured), 2))
    if abs(rest - p0_mpa) > OTHER_THAN_MODEL_MPA:
        notes.append(f"P0 is {rest:g} MPa by the measured pressures, the model was made at {p0_mpa:g} MPa")
    return max(rest, OTHER_THAN_MODEL_MPA)


def say_shift(records: Sequence[Record], partners: Sequence[Record], notes: list[str]) -> bool:
    """Whether the measured P0 lies elsewhere than the baselines'; a note where it does."""
    mine, theirs = measured_rests(records), measured_rests(partners)
    if mine and theirs and abs(np.median(mine) - np.median(theirs)) > SHIFTED_MPA:
        notes.append(
            f"P0 is {np.median(mine):.2f} MPa by the measured pressures, {np.median(theirs):.2f} MPa in the "
            "baselines: recorded around "
            "another P0, or both pressures are shifted"
        )
        return True
    return False


def measured_rests(records: Sequence[Record]) -> list[float]:
    """The middle of both measured pressures of each record that has them, MPa."""
    return [rest for record in records if (rest := measured_rest(record)) is not None]
