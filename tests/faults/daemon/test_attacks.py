"""The emergency stop while somebody keeps the daemon busy. `pamrig faults --attacks 100` measures the same in
earnest."""

from collections.abc import Iterator
from pathlib import Path
from statistics import median

import pytest

from rig.qualify.faults.attacks import ATTACKS, GOAL_MS, Attack, StopTimes, bench_in, free_port, shortfall, time_stops
from rig.qualify.faults.bench import FaultBench

TRIALS = 4
HELD_UP_MS = 40.0
"""What no single stop may take: so few of them have no p99."""


@pytest.fixture(scope="module")
def port() -> int:
    return free_port()


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory, port: int) -> Iterator[FaultBench]:
    folder = Path(tmp_path_factory.mktemp("attacks"))
    with bench_in(folder, port) as bench:
        yield bench


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.name)
def test_an_emergency_stop_is_in_time_whatever_else_is_asked(bench: FaultBench, port: int, attack: Attack) -> None:
    times = time_stops(bench, attack, port, TRIALS, 1, lambda *_: None)
    assert times.problem == ""
    assert median(times.ms) <= GOAL_MS
    assert max(times.ms) <= HELD_UP_MS


def test_a_stop_that_came_late_or_for_another_reason_is_found_out() -> None:
    none = ATTACKS[0]
    assert shortfall([StopTimes(none, [5.0] * 99 + [90.0])]) == ""
    assert (
        shortfall([StopTimes(none, [5.0] * 98 + [12.0] * 2)])
        == "none: p99 of the emergency stop is 12.0 ms; at most 10 ms"
    )
    assert shortfall([StopTimes(none, [5.0], problem="the rig stopped for another reason: CONTROL_LOST")]).endswith(
        "CONTROL_LOST"
    )


def test_how_sure_a_quantile_is_follows_from_the_number_of_stops() -> None:
    few, many = (
        StopTimes(ATTACKS[0], [float(n) for n in range(200)]),
        StopTimes(ATTACKS[0], [float(n) for n in range(1000)]),
    )
    low, high = few.interval_ms(0.99)
    assert low < few.quantile(0.99) < high == float("inf")
    low, high = many.interval_ms(0.99)
    assert 980.0 <= low < many.quantile(0.99) < high <= 997.0
    assert many.late == 1000 - 11
