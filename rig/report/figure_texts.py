"""Names in figures and tables as they were written: the name of a record is no formula, no row and no command, whatever
signs are in it."""

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def as_written(figure: "Figure") -> None:
    """To be called when all is drawn and before it is saved: no text is read as mathematics, and signs that no font has
    and no SVG may hold are spelled out."""
    from matplotlib.axis import Axis
    from matplotlib.text import Text

    numbers = {text for axis in figure.findobj(Axis) for text in axis.findobj(Text)}  # powers of ten are mathematics
    titles = {axis.label for axis in figure.findobj(Axis) if isinstance(axis, Axis)}
    for text in {*figure.findobj(Text)} - (numbers - titles):
        assert isinstance(text, Text)
        text.set_parse_math(False)
        said = text.get_text()
        if not said.replace("\n", "").isprintable():
            text.set_text(lines_spelled_out(said))


def spelled_out(text: str) -> str:
    """One line; what no font has and what moves a cursor is written as Python writes it."""
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode("ascii") for each in text)


def lines_spelled_out(text: str) -> str:
    """The same of a text of lines."""
    return "\n".join(map(spelled_out, text.split("\n")))


def in_markdown(text: str) -> str:
    """The cell of a table in Markdown that shows `text`."""
    return re.sub(r"([\\|<&`\[*])", r"\\\1", spelled_out(text))
