"""The texts of a figure as they were written: the name of a record is no formula, whatever signs are in it."""

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
            text.set_text("".join(_printable(letter) for letter in said))


def _printable(letter: str) -> str:
    return letter if letter.isprintable() or letter == "\n" else letter.encode("unicode_escape").decode("ascii")
