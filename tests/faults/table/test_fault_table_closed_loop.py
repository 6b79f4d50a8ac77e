"""Faults of device, loop, control and operator while an angle is followed in closed loop, with the bounds of the table.

The other rows do not touch what the loop computes; `pamrig faults --closed-loop` carries out all of them.
"""

from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.qualify.faults.bench import CLOSED_LOOP_SWEEP, FaultBench
from rig.qualify.faults.table import CLOSED_LOOP_TABLE, TABLE, FaultRow
from rig.qualify.faults.trial import try_row

TRIED = (
    *("late", "skip", "misses", "stall", "timeout", "timeouts", "garbled", "lost", "hang", "frozen", "nan", "range"),
    *("jump", "wire", "stale", "air", "loop killed", "loop stopped", "control stopped", "estop"),
)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FaultBench]:
    with FaultBench(Path(tmp_path_factory.mktemp("closed")), sweep=CLOSED_LOOP_SWEEP) as bench:
        yield bench


@pytest.mark.parametrize("row", [row for row in CLOSED_LOOP_TABLE if row.name in TRIED], ids=lambda row: row.name)
def test_a_fault_in_closed_loop_ends_as_the_table_says(bench: FaultBench, row: FaultRow) -> None:
    finding = try_row(bench, row)
    assert finding.problem == ""


def test_the_bounds_are_those_of_the_open_loop() -> None:
    assert [(row.name, row.bound_ms) for row in CLOSED_LOOP_TABLE] == [(row.name, row.bound_ms) for row in TABLE]
    assert {row.name for row in CLOSED_LOOP_TABLE} >= set(TRIED)
