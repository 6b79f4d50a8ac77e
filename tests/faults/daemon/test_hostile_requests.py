"""Lines and requests that are nearly right, at a daemon and its page: a few of the thousands that
tests/hostile_requests.py makes."""

import itertools
from contextlib import closing
from pathlib import Path

import hostile_requests

COUNT = 2 * hostile_requests.EVERY + 2


def test_whatever_is_asked_is_answered_and_an_emergency_stop_still_stops(tmp_path: Path) -> None:
    with closing(hostile_requests.one(tmp_path, 1)) as inputs:
        done = [tried() for _, _, tried in itertools.islice(inputs, COUNT)]
    assert len(done) == COUNT, "each try asserts for itself"
