"""At which period a model is identified, and what is said of records that have no such period."""

import numpy as np
import pytest

from rig.app.model.identifying import RecordOptions, sample_time_s
from rig.errors import RecordError
from rig.record import Record


def sampled_every(period_s: float) -> Record:
    t_s = np.arange(100) * period_s
    return Record("x", t_s, np.sin(t_s), angle_deg=np.cos(t_s))


def test_the_period_of_the_records_is_kept() -> None:
    assert sample_time_s([sampled_every(0.02)], RecordOptions()) == 0.02


@pytest.mark.parametrize(
    ("period_s", "unit"),
    [(5.0, "ms"), (1.0, "ms"), (50.0, "ms"), (0.9, ""), (60.0, ""), (900.0, ""), (5e3, "us"), (6e4, ""), (5e6, "ns")],
)
def test_seconds_that_would_be_right_in_a_smaller_unit_are_asked_about(period_s: float, unit: str) -> None:
    with pytest.raises(RecordError, match="a model is identified at 1 to 50 ms") as refused:
        sample_time_s([sampled_every(period_s)], RecordOptions())
    asked = str(refused.value).partition("is t_s in ")[2]
    assert asked.partition("?")[0] == unit
