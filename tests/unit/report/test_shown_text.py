"""What others wrote is shown as text: nothing of it is obeyed, and nothing that can be read is lost."""

import pytest

from rig.report.shown_text import in_lines, in_one_line


@pytest.mark.parametrize("shown", [in_one_line, in_lines])
def test_what_moves_the_cursor_or_turns_the_line_is_spelled_out(shown: type) -> None:
    assert shown("\x1b[31mred\x9b\r\u202e\u200b\ud800") == "\\x1b[31mred\\x9b\\r\\u202e\\u200b\\ud800"


@pytest.mark.parametrize("text", ["ÄÖ µ °", "Druck\u00a01", "p\u202f2", "压力", "⠀⣿"])
def test_letters_signs_and_spaces_stay(text: str) -> None:
    assert in_one_line(text) == in_lines(text) == text


def test_only_a_text_of_lines_keeps_its_line_breaks() -> None:
    assert in_lines("two\nlines\tand\u2028") == "two\nlines\\tand\\u2028"
    assert in_one_line("one\nline") == "one\\nline"
