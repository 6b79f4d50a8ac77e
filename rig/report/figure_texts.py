"""Names in figures and tables as they were written: the name of a record is no formula, no row and no command, whatever
signs are in it."""

import re
from typing import TYPE_CHECKING, Any

from rig.report.shown_text import in_lines, in_one_line

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
        content = text.get_text()
        if not content.replace("\n", "").isprintable():
            text.set_text(in_lines(content))


def on_terminal(figure: Any) -> str:
    """A figure of plotext, over seconds, as text without colours; the figure is empty afterwards."""
    figure.label("s", "x")
    text = str(figure.build())
    figure.clear()
    return re.sub(r"\x1b\[[0-9;]*m", "", text)


def in_markdown(text: str) -> str:
    """The cell of a table in Markdown that shows `text`."""
    return re.sub(r"([\\|<&`\[*])", r"\\\1", in_one_line(text))
