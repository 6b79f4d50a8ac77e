"""Who reads the clock goes first, and who computes steps back for it (decision 0712)."""

import os

import pytest
from conftest import STEPS_BACK, may_come_forward, reads_the_clock

BESIDE_OTHERS = "PYTEST_XDIST_WORKER" in os.environ


def nicer() -> int:
    """By how much this process is nicer than who started it."""
    return os.getpriority(os.PRIO_PROCESS, 0) - os.getpriority(os.PRIO_PROCESS, os.getppid())


def test_who_reads_the_clock_goes_first(request: pytest.FixtureRequest) -> None:
    if request.config.getoption("--shuffle") is not None:
        pytest.skip("in an order that was drawn")
    clocks = [reads_the_clock(item) for item in request.session.items]
    assert clocks == sorted(clocks, reverse=True)
    assert clocks.count(True) >= 1, "the test below"


@pytest.mark.skipif(not BESIDE_OTHERS, reason="there is nobody to step back for")
@pytest.mark.skipif(not may_come_forward(), reason="who may not come forward again stays")
def test_who_computes_steps_back() -> None:
    assert 0 < nicer() <= STEPS_BACK


@pytest.mark.real_time
@pytest.mark.skipif(not BESIDE_OTHERS, reason="only workers step back")
def test_who_reads_the_clock_stays() -> None:
    assert nicer() == 0
