"""What somebody types in answer to a question."""

import io
import sys
from collections.abc import Callable
from typing import Any

import click
import pytest

from rig.app.terminal import answer_to


class Struck(io.RawIOBase):
    """A stream during whose first writing a signal strikes."""

    struck = False

    def writable(self) -> bool:
        return True

    def write(self, data: Any, /) -> int:
        if self.struck:
            return len(data)
        self.struck = True
        raise KeyboardInterrupt


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    def put(text: str) -> None:
        monkeypatch.setattr(sys, "stdin", io.StringIO(text))

    return put


def test_a_signal_that_strikes_while_the_question_is_written_is_not_lost(
    typed: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """`input()` clears what its flush raises and goes on with the next line."""
    typed("0.1\n0.2\n")
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BufferedWriter(Struck()), encoding="utf-8"))
    with pytest.raises(KeyboardInterrupt):
        answer_to("angle 1 [deg]")


def test_lines_are_answers_one_by_one_until_there_is_none(
    typed: Callable[[str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    typed("0.1\n\nlast")
    assert [answer_to("angle") for _ in range(3)] == ["0.1", "", "last"]
    assert capsys.readouterr().out == 3 * "angle: "
    with pytest.raises(click.Abort):
        answer_to("angle")
