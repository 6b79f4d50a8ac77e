"""Who reads the clock goes first, and who computes steps back for it (decisions 0712, 0723)."""

import os

import pytest
from conftest import STEPS_BACK, arranged, holds_a_browser, may_come_forward, reads_the_clock

BESIDE_OTHERS = "PYTEST_XDIST_WORKER" in os.environ


def nicer() -> int:
    """By how much this process is nicer than who started it."""
    return os.getpriority(os.PRIO_PROCESS, 0) - os.getpriority(os.PRIO_PROCESS, os.getppid())


def test_who_reads_the_clock_goes_first(request: pytest.FixtureRequest) -> None:
    clocks = [reads_the_clock(item) for item in request.session.items if not holds_a_browser(item)]
    assert clocks == sorted(clocks, reverse=True)
    assert clocks.count(True) >= 1, "the test below"


@pytest.mark.parametrize(
    ("workers", "order"),
    [
        (1, ["clock"] * 2 + ["browser"] * 2 + ["rest"] * 8),
        (3, ["clock"] * 2 + ["rest"] * 2 + ["browser"] * 2 + ["rest"] * 6),
        (6, ["clock"] * 2 + ["browser"] * 2 + ["rest"] * 8),
        (12, ["clock"] * 2 + ["browser"] * 2 + ["rest"] * 8),
    ],
)
def test_clock_and_browsers_begin_the_pieces_of_two_workers(workers: int, order: list[str]) -> None:
    assert arranged(["clock"] * 2, ["browser"] * 2, ["rest"] * 8, workers) == order


@pytest.mark.skipif(not BESIDE_OTHERS, reason="there is nobody to step back for")
@pytest.mark.skipif(not may_come_forward(), reason="who may not come forward again stays")
def test_who_computes_steps_back() -> None:
    assert 0 < nicer() <= STEPS_BACK


@pytest.mark.real_time
@pytest.mark.skipif(not BESIDE_OTHERS, reason="only workers step back")
def test_who_reads_the_clock_stays() -> None:
    assert nicer() == 0
