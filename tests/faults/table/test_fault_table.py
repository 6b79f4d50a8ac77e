"""Every row of the fault table with real processes and real signals: cause, time to the safe state, evidence.

The bounds are those of the table; a trial is repeated when the machine itself stood still (see
rig.qualify.faults.trial).
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.log.mcap.writer import PARTIAL_SUFFIX
from rig.qualify.faults.bench import FaultBench
from rig.qualify.faults.table import TABLE, FaultRow
from rig.qualify.faults.trial import try_row
from rig.realtime.faults import Fault

RENAMING = """
import os, sys
print(flush=True)
while True:
    for record in sys.argv[1:]:
        os.rename(record, record + "{ending}")
        os.rename(record + "{ending}", record)
"""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FaultBench]:
    with FaultBench(Path(tmp_path_factory.mktemp("faults"))) as bench:
        yield bench


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_a_fault_ends_as_the_table_says(bench: FaultBench, row: FaultRow) -> None:
    finding = try_row(bench, row)
    assert finding.problem == ""


def test_the_table_names_real_faults_and_each_row_once() -> None:
    assert len({row.name for row in TABLE}) == len(TABLE)
    assert {cause for row in TABLE for cause in row.causes} <= {fault.name for fault in Fault}


def test_the_record_that_is_moved_is_the_one_that_is_written(bench: FaultBench) -> None:
    """Not one that a recorder left when it was killed: the run went on, and the trial waited 40 s for its end, four
    times over where the folder was listed so."""
    left = [bench.logs / f"left_{number}" / f"record.mcap{PARTIAL_SUFFIX}" for number in range(20)]
    for partial in left:
        partial.parent.mkdir(parents=True)
        partial.touch()
    finding = try_row(bench, next(row for row in TABLE if row.name == "moved"))
    assert finding.problem == ""
    assert all(partial.exists() for partial in left)


def test_a_row_that_expects_the_wrong_cause_is_found_out(bench: FaultBench) -> None:
    wrong = next(row for row in TABLE if row.name == "estop")
    finding = try_row(bench, FaultRow("wrong", "estop", wrong.act, ("BROKEN_WIRE",), 1000.0))
    assert finding.problem == "the cause is given as ESTOP, not BROKEN_WIRE"


def test_a_record_that_gets_its_last_name_while_it_is_looked_for_is_looked_for_again(bench: FaultBench) -> None:
    """Its recorder gave it that between the list of names and the look at their times, and the trial ended in
    FileNotFoundError."""
    folder, records = bench.logs / "renamed", [f"record_{number}.mcap" for number in range(4)]
    folder.mkdir(parents=True)
    for record in records:
        (folder / record).touch()
        os.utime(folder / record, (0.0, 0.0))  # older than any trial's own
    call = [sys.executable, "-c", RENAMING.format(ending=PARTIAL_SUFFIX), *records]
    recorder = subprocess.Popen(call, cwd=folder, stdout=subprocess.PIPE)
    assert recorder.stdout
    recorder.stdout.readline()
    row = next(row for row in TABLE if row.name == "frozen")
    try:
        assert [try_row(bench, row).problem for _ in range(4)] == [""] * 4
    finally:
        recorder.kill()
        recorder.communicate()
        shutil.rmtree(folder)
