"""What regulators do at other pressures than those that a reference knows them at."""

from collections.abc import Sequence

import numpy as np

from rig.gap.reference.expectation import driving, regulator_patterns
from rig.gap.response.propagate import RecordContext
from rig.gap.settings import SPEED_DOUBT
from rig.model.effect_stages.valve import ATMOSPHERE_MPA
from rig.model.response.model import ResponseModel
from rig.record import Column


def speed_doubt(contexts: Sequence[RecordContext], response: ResponseModel) -> Column:
    """(2 n, 2) MPa: how both monitors differ, valve 1 of every record and then valve 2, because regulators that hold
    other pressures than expected follow faster or slower: by one standard deviation both ways alike, and filling one
    way and emptying the other. A flow through an orifice goes with the absolute pressure ahead of it (ISO 6358), so
    that the time constants change in the ratio in which the mean pressure of the record does; nothing where that is as
    expected."""
    parts = []
    for valve in (0, 1):
        for context in contexts:
            used = context.pair.used > 0.0
            expected = (context.reference.p1_mpa, context.reference.p2_mpa)[valve][used]
            measured = driving(context, True)[valve][used]
            off = float(np.mean(measured - expected) / (np.mean(expected) + ATMOSPHERE_MPA)) if used.any() else 0.0
            parts.append(SPEED_DOUBT * off * regulator_patterns(context, response, valve))
    return np.concatenate(parts)
