"""What a name, a fact or a daemon says comes to the terminal as text: no control codes, no markup, names stay
whole, and one that is gone ends nobody."""

import errno
import io
import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from rich.console import Console
from rich.text import Text
from support.records.made_logs import made_content

from rig.app.terminal import console, listing, progress, say, styled
from rig.cli.commands import cli
from rig.cli.service.status_lines import status_lines
from rig.log.convert import write_content
from rig.report.shown_text import in_one_line

HOSTILE = "\x1b[2J\x1b]0;title\x07\r\u202e[/x][bold]\n  log: ok\ud800"


def test_facts_log_lines_and_findings_reach_the_terminal_as_text(tmp_path: Path) -> None:
    content = made_content()
    path = tmp_path / "x.mcap"
    facts = {**content.run_facts, "operator": HOSTILE, "p0_mpa": HOSTILE, "device": {HOSTILE: HOSTILE}}
    write_content(replace(content, run_facts=facts), path)
    for words in (["info"], ["check"]):
        shown = CliRunner().invoke(cli, ["log", *words, str(path)]).output
        assert not [letter for letter in shown if letter != "\n" and not letter.isprintable()]
        assert "\n  log: ok" not in shown


def test_a_name_with_brackets_is_a_name() -> None:
    terminal = console()
    terminal.file = io.StringIO()
    terminal.print("[/x] [bold]")
    terminal.print(styled(("[/y]", "bold"), " \x1b"))
    table = listing("[/z]")
    table.add_row("[/q]")
    terminal.print(table)
    assert [line.rstrip() for line in terminal.file.getvalue().splitlines()] == [
        "[/x] [bold]",
        "[/y] \\x1b",
        "[/z]",
        "[/q]",
    ]


def test_a_name_of_two_lines_is_no_second_row(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdout", shown := io.StringIO())
    table = listing("day", "gap")
    table.add_row("monday\ntuesday", "0.1 deg")
    console().print(table)
    assert [line.split() for line in shown.getvalue().splitlines()[1:]] == [["monday\\ntuesday", "0.1", "deg"]]


@pytest.mark.parametrize("name", ["logs[/x]/a.mcap: no space", HOSTILE, "[bold]N"])
def test_a_note_beside_a_progress_bar_is_text(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder, a device or an own unit called like that ended a run with a traceback, on a terminal alone."""
    shown = io.StringIO()
    monkeypatch.setattr("rich.console.Console", partial(Console, file=shown, force_terminal=True, width=200))
    with progress(name, 10) as update:
        update(1, name)
    assert in_one_line(name) in shown.getvalue()


def status(**changed: Any) -> dict[str, Any]:
    """A daemon's status with little in it."""
    plain: dict[str, Any] = dict.fromkeys(("session", "record", "fault", "loop"))
    return plain | {
        "rig": "r", "state": "armed", "uptime_s": 1.0, "pause_s": 0, "queue": [], "processes": {}, "realtime": {},
        "disk_free_gb": 1.0, "logs": "logs", "left_s": 0, "working": False, "retention": None,
    } | changed  # fmt: skip


@pytest.mark.parametrize("name", ["[/x]", HOSTILE, "a\\", "[bold]"])
def test_a_daemon_may_say_anything_in_its_status(name: str) -> None:
    fault = {"name": "X", "cause": name, "said": name, "hint": name}
    record = {"name": name, "done": 0.5, "left_s": 1}
    shown = [
        Text.from_markup(line).plain for line in status_lines(status(rig=name, fault=fault, record=record, logs=name))
    ]
    assert in_one_line(name) in shown[0]
    assert not [letter for line in shown for letter in line if not letter.isprintable()]


class Narrow(io.StringIO):
    """A terminal, by what it says of itself, or a pipe."""

    def __init__(self, *, terminal: bool) -> None:
        super().__init__()
        self._terminal = terminal

    def isatty(self) -> bool:
        return self._terminal


@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize("width", [20, 40, 1000])
def test_names_and_figures_stay_whole_however_narrow_the_terminal_is(
    width: int, terminal: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdout", Narrow(terminal=terminal))
    monkeypatch.setenv("COLUMNS", str(width))
    shown = console()
    name, said = "a_record_with_a_long_name_0.2hz_0.20mpa", "some words that may be folded into more than one line"
    table = listing("record", "rmse_deg", "what came of it")
    table.add_row(name, "0.182", said)
    shown.print(table)
    text = shown.file.getvalue()  # type: ignore[attr-defined]
    assert {name, "0.182", "rmse_deg", *said.split()} <= {*re.sub(r"\x1b\[[0-9;]*m", " ", text).split()}


class GoneTerminal(io.StringIO):
    """A terminal whose other end is closed, as by a network that is lost."""

    def write(self, text: str) -> int:
        raise OSError(errno.EIO, f"nobody reads {text!r}")


def test_who_goes_on_is_not_ended_by_a_terminal_that_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", GoneTerminal())
    with pytest.raises(OSError, match="nobody reads"):
        console("-").print("the rig")
    say("the rig", "yellow")
