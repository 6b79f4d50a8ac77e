"""The loop lost over Modbus TCP: real driver, module emulated in a process of its own, times taken at its output
registers."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.qualify.faults.table import TABLE
from rig.qualify.faults.trial import try_row
from rig.qualify.faults.wired import ModbusFaultBench


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModbusFaultBench]:
    with ModbusFaultBench(Path(tmp_path_factory.mktemp("modbus"))) as bench:
        yield bench


def test_arming_says_what_an_operator_must_know(bench: ModbusFaultBench) -> None:
    bench.start()
    with bench.client() as client:
        said = client.arm()
        client.stop()
    assert any(line.startswith("failsafe: ") for line in said)
    assert [line for line in said if "angle" in line and "never calibrated" in line], (
        "a potentiometer that was never calibrated"
    )


def test_what_was_answered_is_known_to_the_next_request(bench: ModbusFaultBench) -> None:
    """A start that followed an arming at once was refused now and then: "cannot start while disarmed"."""
    for _ in range(15):
        bench.at_rest()
        with bench.client() as client:
            client.arm()
            (job,) = client.start(bench.sweep, before="leave")
            client.stop()
        assert job["records"] > 0


@pytest.mark.parametrize("name", ["estop", "loop ended", "loop killed", "loop stopped"])
def test_the_outputs_of_the_module_are_safe_in_time(bench: ModbusFaultBench, name: str) -> None:
    finding = try_row(bench, next(row for row in TABLE if row.name == name))
    assert finding.problem == ""
