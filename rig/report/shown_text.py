"""Text of others (names, facts, messages) as it may be shown: on a terminal, in a figure, on a page, in a table.

Letters, signs and spaces stay. Anything else is spelled out as Python writes it: it would move a terminal's cursor,
colour or turn the line, and no font has it.
"""

import unicodedata


def in_one_line(text: str) -> str:
    """The text as one line, so that one value cannot pass for several lines of ours."""
    if text.isprintable():
        return text
    return "".join(each if _stays(each) else each.encode("unicode_escape").decode("ascii") for each in text)


def in_lines(text: str) -> str:
    """The same of a text whose line breaks are meant."""
    return "\n".join(map(in_one_line, text.split("\n")))


def _stays(letter: str) -> bool:
    return letter.isprintable() or unicodedata.category(letter) == "Zs"  # a space, in whatever width
