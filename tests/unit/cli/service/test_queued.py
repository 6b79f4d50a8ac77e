"""The queue in the terminal: the question about what was interrupted, and how waiting for it ends."""

from contextlib import nullcontext
from typing import Any

import click
import pytest
from click.testing import CliRunner
from rich.console import Console

from rig.cli.service import daemon, queued
from rig.errors import CheckFailed


def job(**fields: Any) -> dict[str, Any]:
    usual = {
        "id": 1,
        "name": "paper",
        "state": "stopped",
        "total": 15,
        "done": 2,
        "seconds": 225.0,
        "not_valid": 0,
        "error": "",
    }
    return usual | fields


class WorkingDaemon:
    """A client of a daemon that works on its queue."""

    def __init__(self, _: Any) -> None: ...

    def __enter__(self) -> "WorkingDaemon":
        return self

    def __exit__(self, *_: object) -> None: ...

    def status(self) -> dict[str, Any]:
        return {"queue": [job(state="running")], "interrupted": []}

    def start(self, *_paths: Any, **_options: Any) -> list[dict[str, Any]]:
        return []


class Done:
    """A client whose daemon has just finished."""

    def __init__(self, *jobs: dict[str, Any], fault: dict[str, str] | None = None) -> None:
        self._status = {"queue": list(jobs), "fault": fault}

    def wait(self) -> dict[str, Any]:
        return self._status


def test_a_start_that_changes_nothing_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rig.service.client.Client", WorkingDaemon)
    assert CliRunner().invoke(daemon.start, []).output == "the queue is worked on already\n"


def test_what_nobody_goes_on_with_is_what_the_daemon_says() -> None:
    status = {"queue": [job(), job(id=2, state="done"), job(id=3, state="waiting")], "interrupted": [1, 3]}
    assert [each["state"] for each in queued.interrupted(status)] == ["stopped", "waiting"]
    assert queued.interrupted(status | {"interrupted": []}) == []
    assert queued.described([job()]) == "paper (13 of 15 records); 195 s"


@pytest.mark.parametrize(("answer", "means"), [("first", "first"), ("only", "leave")])
def test_the_question_says_what_would_move(
    answer: str, means: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(click, "prompt", lambda *_args, **_kwargs: answer)
    assert queued.ask([job()]) == means
    assert "the queue still holds paper (13 of 15 records); 195 s" in capsys.readouterr().out


def test_the_answer_nothing_starts_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(click, "prompt", lambda *_args, **_kwargs: "nothing")
    with pytest.raises(click.Abort):
        queued.ask([job()])


def test_waiting_ends_well_only_when_all_was_done_and_is_valid() -> None:
    client: Any = Done(job(state="done", done=15), job(id=2))
    queued.wait(client, [1])
    for wrong, said in (
        (Done(job(error="stopped by the operator")), "job 1 paper: stopped by the operator"),
        (Done(job(state="done", not_valid=3)), "job 1 paper: 3 records not valid"),
        (Done(job(state="done"), fault={"name": "ESTOP", "cause": "emergency stop"}), "ESTOP: emergency stop"),
    ):
        broken: Any = wrong
        with pytest.raises(CheckFailed, match=said):
            queued.wait(broken, [1])


@pytest.mark.parametrize("words", [["--first", "--only", "quick"], ["--only"], ["--first", "--wait"]])
def test_what_is_to_become_of_the_old_queue_is_said_once_and_with_new_sweeps(
    words: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rig.service.client.Client", lambda _: nullcontext())
    done = CliRunner().invoke(daemon.start, words)
    assert (done.exit_code, "one of them, and with SWEEPS" in done.output) == (2, True)


def test_the_table_shows_what_is_left_and_takes_no_markup_from_names() -> None:
    terminal = Console(width=200)
    with terminal.capture() as shown:
        terminal.print(queued.table([job(name="[/x]", not_valid=1, error="why")]))
    assert "[/x]" in shown.get()
    assert "195 s" in shown.get()
    assert "1 not valid; why" in shown.get()
