"""At which period a model is identified, and what is said of records that have no such period."""

import numpy as np
import pytest

from rig.app.model.identifying import Options, sample_time_s
from rig.errors import RecordError
from rig.record import Record


def sampled_every(period_s: float) -> Record:
    t_s = np.arange(100) * period_s
    return Record("x", t_s, np.sin(t_s), angle_deg=np.cos(t_s))


def test_the_period_of_the_records_is_kept() -> None:
    assert sample_time_s([sampled_every(0.02)], Options()) == 0.02


@pytest.mark.parametrize(("period_s", "in_ms"), [(5.0, True), (1.0, True), (50.0, True), (0.9, False), (60.0, False)])
def test_seconds_that_would_be_right_in_ms_are_asked_about(period_s: float, in_ms: bool) -> None:
    with pytest.raises(RecordError, match="a model is identified at 1 to 50 ms") as refused:
        sample_time_s([sampled_every(period_s)], Options())
    assert ("is t_s in ms?" in str(refused.value)) is in_ms
