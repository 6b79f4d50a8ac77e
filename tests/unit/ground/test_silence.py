"""Who is silent, and who only seems to be because the listener itself stood still: by a clock that the test turns."""

import time
from collections.abc import Callable

import pytest

from rig.silence import Silence

PATIENCE_NS = 1000
FIRST_NS = 5000


@pytest.fixture
def at(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Turns the clock."""
    return lambda now_ns: monkeypatch.setattr(time, "monotonic_ns", lambda: now_ns)


def found_ns(at: Callable[[int], None], every_ns: int) -> int:
    """How long after its last beat somebody who is gone is found out, with a look each `every_ns`."""
    silence, now_ns = Silence(PATIENCE_NS), FIRST_NS
    at(now_ns)
    while not silence.too_long(FIRST_NS):
        now_ns += every_ns
        at(now_ns)
    return now_ns - FIRST_NS


def test_before_the_first_beat_nobody_is_silent(at: Callable[[int], None]) -> None:
    silence = Silence(PATIENCE_NS)
    for now_ns in range(FIRST_NS, FIRST_NS + 3 * PATIENCE_NS, 100):
        at(now_ns)
        assert not silence.too_long(0)


def test_patience_ends_when_it_is_over_and_not_before(at: Callable[[int], None]) -> None:
    assert found_ns(at, 1) == PATIENCE_NS + 1
    assert found_ns(at, 50) == PATIENCE_NS + 50


def test_a_pause_of_the_listener_is_not_the_others_silence(at: Callable[[int], None]) -> None:
    silence = Silence(PATIENCE_NS)
    at(FIRST_NS)
    assert not silence.too_long(FIRST_NS - 10)
    at(FIRST_NS + 100 * PATIENCE_NS)
    assert not silence.too_long(FIRST_NS - 10), "the machine stood still"
    at(FIRST_NS + 100 * PATIENCE_NS + 5)
    assert not silence.too_long(FIRST_NS + 100 * PATIENCE_NS + 1), "and the other goes on"
    for late_ns in range(105, 1006, 100):
        at(FIRST_NS + 100 * PATIENCE_NS + late_ns)
        gone = silence.too_long(FIRST_NS + 100 * PATIENCE_NS + 1)
    assert gone


def test_who_is_gone_is_found_out_by_a_listener_that_hardly_ever_looks(at: Callable[[int], None]) -> None:
    assert found_ns(at, 10 * PATIENCE_NS) == 5 * 10 * PATIENCE_NS


def test_a_beat_that_promises_to_be_away_is_waited_for(at: Callable[[int], None]) -> None:
    silence, until_ns = Silence(PATIENCE_NS), FIRST_NS + 5 * PATIENCE_NS
    for now_ns in range(FIRST_NS, until_ns + PATIENCE_NS + 1, 50):
        at(now_ns)
        assert not silence.too_long(until_ns)
    at(until_ns + PATIENCE_NS + 51)
    assert silence.too_long(until_ns)
