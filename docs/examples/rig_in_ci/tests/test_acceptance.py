"""The laboratory's sweep on the simulated rig: it runs, it does what it did, and a worn rig is noticed."""

from pathlib import Path

import pytest

SWEEP = Path(__file__).parent.parent / "sweeps" / "acceptance.yaml"


def test_the_sweep_runs_within_the_envelope(run_sweep):
    records = run_sweep(SWEEP)
    assert [record.name for record in records] == [
        "sine_0.25hz_0.15mpa",
        "sine_0.5hz_0.15mpa",
        "triangle_0.5hz_0.20mpa",
    ]
    assert all(abs(record.angle_deg).max() < 50.0 for record in records)


def test_the_rig_does_what_it_did(run_sweep, simulated_rig, assert_close_to):
    triangle = run_sweep(SWEEP, simulated_rig(seed=1))[-1]
    assert_close_to(triangle, within=0.5)


def test_a_healthy_rig_has_no_gap(run_sweep, simulated_rig, assert_no_gap):
    assert_no_gap(run_sweep(SWEEP, simulated_rig(seed=4)))


def test_a_worn_rig_has_one(run_sweep, simulated_rig, assert_no_gap):
    worn = simulated_rig(effects={"delay": {"delay_s": 0.03}}, seed=4)
    with pytest.raises(pytest.fail.Exception, match="30 ms later"):
        assert_no_gap(run_sweep(SWEEP, worn))
