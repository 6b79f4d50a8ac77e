"""A short soak, in virtual and in real time: it gets through, and what it says of itself agrees with its records."""

import json
from pathlib import Path

from click.testing import CliRunner

from rig.cli.qualify.faults import faults
from rig.errors import RigError
from rig.qualify.soak import SWEEP, soak

QUICK = SWEEP.replace("settle_s: 2.0", "settle_s: 0.1\nzero_s: 0.05\nramp_in_s: 0.1\nramp_out_s: 0.1")
"""What is around a record may be short: watched are processes, and misses beside what the witnesses saw."""


def test_in_virtual_time_nothing_is_missed_and_no_machine_is_blamed(tmp_path: Path) -> None:
    found = soak(tmp_path, 0.01, virtual=True, note=lambda *_: None, record_s=8.0)
    assert (found["done"], found["missed"], found["dropped"], found["not_valid"]) == (found["records"], 0, 0, 0)
    assert found["machine"] == {}


def test_in_real_time_misses_are_put_beside_what_the_witnesses_saw(tmp_path: Path) -> None:
    found = soak(tmp_path, 0.001, virtual=False, note=lambda *_: None, record_s=0.5, sweep=QUICK)
    machine = found["machine"]
    assert found["done"] == found["records"]
    assert machine["not_valid"] == found["not_valid"]
    assert machine["missed_in_stalls"] <= machine["missed_in_records"] <= found["missed"]
    assert machine["cores"]
    assert bool(machine["witness_priority"]) != bool(machine["nothing_excused_because"])
    json.dumps(found)


def test_a_folder_that_was_used_is_refused(tmp_path: Path) -> None:
    (tmp_path / "old.mcap").touch()
    done = CliRunner().invoke(faults, ["--soak", "0.01", "-o", str(tmp_path)])
    assert isinstance(done.exception, RigError)
    assert "is not empty" in str(done.exception)
