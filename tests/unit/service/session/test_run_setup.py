"""What the recorder is told of a run."""

import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rig.service.session.run_setup import order_of

YEAR_NS = 365 * 86400 * 10**9


@pytest.mark.parametrize("virtual", [False, True])
def test_a_record_s_times_are_those_of_the_clock_as_it_is_set_when_the_record_begins(
    virtual: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A session that began before the network had set the clock wrote records of years ago, for as long as it lived."""
    session: Any = SimpleNamespace(virtual=virtual, facts={"wall_offset_ns": 12})
    monkeypatch.setattr(time, "time_ns", lambda: 50 * YEAR_NS)
    monkeypatch.setattr(time, "monotonic_ns", lambda: YEAR_NS)
    order = order_of(session, 1, 10, Path("a.mcap"), {}, {})
    assert order.wall_offset_ns == (12 if virtual else 49 * YEAR_NS)
