"""The pytest plugin from inside: what its assertions let pass, and how they fail."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pamrig
import pytest

SWEEP = {"settle_s": 0.5, "duration_s": 1.0, "records": [{"sine": {"frequency_hz": 1.0, "amplitude_mpa": 0.1}}]}


def test_close_and_not_close(run_sweep: Any, simulated_rig: Any, assert_close_to: Any) -> None:
    (record,) = run_sweep(SWEEP, simulated_rig(seed=2, drift=0.0))
    off = pamrig.Record.of(replace(record, angle_deg=record.angle_deg + 0.3))
    assert_close_to(off, record, within=0.31)
    with pytest.raises(pytest.fail.Exception, match=r"differs by 0\.3 deg, allowed 0\.29"):
        assert_close_to(off, record, within=0.29)
    with pytest.raises(pytest.fail.Exception, match="no reference yet; `pytest --pamrig-update` writes it"):
        assert_close_to(off, within=1.0)


def test_a_run_that_is_not_valid_fails_the_test(run_sweep: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def faulty(*_: Any, **__: Any) -> None:
        raise pamrig.CheckFailed("sine.mcap: SENSOR_FROZEN")

    monkeypatch.setattr(pamrig, "run", faulty)
    with pytest.raises(pytest.fail.Exception, match="SENSOR_FROZEN"):
        run_sweep(SWEEP)


def test_a_sweep_that_leaves_the_envelope_is_an_error_and_nothing_runs(run_sweep: Any, tmp_path: Path) -> None:
    wild = {"records": [{"sine": {"frequency_hz": 1.0, "amplitude_mpa": 0.9}}]}
    with pytest.raises(pamrig.Error):
        run_sweep(wild)
