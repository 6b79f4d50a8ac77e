"""The status as a person reads it after a fault: what is old is called old, and what was written is said with who saw
it."""

from typing import Any

import pytest
from rich.text import Text

from rig.cli.service.status_lines import dead_lines, loop_lines, safe_lines

LOOP: dict[str, Any] = {
    "tick": 1, "p1_cmd_mpa": 0.116, "p2_cmd_mpa": 0.284, "p1_mpa": 0.12, "p2_mpa": 0.28, "angle_deg": -7.0,
    "lateness_us": {},
}  # fmt: skip


def plain(lines: Any) -> list[str]:
    return [Text.from_markup(line).plain for line in lines]


def test_values_of_a_loop_that_is_gone_are_the_last_ones_seen() -> None:
    (line,) = plain(loop_lines(LOOP | {"age_s": 3.24, "live": False}))
    assert line.startswith("last seen 3.2 s ago, not live: set-points 0.116 0.284 MPa")


def test_values_of_a_loop_that_ticks_are_shown_as_they_are() -> None:
    (line,) = plain(loop_lines(LOOP | {"age_s": 0.004, "live": True}))
    assert line.startswith("set-points 0.116")


@pytest.mark.parametrize("ago", [None, 2.0])
def test_the_safe_state_is_told_with_what_by_whom_and_when(ago: float | None) -> None:
    words = (
        "safe state written by the guardian, seen at the device" if ago else "nobody has reported the safe state yet"
    )
    report = {
        "words": words,
        "outcome": "seen" if ago else "unknown",
        "confirmed": bool(ago),
        "safe": bool(ago),
        "p1_mpa": 0.2,
        "p2_mpa": 0.2,
        "written_ago_s": ago,
    }
    assert plain(safe_lines(report)) == [f"  {words}" + (": 0.200 0.200 MPa, 2.0 s ago" if ago else "")]


def test_processes_that_are_gone_are_explained() -> None:
    (line,) = plain(dead_lines(["loop", "recorder", "supervisor"]))
    assert line == (
        "not running: loop, recorder, supervisor: nothing commands or measures the rig; `pamrig reset` starts them "
        "anew, disarmed"
    )
    (line,) = plain(dead_lines(["recorder", "guardian"]))
    assert "nothing is recorded, nobody stands in for the supervisor" in line
    assert plain(dead_lines([])) == []
