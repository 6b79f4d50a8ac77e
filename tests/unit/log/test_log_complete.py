"""Complete, stopped, faulted: what a file says of it, what `check` finds, and what a folder gives to identification and
diagnosis."""

import logging
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.records.made_logs import made_content

from rig.app.records.logs import describe, plain_lines
from rig.app.runs.replaying import prepare
from rig.errors import RecordError
from rig.log.check import check
from rig.log.convert import write_content
from rig.log.exchange import export
from rig.log.mcap.collector import LogLine
from rig.log.mcap.schema import ended_of
from rig.log.reader import read

DIED = "LOOP_DIED: the loop ended or hung"
HOW: dict[str, Mapping[str, Any]] = {
    "complete": {"valid": True, "complete": True, "ended": "complete"},
    "stopped": {"valid": False, "complete": False, "ended": "stopped"},
    "fault": {"valid": False, "complete": False, "ended": "fault", "fault": DIED},
    "cut": {"valid": False, "ended": "cut"},
    "stopped, by an older file": {"valid": True, "complete": False},
    "fault, by an older file": {"valid": False, "complete": False, "fault": DIED},
}
FINDS = {
    "complete": [],
    "stopped": ["the run was stopped before its sweep was over"],
    "fault": [f"the run ended in a fault: {DIED}"],
    "cut": ["the recording breaks off, or lacks a part"],
    "stopped, by an older file": [
        "the run was stopped before its sweep was over",
        "`valid` is true, and should be false for that",
    ],
    "fault, by an older file": [f"the run ended in a fault: {DIED}"],
}


def made(path: Path, how: str, **more: Any) -> Path:
    """A recording that ended so."""
    content = made_content(**more)
    result = {key: value for key, value in content.result_facts.items() if key != "fault"} | HOW[how]
    return write_content(replace(content, result_facts=result), path)


@pytest.mark.parametrize("how", list(HOW))
def test_check_says_how_it_ended(tmp_path: Path, how: str) -> None:
    assert check(made(tmp_path / "x.mcap", how)) == FINDS[how]
    assert describe(tmp_path / "x.mcap")["ended"] == how.partition(",")[0]


def test_records_that_say_nothing_of_it_are_no_less_for_that() -> None:
    assert ended_of({}) is None
    assert ended_of({"ended": "sideways"}) is None
    assert ended_of({"complete": "yes"}) is None
    assert ended_of({"fault": ""}) is None


def test_check_names_what_stands_in_the_files_own_log(tmp_path: Path) -> None:
    content = made_content()
    at_ns = int(content.samples.log_time_ns[500])
    lines = (
        LogLine(at_ns, "fatal", DIED),
        LogLine(at_ns + 1, "fatal", DIED),
        LogLine(at_ns, "warning", "3 ticks missed"),
    )
    path = write_content(replace(content, lines=lines), tmp_path / "x.mcap")
    assert check(path) == [f"its log says fatal at 2.500 s: {DIED}"]


@pytest.mark.parametrize("how", [how for how in HOW if how != "complete"])
def test_a_folder_gives_the_complete_records_and_names_the_others(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, how: str
) -> None:
    made(tmp_path / "good.mcap", "complete")
    bad = made(tmp_path / "bad.mcap", how)
    with caplog.at_level(logging.WARNING, "pamrig"):
        assert [record.source for record in read(tmp_path)] == [tmp_path / "good.mcap"]
    assert f"{bad}: left out: it" in caplog.text
    assert len(read(bad)) == 1, "named itself it is read"


def test_a_folder_of_replays_and_of_exports_too(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    made(tmp_path / "good.mcap", "complete")
    made(tmp_path / "stopped.mcap", "stopped")
    assert [each.name for each in prepare(tmp_path, None, None, None, False).recordings] == ["good"]
    content = made_content()
    export(replace(content, result_facts=dict(content.result_facts) | HOW["stopped"]), tmp_path / "table.csv", "csv")
    assert len(read(tmp_path)) == 1
    assert "table.csv: left out" in caplog.text


def test_a_folder_with_nothing_complete_is_refused(tmp_path: Path) -> None:
    made(tmp_path / "x.mcap", "stopped")
    with pytest.raises(RecordError, match=r"x\.mcap: left out: it was stopped .* nothing in .* is complete"):
        read(tmp_path)


def test_the_start_is_a_date_too(tmp_path: Path) -> None:
    made(tmp_path / "x.mcap", "complete")
    lines = list(plain_lines(describe(tmp_path / "x.mcap")))
    assert "  started_ns: 1790000000000000000 (2026-09-21 14:13:20 UTC)" in lines
    assert "ended: complete" in lines
