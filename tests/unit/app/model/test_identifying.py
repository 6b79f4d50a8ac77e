"""Identification as the command asks for it: what cannot be identified is refused in one line before any work."""

import numpy as np
import pytest

from rig.app.model.identifying import SearchOptions, StartOptions, identify_model
from rig.errors import RecordError
from rig.identify.records.data import Options
from rig.identify.search.stability import SweepRange
from rig.record import Record


@pytest.mark.parametrize(("rows", "said"), [(1, "1 row"), (2, "2 rows"), (100, "100 rows")])
@pytest.mark.filterwarnings("error")
def test_a_record_too_short_for_anything_is_refused(rows: int, said: str) -> None:
    t_s = 0.005 * np.arange(rows)
    short = Record("short", t_s, 0.0 * t_s, angle_deg=0.0 * t_s, p1_mpa=0.2 + 0.0 * t_s, p2_mpa=0.2 + 0.0 * t_s)
    start = StartOptions(None, "mbw", "auto", "none", None, None, 0.1, None, None)
    search = SearchOptions("pso", 4, 2, 1, 1, None, polish=False, bounded=False)
    with pytest.raises(RecordError, match=rf"^short: too short, {said} in .* s; needed: at least 1 s"):
        identify_model([short], start, search, SweepRange(), Options(), None)
