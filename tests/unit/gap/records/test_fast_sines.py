"""A fast sine follows its command late, and is mirrored half a period later: which of the two it is, at every lateness
that a regulator may have."""

from dataclasses import replace

import numpy as np
import pytest

from rig.gap.records.usable import usability
from rig.record import Record


def late(hertz: float, late_s: float) -> Record:
    """Pressures and angle behind a sine of 0.05 MPa by so much, 10 s at 5 ms."""
    t = np.arange(0.0, 10.0, 0.005)
    behind = 0.05 * np.sin(2.0 * np.pi * hertz * (t - late_s))
    return Record(
        "fast", t, 0.05 * np.sin(2.0 * np.pi * hertz * t), 100.0 * behind,
        p1_mpa=0.2 + 0.5 * behind, p2_mpa=0.2 - 0.5 * behind,
    )  # fmt: skip


@pytest.mark.parametrize("late_s", [0.0, 0.007, 0.02, 0.033, 0.041, 0.055, 0.069])
@pytest.mark.parametrize("hertz", [0.5, 1.5, 2.5, 4.0, 6.0])
def test_what_is_late_is_used_and_what_is_swapped_is_not(hertz: float, late_s: float) -> None:
    record = late(hertz, late_s)
    assert usability(record) == (True, "")
    swapped = usability(replace(record, p1_mpa=record.p2_mpa, p2_mpa=record.p1_mpa))
    assert not swapped.usable
    assert "swapped" in swapped.note
