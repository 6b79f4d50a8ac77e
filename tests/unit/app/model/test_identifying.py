"""Identification as the command asks for it: what cannot be identified is refused in one line before any work."""

import numpy as np
import pytest

from rig.app.model.identifying import SearchOptions, StartOptions, identify_model
from rig.errors import RecordError
from rig.identify.records.data import RecordOptions
from rig.identify.search.stability import SweepRange
from rig.model.response.kept_day import unpacked
from rig.record import Record


@pytest.mark.parametrize(("rows", "said"), [(1, "1 row"), (2, "2 rows"), (100, "100 rows")])
@pytest.mark.filterwarnings("error")
def test_a_record_too_short_for_anything_is_refused(rows: int, said: str) -> None:
    t_s = 0.005 * np.arange(rows)
    short = Record("short", t_s, 0.0 * t_s, angle_deg=0.0 * t_s, p1_mpa=0.2 + 0.0 * t_s, p2_mpa=0.2 + 0.0 * t_s)
    start = StartOptions(None, "mbw", "auto", "none", None, None, 0.1, None, None)
    search = SearchOptions("pso", 4, 2, 1, 1, None, polish=False, bounded=False)
    with pytest.raises(RecordError, match=rf"^short: too short, {said} in .* s; needed: at least 1 s"):
        identify_model([short], start, search, SweepRange(), RecordOptions(), None)


def test_pulses_and_falls_of_the_sensor_are_no_part_of_the_model() -> None:
    """They are left out as in a diagnosis, and said: the model and what its fingerprint keeps are those without."""
    t_s = 0.005 * np.arange(2400)
    command = 0.1 * np.sin(2 * np.pi * 0.5 * t_s)
    lagged = 150.0 * 0.1 * np.sin(2 * np.pi * 0.5 * (t_s - 0.06))
    quiet = lagged + np.random.default_rng(5).normal(0.0, 0.02, len(t_s))
    fallen, pulsed = quiet.copy(), quiet.copy()
    fallen[100::240] = -40.0
    pulsed[700] = 90.0
    start = StartOptions(None, "mbw", "auto", "rigid", None, None, 0.1, False, 0.0)
    search = SearchOptions("pso", 4, 1, 10, 20, None, polish=False, bounded=False)

    def identified(*angles: np.ndarray) -> tuple[list[str], float, list[np.ndarray]]:
        records = [Record(f"sine_{k}", t_s, command, angle_deg=angle) for k, angle in enumerate(angles)]
        found = identify_model(records, start, search, SweepRange(), RecordOptions(), None)
        assert found.model.fingerprint is not None
        kept = unpacked(found.model.fingerprint.day)
        return list(found.choices), found.rmse_deg, [one.angle_deg for one in kept]

    told, rmse_deg, kept = identified(fallen, pulsed)
    _, usual_deg, as_they_were = identified(quiet, quiet)
    assert "sine_0: 10 samples of the angle fell to a rail, which reads -40 deg; left out" in told
    assert "sine_1: 1 sample stands far from both neighbours in the angle, the farthest reads 90 deg; left out" in told
    assert rmse_deg == pytest.approx(usual_deg, rel=0.05)
    assert max(np.abs(one - other).max() for one, other in zip(kept, as_they_were, strict=True)) < 0.2
