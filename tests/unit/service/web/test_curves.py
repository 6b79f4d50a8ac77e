"""What the page draws of records and sweeps: thinned out without losing a peak, and true to the numbers."""

from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

from rig.app import compose, shipped
from rig.errors import EnvelopeError, RigError
from rig.service.web.files import curves

SINE = ROOT / "tests" / "replay" / "sine_0.5hz_0.20mpa.mcap"
TRIANGLE = ROOT / "tests" / "replay" / "triangle_0.8hz_0.10mpa.mcap"


def test_no_peak_is_lost_however_long_the_record() -> None:
    column = np.zeros(100_003)
    column[[7, 55_555, 100_001]] = [5.0, -7.0, 3.0]
    rows = curves.ends(column, curves.CURVE_POINTS)
    assert len(rows) <= curves.CURVE_POINTS + 2
    assert {column[rows].max(), column[rows].min()} == {5.0, -7.0}
    assert (rows[0], rows[-1]) == (0, len(column) - 1)
    assert len(curves.ends(np.zeros(10), curves.CURVE_POINTS)) == 10


def test_a_preview_is_what_the_loop_would_be_told() -> None:
    rig = compose.load(None)
    found = curves.preview(shipped.configs() / "sweeps" / "quick.yaml", rig)
    assert found["records"] == 1
    assert found["columns"]["t_s"][-1] == pytest.approx(found["seconds"], abs=0.02)
    assert found["allowed"][0] <= found["lowest"] < found["highest"] <= found["allowed"][1]
    assert 0 < found["fastest_per_s"] <= found["allowed_per_s"]
    assert found["highest"] == pytest.approx(max(found["columns"]["p1_cmd_mpa"]), abs=1e-3)


def test_a_sweep_that_leaves_the_envelope_is_one_line(tmp_path: Path) -> None:
    sweep = tmp_path / "far.yaml"
    sweep.write_text("duration_s: 2.0\nrecords: [{sine: {frequency_hz: 0.5, amplitude_mpa: 0.9}}]\n")
    with pytest.raises(EnvelopeError, match="allowed is"):
        curves.preview(sweep, compose.load(None))


def test_a_record_is_shown_with_what_it_says_of_itself() -> None:
    found = curves.record(SINE)
    assert found["valid"] is True
    assert found["ended"] == "complete"
    assert len(found["columns"]["t_s"]) == len(found["columns"]["output"]) <= curves.CURVE_POINTS + 2
    assert any("phase sweep" in line["text"] for line in found["lines"])
    assert curves.findings(SINE) == []


def test_a_record_beside_itself_differs_by_nothing_and_beside_another_it_does() -> None:
    same = curves.compared(SINE, SINE)
    assert same["max"] == 0
    assert set(same["difference"]) == {0.0}
    other = curves.compared(SINE, TRIANGLE)
    assert other["rmse"] > 1
    assert len(other["a"]["t_s"]) == len(other["b"]["output"]) == len(other["difference"])


def test_what_is_no_record_is_told_in_one_line(tmp_path: Path) -> None:
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(SINE.read_bytes()[:5000])
    assert curves.facts_of(broken)["valid"] is False
    assert curves.facts_of(broken)["problem"]
    with pytest.raises(RigError):
        curves.record(broken)
