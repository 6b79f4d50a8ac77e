"""Whether a model follows records: how far it moves beside how far its pressures do, where those are in MPa at all."""

import numpy as np
import pytest

from rig.errors import ModelError
from rig.gap.records.pairs import Pair, pair_up
from rig.gap.reference.simulated import followed
from rig.record import Record

T = np.arange(0.0, 10.0, 0.005)
WAVE = np.sin(np.pi * T)


def pair(p0_mpa: float) -> Pair:
    """Under pressures that move an eighth as far as they are told to, a joint that moves an eighth as far as usual."""
    said, seen = 0.1 * WAVE, 0.0125 * WAVE
    record = Record(
        "sine", T, 2.0 * said, 5.0 * WAVE, p0_mpa + said, p0_mpa - said, p1_mpa=0.2 + seen, p2_mpa=0.2 - seen
    )
    return pair_up([record], [], 0.2).pairs[0]


@pytest.mark.parametrize(("p0_mpa", "refused"), [(0.2, False), (0.05, True)])
def test_less_pressure_excuses_less_motion_unless_no_regulator_can_be_given_the_set_points(
    p0_mpa: float, refused: bool
) -> None:
    one = pair(p0_mpa)
    said = (one.u1_mpa, one.u2_mpa, 40.0 * np.sin(np.pi * one.t_s))
    if not refused:
        assert followed([one], [said]) == [""]
        return
    with pytest.raises(ModelError, match=r"moves 8\.\d+ times as far as the rig"):
        followed([one], [said])
